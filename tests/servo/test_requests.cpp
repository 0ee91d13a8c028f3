// SPDX-License-Identifier: MIT
// What is carried out in which state, what is refused, and that a refusal changes nothing.
#include <gtest/gtest.h>
#include <ehsid/forgetting.hpp>

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "session.hpp"

namespace test {
namespace {

using servo::Reason;
using servo::State;

TEST(Requests, SaysWhoItIs) {
  Host host;
  const Heard identity = host.hello();
  EXPECT_EQ(identity.kind, 0x81);
  ASSERT_EQ(identity.body.size(), 20U);
  EXPECT_EQ(at<std::uint16_t>(identity.body, 0), 3);           // protocol
  EXPECT_EQ(identity.body[5], (1U << ehsid::kPolicies) - 1U);  // a bit for each policy
  EXPECT_EQ(at<std::uint16_t>(identity.body, 6), 0xC0);        // n = 6 and 7
  EXPECT_EQ(Packet(identity.body.begin() + 8, identity.body.end()),
            (Packet{'t', 'e', 's', 't', 0, 0, 0, 0, 0, 0, 0, 0}));
}

TEST(Requests, HelloClosesTheValveFromEverywhere) {
  for (const bool tripped : {false, true}) {
    Host host = running();
    host.sample(0, 0.0F, 0.05F);
    ASSERT_NE(host.target.valve_command_v(), 0.0F);
    if (tripped) {
      host.wait(101);
    }
    EXPECT_EQ(host.hello().kind, 0x81);
    EXPECT_EQ(host.target.state(), State::idle);
    EXPECT_EQ(host.target.valve_command_v(), 0.0F);
    expect_refused(host, host.sample(1, 0.0F), Reason::state);
  }
}

TEST(Requests, HelloIsAnsweredAnewEachTime) {
  Host host = running();
  host.hello();
  expect_done(host.configure(), State::ready);
  --host.sequence;
  --host.sequence;  // hello with the sequence of the last hello: carried out all the same
  EXPECT_EQ(host.hello().kind, 0x81);
  EXPECT_EQ(host.target.state(), State::idle);
}

TEST(Requests, RequestsOutOfTheirState) {
  const auto expect_all_refused = [](Host& host, const std::vector<Heard>& answers) {
    for (const Heard& answer : answers) {
      expect_refused(host, answer, Reason::state);
    }
  };
  Host idle;
  expect_all_refused(idle, {idle.start(), idle.sample(0, 0.0F), idle.resume(), idle.stop()});
  Host ready;
  ready.configure();
  expect_all_refused(ready, {ready.sample(0, 0.0F), ready.resume()});
  expect_done(ready.stop(), State::ready);
  Host moving = running();
  expect_all_refused(moving, {moving.configure(), moving.start(), moving.resume()});
  EXPECT_EQ(moving.target.state(), State::running);
  Host safe = running();
  safe.wait(101);
  expect_all_refused(safe, {safe.configure(), safe.start(), safe.sample(0, 0.0F)});
  EXPECT_EQ(safe.target.state(), State::safe);
}

TEST(Requests, LengthsOffByOneChangeNothing) {
  Settings seeded;
  seeded.flags |= servo::kSeed;
  seeded.seed.assign(6 + 6 + 15 + 1, 1.0F);
  const std::vector<std::pair<std::uint8_t, Packet>> requests = {
      {1, {1, 0}},
      {2, Settings().bytes()},
      {2, seeded.bytes()},
      {3, Body().add(5U).bytes},
      {4, Body().add(1U).reals({0.0F, 0.0F, 0.0F, 0.0F}).bytes},
      {5, {}},
      {6, {}},
  };
  for (const bool in_run : {false, true}) {
    Host host = in_run ? running() : Host();
    if (in_run) {
      host.sample(0, 0.0F, 0.05F);
    }
    const State state = host.target.state();
    const float valve = host.target.valve_command_v();
    for (const auto& [kind, body] : requests) {
      Packet longer = body;
      longer.push_back(0);
      expect_refused(host, host.ask(kind, longer), Reason::unknown);
      if (!body.empty()) {
        expect_refused(host, host.ask(kind, {body.begin(), body.end() - 1}), Reason::unknown);
      }
      ASSERT_EQ(host.target.state(), state);
      ASSERT_EQ(host.target.valve_command_v(), valve);
    }
    for (const int kind : {0x00, 0x07, 0x7F}) {
      expect_refused(host, host.ask(static_cast<std::uint8_t>(kind)), Reason::unknown);
    }
    if (in_run) {
      EXPECT_EQ(host.sample(1, 0.0F).kind, 0x84);
    }
  }
}

TEST(Requests, SamplesOutOfOrder) {
  Host host = running({}, 0xFFFFFFFFU);
  for (const std::uint32_t wrong : {0xFFFFFFFEU, 12345U, 1000U}) {  // behind, or too far ahead
    const Heard refused = host.sample(wrong, 0.0F);
    expect_refused(host, refused, Reason::order);
    EXPECT_EQ(expected_of(refused), 0xFFFFFFFFU);
  }
  EXPECT_EQ(host.sample(0xFFFFFFFFU, 0.0F).kind, 0x84);
  expect_refused(host, host.sample(0xFFFFFFFFU, 0.0F), Reason::order);  // asked anew, not again
  EXPECT_EQ(host.sample(0, 0.0F).kind, 0x84);                           // the number wraps
}

TEST(Requests, LostCycles) {
  Host host = running({}, 0xFFFFFFFFU);
  EXPECT_EQ(host.sample(999, 0.0F).kind, 0x84);  // 1000 cycles were lost
  const Heard refused = host.sample(999, 0.0F);
  expect_refused(host, refused, Reason::order);
  EXPECT_EQ(expected_of(refused), 1000U);
  EXPECT_EQ(host.sample(1000, 0.0F).kind, 0x84);
}

TEST(Requests, SurvivesWhateverComes) {
  std::mt19937 random(6);
  Host host = running();
  for (int i = 0; i < 20'000; ++i) {
    Packet packet(3 + random() % 40);
    for (std::uint8_t& byte : packet) {
      byte = static_cast<std::uint8_t>(random());
    }
    packet[0] = static_cast<std::uint8_t>(random() % 9);
    host.send(framed(packet));
    host.wait(static_cast<std::uint32_t>(random() % 3));
    const State state = host.target.state();
    ASSERT_TRUE(state == State::running || host.target.valve_command_v() == 0.0F);
    ASSERT_LE(std::fabs(host.target.valve_command_v()), 6.0F);
    if (state != State::running) {
      host.hello();
      host.configure();
      host.start();
    }
  }
}

}  // namespace
}  // namespace test
