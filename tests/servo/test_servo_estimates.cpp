// SPDX-License-Identifier: MIT
// `configure_servo` through frames, C API and settings: what is told is that of ehsid::ServoEstimator on the same samples,
// bit for bit; what is refused changes nothing; and the gain of the controller follows K where it is trusted.
#include <gtest/gtest.h>
#include <ehsid/servo_estimator.hpp>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "session.hpp"

namespace test {
namespace {

using Estimator = ehsid::ServoEstimator<float, EHSID_MAX_DELAY>;
using servo::Reason;
using servo::State;

constexpr float kDt = 0.01F;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// The servo of Eq. (5) in small steps, with noise on its sensor.
class Plant {
 public:
  explicit Plant(double gain) : gain_(gain) {}

  float measured() { return static_cast<float>(position_) + 5e-6F * noise_(random_); }
  void advance(float volts) {
    constexpr int kSteps = 50;
    constexpr double kRate = 25.0;
    constexpr double kDamping = 0.4;
    const double h = static_cast<double>(kDt) / kSteps;
    for (int i = 0; i < kSteps; ++i) {
      acceleration_ += h * (kRate * kRate * (gain_ * static_cast<double>(volts) - velocity_) -
                            2.0 * kDamping * kRate * acceleration_);
      velocity_ += h * acceleration_;
      position_ += h * velocity_;
    }
  }
  void scale(double factor) { gain_ *= factor; }

