// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <ehsid/servo_discretisation.hpp>
#include <servo/controller.hpp>
#include <servo/velocity_gain.hpp>
#include <servo/watchdog.hpp>

#include <cmath>
#include <limits>
#include <random>

namespace {

using servo::Command;
using servo::Controller;
using servo::ControllerSettings;
using servo::Sample;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Numbers that are exact in float32, so that the expected commands are, too.
ControllerSettings usual() {
  return {0.25F, 16.0F, 2.0F, 5.0F, 8.0F, 4.0F, 64.0F, 0.125F, true, true};
}

Controller made(const ControllerSettings& settings) {
  Controller controller;
  controller.configure(settings);
  return controller;
}

TEST(Controller, ProportionalWithFeedForward) {
  Controller controller = made(usual());
  // 16 (0.5 - 0.25) + 2 * 0.25 + 0.125
  const Command command = controller.command({0.25F, 0.5F, 0.25F, 0.125F});
  EXPECT_EQ(command.volts, 4.625F);
  EXPECT_FALSE(command.at_limit);
  EXPECT_FALSE(controller.gain_from_estimate());
}

TEST(Controller, DirectModeTakesTheDirectCommandAlone) {
  ControllerSettings settings = usual();
  settings.position_control = false;
  Controller controller = made(settings);
  EXPECT_EQ(controller.command({0.25F, 0.5F, 0.25F, -4.5F}).volts, -4.5F);
  const Command beyond = controller.command({0.25F, 0.5F, 0.25F, -5.5F});
  EXPECT_EQ(beyond.volts, -5.0F);
  EXPECT_TRUE(beyond.at_limit);
}

TEST(Controller, NeverBeyondItsLimit) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> exponent(-30.0F, 38.0F);
  Controller controller = made(usual());
  const auto number = [&] {
    const float size = std::pow(10.0F, exponent(random));
    return random() % 2 == 0 ? size : -size;
  };
  int at_limit = 0;
  for (int i = 0; i < 10'000; ++i) {
    const Command command = controller.command({number(), number(), number(), number()});
    ASSERT_LE(std::fabs(command.volts), 5.0F);
    ASSERT_EQ(command.at_limit, std::fabs(command.volts) == 5.0F);
    at_limit += command.at_limit ? 1 : 0;
  }
  EXPECT_GT(at_limit, 1000);
}

TEST(Controller, NothingThatIsNotFiniteReachesTheValve) {
  for (const bool position_control : {true, false}) {
    for (const float bad : {kNan, kInfinity, -kInfinity}) {
      for (int which = 0; which < 4; ++which) {
        ControllerSettings settings = usual();
        settings.position_control = position_control;
        Controller controller = made(settings);
        controller.retune(1.0F);
        ASSERT_NE(controller.gain(), 16.0F);
        Sample sample{0.25F, 0.5F, 0.25F, 0.125F};
        float* const members[] = {&sample.position_m, &sample.reference_m,
                                  &sample.reference_velocity_m_s, &sample.direct_v};
        *members[which] = bad;
        EXPECT_EQ(controller.command(sample).volts, 0.0F);
        EXPECT_EQ(controller.gain(), 16.0F);
        EXPECT_FALSE(controller.gain_from_estimate());
      }
    }
  }
  // Finite numbers whose sum is none
  Controller controller = made(usual());
  EXPECT_EQ(controller.command({-3e38F, 3e38F, -3e38F, 0.0F}).volts, 0.0F);
}

TEST(Controller, TheGainGoesToBandwidthOverVelocityGainStepByStep) {
  Controller controller = made(usual());
  // 8 / 0.25 = 32, in steps of 0.125 * 16 = 2 from 16 on
  for (int i = 1; i <= 8; ++i) {
    controller.retune(0.25F);
    EXPECT_EQ(controller.gain(), 16.0F + 2.0F * static_cast<float>(i));
    EXPECT_TRUE(controller.gain_from_estimate());
  }
  controller.retune(0.25F);
  EXPECT_EQ(controller.gain(), 32.0F);
  controller.retune(0.25F * 32.0F / 33.0F);  // a smaller change than a step is made whole
  EXPECT_FLOAT_EQ(controller.gain(), 33.0F);
  controller.retune(1.0F);  // 8 wanted
  EXPECT_FLOAT_EQ(controller.gain(), 31.0F);
}

TEST(Controller, TheGainStaysWithinItsBoundsAndSteps) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> exponent(-40.0F, 38.0F);
  Controller controller = made(usual());
  float before = controller.gain();
  for (int i = 0; i < 10'000; ++i) {
    const int narrower = 1 + i / 100;  // from all float32 to a hundredth of its magnitudes
    controller.retune(std::pow(10.0F, exponent(random) / static_cast<float>(narrower)));
    ASSERT_GE(controller.gain(), 4.0F);
    ASSERT_LE(controller.gain(), 64.0F);
    // One rounding of the sum, half a unit in the last place of at most 64: 64 * 2^-24.
    if (controller.gain_from_estimate()) {
      ASSERT_LE(std::fabs(controller.gain() - before), 2.0F + 64.0F * 6e-8F);
    }
    before = controller.gain();
  }
}

TEST(Controller, BackToTheFixedGainAtOnce) {
  for (const float untrusted : {0.0F, -1.0F, kNan}) {
    Controller controller = made(usual());
    for (int i = 0; i < 20; ++i) {
      controller.retune(0.125F);
    }
    ASSERT_GT(controller.gain(), 40.0F);
    controller.retune(untrusted);
    EXPECT_EQ(controller.gain(), 16.0F);
    EXPECT_FALSE(controller.gain_from_estimate());
  }
}

