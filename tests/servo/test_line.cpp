// SPDX-License-Identifier: MIT
// Frames that come twice, damaged, late or back: nothing is carried out that must not be.
#include <gtest/gtest.h>

#include <random>

#include "session.hpp"

namespace test {
namespace {

using servo::State;

TEST(Line, ARequestAskedAgainIsNotCarriedOutAgain) {
  Host once = running();
  Host twice = running();
  Drive drive_once;
  Drive drive_twice;
  for (int i = 0; i < 100; ++i) {
    const Heard expected = drive_once.step(once);
    const Heard made = drive_twice.step(twice);
    EXPECT_EQ(theta_of(made), theta_of(expected));
    const Packet again = twice.send(twice.last);
    const Heard repeated = hear(again);
    EXPECT_EQ(repeated.body, made.body);
    EXPECT_EQ(repeated.sequence, made.sequence);
    EXPECT_EQ(repeated_of(made), i);
  }
}

TEST(Line, RefusalsAndStatesAreRepeatedToo) {
  Host host;
  host.hello();
  host.configure();
  const Packet configured = host.send(host.last);
  expect_done(hear(configured), State::ready);
  host.start(7);
  const Packet started = host.send(host.last);
  expect_done(hear(started), State::running);  // not "start in a state that is not ready"
  const Heard refused = host.sample(9, 0.0F);
  EXPECT_EQ(hear(host.send(host.last)).body, refused.body);
}

TEST(Line, LateRequestsAreDropped) {
  Host host = running();
  host.sample(0, 0.0F, 0.05F);
  const Packet first = host.last;
  host.stop();
  const Packet stop = host.last;
  host.start(1);
  const Heard result = host.sample(1, 0.0F, 0.05F);
  const Packet second = host.last;
  EXPECT_TRUE(host.send(stop).empty());
  EXPECT_TRUE(host.send(first).empty());
  EXPECT_EQ(host.target.state(), State::running);
  // They did not take the place of the last answer.
  EXPECT_EQ(hear(host.send(second)).body, result.body);
  EXPECT_EQ(bad_frames_of(host.sample(2, 0.0F)), 2);
}

/// Frames that a receiver drops in these bytes; a zero in the middle makes two out of one.
int dropped(const Packet& line) {
  servo::FrameReader reader;
  for (const std::uint8_t byte : line) {
    EXPECT_FALSE(reader.take(byte));
  }
  return reader.bad_frames.value();
}

TEST(Line, DamagedAndRepeatedFramesChangeNothing) {
  Host clean = running();
  Host faulty = running();
  Drive drive_clean;
  Drive drive_faulty;
  std::mt19937 random(5);
  int damaged = 0;
  for (int i = 0; i < 300; ++i) {
    const Heard expected = drive_clean.step(clean);
    const Heard made = drive_faulty.step(faulty);
    // All but the counters
    EXPECT_EQ(Packet(made.body.begin(), made.body.begin() + 40),
              Packet(expected.body.begin(), expected.body.begin() + 40));
    EXPECT_EQ(theta_of(made), theta_of(expected));
    EXPECT_EQ(bad_frames_of(made), damaged);
    EXPECT_EQ(repeated_of(made), i);

    Packet spoilt = faulty.last;
    spoilt[random() % (spoilt.size() - 1)] ^= static_cast<std::uint8_t>(1U << (random() % 8));
    damaged += dropped(spoilt);
    EXPECT_TRUE(faulty.send(spoilt).empty());
    EXPECT_EQ(hear(faulty.send(faulty.last)).body, made.body);
  }
  EXPECT_GE(damaged, 300);
}

TEST(Line, AnswersOnItsLineAreNotAnswered) {
  Host host = running();
  // Its own answer, as a line with an echo brings it back.
  EXPECT_TRUE(host.send(copy(servo::Servo().power_up("echo", nullptr))).empty());
  EXPECT_TRUE(host.send(framed({0x85, 9, 9, 1, 2, 0, 0, 0, 0, 0})).empty());
  EXPECT_EQ(bad_frames_of(host.sample(0, 0.0F)), 2);
}

}  // namespace
}  // namespace test