 private:
  std::mt19937 random_{7};
  std::uniform_real_distribution<float> noise_{-1.7F, 1.7F};
  double gain_;
  double position_ = 0.1;
  double velocity_ = 0.0;
  double acceleration_ = 0.0;
};

std::uint32_t bits(float value) {
  std::uint32_t word = 0;
  std::memcpy(&word, &value, sizeof word);
  return word;
}

std::uint8_t servo_status_of(const Heard& result) { return at<std::uint8_t>(result.body, 12); }
std::uint8_t servo_flags_of(const Heard& result) { return at<std::uint8_t>(result.body, 13); }

void expect_same(const Heard& result, const ehsid::TrackedServo<float>& told) {
  ASSERT_EQ(result.kind, 0x87);
  ASSERT_EQ(result.body.size(), 51U);
  std::size_t place = 14;
  for (const auto* value : {&told.gain, &told.omega_n, &told.xi}) {
    EXPECT_EQ(at<std::uint32_t>(result.body, place), bits(value->value));
    EXPECT_EQ(at<std::uint32_t>(result.body, place + 4), bits(value->half_width));
    EXPECT_EQ(result.body[place + 8], static_cast<int>(value->reason));
    place += 9;
  }
}

/// Random steps of the command, a hold, a sample that is not finite, a new start, and a change of K: no two of the settings are equal
/// or at their default, so that two which are exchanged show.
TEST(ServoEstimates, AreThoseOfTheEstimator) {
  ServoSettings settings;
  settings.delay = 2;
  settings.flags = 0;
  settings.drift = 0.05F;
  settings.tolerance = 0.25F;
  Host host = running(settings);
  Estimator estimator;
  ASSERT_EQ(estimator.configure({kDt, 2, 0.05F, 0.25F}), ehsid::Status::ok);
  Plant plant(0.05);
  std::mt19937 random{3};
  float wanted = 0.0F;
  float late = 0.0F;  // one more sample of delay than the plant has by itself
  int trusted = 0;
  for (std::uint32_t k = 0; k < 2500 && !::testing::Test::HasFailure(); ++k) {
    if (k % 25 == 0) {
      wanted = k >= 1000 && k < 1200 ? 0.0F : (random() % 2 == 0 ? 2.0F : -1.5F);
    }
    if (k == 1700) {
      plant.scale(1.5);
    }
    if (k ==
        1300) {  // the servo moves on meanwhile: what follows is the first sample behind a hole
      host.stop();
      expect_done(host.start(k), State::running);
      static_cast<void>(estimator.step(kNan, kNan));
      for (int i = 0; i < 20; ++i) {
        plant.advance(late);
      }
    }
    const float position = k == 800 ? kNan : plant.measured();
    const Heard result = host.sample(k, position, 0.0F, 0.0F, wanted);
    const ehsid::Status status = estimator.step(command_of(result), position);
    EXPECT_EQ(servo_status_of(result), static_cast<int>(status));
    expect_same(result, estimator.servo());
    trusted += estimator.servo().gain.trusted ? 1 : 0;
    plant.advance(late);
    late = command_of(result);
  }
  EXPECT_GT(trusted, 0) << "never trusted: the test compares too little";
  EXPECT_LT(trusted, 2500);
}

/// A loop on the target: the gain is bandwidth / K within its step and bounds, and the fixed one where K is not trusted.
TEST(ServoEstimates, TheGainFollowsATrustedK) {
  for (const double gain : {0.05, -0.05}) {
    ServoSettings settings;
    settings.controller = {kDt, 40.0F, 0.0F, 6.0F, 3.0F, 10.0F, 200.0F, 0.05F};
    if (gain < 0.0) {
      settings.flags = 0;  // a loop with the wrong sign would run away
    }
    settings.flags |= servo::kFollowEstimate;
    Host host = running(settings);
    Plant plant(gain);
    std::mt19937 random{5};
    float reference = 0.1F;
    bool was_trusted = false;
    float last = 40.0F;
    int followed = 0;
    int trusted = 0;
    for (std::uint32_t k = 0; k < 3000 && !::testing::Test::HasFailure(); ++k) {
      if (k % 40 == 0) {
        reference = random() % 2 == 0 ? 0.12F : 0.08F;
      }
      const float direct = gain < 0.0 ? 50.0F * (reference - 0.1F) : 0.0F;
      const Heard result = host.sample(k, plant.measured(), reference, 0.0F, direct);
      const bool from_estimate = (servo_flags_of(result) & servo::kGainFromEstimate) != 0;
      EXPECT_EQ(from_estimate, was_trusted && gain > 0.0);
      if (!from_estimate) {
        EXPECT_EQ(gain_of(result), 40.0F);
      }
      EXPECT_LE(std::abs(gain_of(result) - last), from_estimate ? 2.001F : 200.0F);
      last = gain_of(result);
      followed += from_estimate ? 1 : 0;
      was_trusted = result.body[14 + 8] == 0;
      trusted += was_trusted ? 1 : 0;
      plant.advance(command_of(result));
    }
    EXPECT_GT(trusted, 0) << gain;
    EXPECT_EQ(followed > 0, gain > 0.0);
    if (gain > 0.0) {
      EXPECT_NEAR(last, 60.0F, 6.0F);  // 3 rad/s / 0.05 m/s/V, where K is trusted to a tenth
    }
  }
}

TEST(ServoConfiguration, EachSettingOutOfItsRangeIsRefused) {
  std::vector<ServoSettings> wrong;
  const auto add = [&](auto change) {
    ServoSettings settings;
    change(settings);
    wrong.push_back(settings);
  };
  add([](ServoSettings& s) { s.delay = 0; });
  add([](ServoSettings& s) { s.delay = 21; });
  for (const std::uint8_t flag : {servo::kOffset, servo::kReset, servo::kSeed}) {
    add([flag](ServoSettings& s) { s.flags |= flag; });
  }
  add([](ServoSettings& s) { s.flags |= 0x20; });
  add([](ServoSettings& s) { s.drift = -0.1F; });
  add([](ServoSettings& s) { s.drift = kNan; });
  add([](ServoSettings& s) { s.tolerance = 0.0F; });
  add([](ServoSettings& s) { s.tolerance = std::numeric_limits<float>::infinity(); });
  add([](ServoSettings& s) { s.watchdog_ms = 0; });
  add([](ServoSettings& s) { s.watchdog_ms = 60'001; });
  for (std::size_t i = 0; i < 8; ++i) {
    add([i](ServoSettings& s) { s.controller[i] = kNan; });
  }
  for (const ServoSettings& settings : wrong) {
    Host host;
    expect_refused(host, host.configure(settings), Reason::configuration, EHSID_INVALID_ARGUMENT);
    EXPECT_EQ(host.target.state(), State::idle);
    expect_done(host.configure(ServoSettings{}), State::ready);
  }
}

TEST(ServoConfiguration, ABodyOfAnotherLengthIsUnknown) {
  Host host;
  Packet body = ServoSettings{}.bytes();
  body.push_back(0);
  expect_refused(host, host.ask(7, body), Reason::unknown);
  body.resize(45);
  expect_refused(host, host.ask(7, body), Reason::unknown);
}

/// One storage has both estimators: a refused one must not touch the other, and the next one begins anew.
TEST(ServoConfiguration, ARefusedOneLeavesTheOtherKind) {
  Settings wrong_arx;
  wrong_arx.forgetting[7] = 0.5F;  // critical_ratio of the F-ratio: the estimator refuses it
  ServoSettings wrong_servo;
  wrong_servo.tolerance = -1.0F;
  for (const bool tracks : {false, true}) {
    Host host;
    Host undisturbed;
    Drive drive;
    Drive same;
    for (Host* each : {&host, &undisturbed}) {
      tracks ? each->configure(ServoSettings{}) : each->configure();
      each->start();
    }
    for (int i = 0; i < 100; ++i) {
      ASSERT_EQ(drive.step(host).body, same.step(undisturbed).body);
    }
    host.stop();
    undisturbed.stop();
    expect_refused(host, tracks ? host.configure(wrong_arx) : host.configure(wrong_servo),
                   Reason::configuration, EHSID_INVALID_ARGUMENT);
    for (Host* each : {&host, &undisturbed}) {
      expect_done(each->start(100), State::running);
    }
    for (int i = 0; i < 100; ++i) {
      const Heard result = drive.step(host);
      ASSERT_EQ(result.kind, tracks ? 0x87 : 0x84);
      ASSERT_EQ(result.body, same.step(undisturbed).body);
    }
  }
}

TEST(ServoConfiguration, OneKindBehindTheOtherBeginsAnew) {
  Host host;
  Drive first;
  host.configure();
  host.start();
  for (int i = 0; i < 50; ++i) {
    first.step(host);
  }
  host.stop();
  expect_done(host.configure(ServoSettings{}), State::ready);
  expect_done(host.start(), State::running);
  Host fresh = running(ServoSettings{});
  Drive drive;
  Drive same;
  for (int i = 0; i < 200; ++i) {
    ASSERT_EQ(drive.step(host).body, same.step(fresh).body);
  }
  host.stop();
  expect_done(host.configure(), State::ready);
  expect_done(host.start(200), State::running);
  EXPECT_EQ(drive.step(host).kind, 0x84);
}

}  // namespace
}  // namespace test