TEST(Controller, FollowsOnlyWhereItIsTold) {
  ControllerSettings settings = usual();
  settings.follow_estimate = false;
  Controller controller = made(settings);
  controller.retune(0.25F);
  EXPECT_EQ(controller.gain(), 16.0F);
  EXPECT_FALSE(controller.gain_from_estimate());
}

TEST(ControllerSettings, Ranges) {
  ASSERT_TRUE(usual().valid());
  const auto with = [](float ControllerSettings::* member, float value) {
    ControllerSettings settings = usual();
    settings.*member = value;
    return settings.valid();
  };
  using S = ControllerSettings;
  for (float S::* const member :
       {&S::sample_time_s, &S::fixed_gain_v_m, &S::feed_forward_v_s_m, &S::command_limit_v,
        &S::bandwidth_rad_s, &S::gain_min_v_m, &S::gain_max_v_m, &S::gain_step}) {
    EXPECT_FALSE(with(member, kNan));
    EXPECT_FALSE(with(member, kInfinity));
    EXPECT_EQ(with(member, -1.0F), member == &S::feed_forward_v_s_m);
  }
  EXPECT_FALSE(with(&S::sample_time_s, 0.0F));
  EXPECT_FALSE(with(&S::command_limit_v, 0.0F));
  EXPECT_FALSE(with(&S::gain_min_v_m, 16.5F));
  EXPECT_FALSE(with(&S::gain_max_v_m, 15.5F));
  EXPECT_TRUE(with(&S::gain_min_v_m, 16.0F));
  EXPECT_TRUE(with(&S::gain_max_v_m, 16.0F));
  // Without position control nothing but the limit and the time need be set.
  const S direct{0.01F, 0.0F, 0.0F, 5.0F, 0.0F, 0.0F, 0.0F, 0.0F, false, false};
  EXPECT_TRUE(direct.valid());
}

/// Relative error of the gain in float32, u = 2^-24 a rounding: each a_i, its product with i and three partial sums
/// make C(1) wrong by at most 5 u S, with S the sum of |i a_i|; each b_i and three partial sums B(1) by 4 u times
/// the sum of |b_i|; T, T C(1) and the quotient are rounded once each.
double tolerance(const ehsid::Vector<double, 6>& theta) {
  double s = 0.0;
  double c = 0.0;
  double b = 0.0;
  double b_size = 0.0;
  for (int i = 0; i < 3; ++i) {
    s += (i + 1) * std::fabs(theta[i]);
    c -= (i + 1) * theta[i];
    b += theta[3 + i];
    b_size += std::fabs(theta[3 + i]);
  }
  return std::ldexp(1.0, -24) * (5.0 * s / std::fabs(c) + 4.0 * b_size / std::fabs(b) + 3.0);
}

/// The gain of a discretised servo is the K that it was made from.
void expect_gain(const ehsid::ContinuousServo<double>& made_from, double dt) {
  ehsid::Vector<double, 6> exact;
  ASSERT_EQ(ehsid::discretise(made_from, dt, exact), ehsid::Status::ok);
  float theta[6];
  for (int i = 0; i < 6; ++i) {
    theta[i] = static_cast<float>(exact[i]);
  }
  EXPECT_NEAR(servo::velocity_gain(theta, 3, 3, static_cast<float>(dt)), made_from.gain,
              made_from.gain * tolerance(exact))
      << made_from.gain << " " << made_from.omega_n << " " << made_from.xi << " " << dt;
}

TEST(VelocityGain, IsThatOfTheServo) {
  for (const double gain : {0.02, 0.5}) {
    for (const double omega_n : {20.0, 80.0, 250.0}) {
      for (const double xi : {0.2, 0.7, 1.5}) {
        for (const double dt : {0.001, 0.005}) {
          expect_gain({gain, omega_n, xi}, dt);
        }
      }
    }
  }
}

TEST(VelocityGain, AConstantTermIsNoGain) {
  // y(k) = y(k-1) + 0.5 u(k-1): 0.5 / T; the last number is not read.
  const float theta[] = {-1.0F, 0.0F, 0.0F, 0.5F, 0.0F, 0.0F, 100.0F};
  EXPECT_EQ(servo::velocity_gain(theta, 3, 3, 0.25F), 2.0F);
}

TEST(VelocityGain, ZeroWhereThereIsNone) {
  const float zero[6] = {};
  EXPECT_EQ(servo::velocity_gain(zero, 3, 3, 0.01F), 0.0F);
  const float backwards[] = {-1.0F, 0.0F, 0.0F, -0.5F, 0.0F, 0.0F};
  EXPECT_EQ(servo::velocity_gain(backwards, 3, 3, 0.01F), 0.0F);
  const float no_integrator[] = {0.0F, 0.0F, 0.0F, 0.5F, 0.0F, 0.0F};
  EXPECT_EQ(servo::velocity_gain(no_integrator, 3, 3, 0.01F), 0.0F);
  const float not_finite[] = {-1.0F, 0.0F, kNan, 0.5F, 0.0F, 0.0F};
  EXPECT_EQ(servo::velocity_gain(not_finite, 3, 3, 0.01F), 0.0F);
}

TEST(Watchdog, ExpiresAfterItsLimitAlsoWhereTheClockWraps) {
  for (const std::uint32_t fed : {0U, 1000U, 0xFFFFFFFAU}) {
    servo::Watchdog watchdog;
    watchdog.set_limit(10);
    watchdog.feed(fed);
    EXPECT_FALSE(watchdog.expired(fed));
    EXPECT_FALSE(watchdog.expired(fed + 10U));
    EXPECT_TRUE(watchdog.expired(fed + 11U));
    watchdog.feed(fed + 11U);
    EXPECT_FALSE(watchdog.expired(fed + 12U));
  }
}

}  // namespace
