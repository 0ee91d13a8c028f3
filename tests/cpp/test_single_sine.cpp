// SPDX-License-Identifier: MIT
#include <ehsid/single_sine.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace {

using Sine = ehsid::SingleSine<double>;
constexpr double kForgotten = 0.004;  // a sample: 0.98 is kept of what five samples ago was

TEST(SingleSine, IsToldWithItsAngle) {
  for (const double angle : {0.01, 0.05, 0.2}) {
    Sine sine;
    for (int k = 0; k < 2000; ++k) {
      sine.take(1.5 + 3.0 * std::sin(angle * k + 0.3), 5, kForgotten);
    }
    EXPECT_TRUE(sine.sine()) << angle;
    EXPECT_FALSE(sine.clearly_none()) << angle;
    EXPECT_EQ(sine.samples_not_sine(), 0);
    // The series for the angle ends behind a^4; here the angle between two used samples is 1 at most.
    EXPECT_NEAR(std::sqrt(sine.squared_angle()) / angle, 1.0, 0.01) << angle;
  }
}

TEST(SingleSine, TwoSinesStepsAndNoiseAreNone) {
  std::mt19937 random{2};
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  double held = 0.0;
  Sine two;
  Sine steps;
  Sine noise;
  for (int k = 0; k < 2000; ++k) {
    held = k % 37 == 0 ? uniform(random) : held;
    two.take(std::sin(0.02 * k) + std::sin(0.13 * k), 5, kForgotten);
    steps.take(held, 5, kForgotten);
    noise.take(uniform(random), 5, kForgotten);
  }
  for (const Sine& one : {two, steps, noise}) {
    EXPECT_FALSE(one.sine());
    EXPECT_TRUE(one.clearly_none());
    EXPECT_GT(one.samples_not_sine(), 1500);
  }
}

TEST(SingleSine, NothingIsSaidOfACommandThatRests) {
  Sine sine;
  for (int k = 0; k < 2000; ++k) {
    sine.take(0.0, 5, kForgotten);
  }
  EXPECT_FALSE(sine.sine());
}

}  // namespace
