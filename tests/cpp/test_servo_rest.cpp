// SPDX-License-Identifier: MIT
#include <ehsid/servo_rest.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace {

using Rest = ehsid::RestDetector<double>;
constexpr double kNoise = 1e-5;

struct Sensor {
  std::mt19937 random{4};
  std::normal_distribution<double> normal;
  double operator()(double position) { return position + kNoise * normal(random); }
};

TEST(RestDetector, TwoCalmBlocksAreARest) {
  Rest rest;
  Sensor sensor;
  rest.restart(20);
  for (int k = 0; k < 39; ++k) {
    rest.take(sensor(0.1));
    EXPECT_FALSE(rest.resting());
  }
  rest.take(sensor(0.1));
  EXPECT_TRUE(rest.resting());
  // The variance of 20 third differences scatters by less than a half.
  EXPECT_NEAR(rest.threshold(0.0) / (Rest::kSpan * kNoise), 1.0, 0.5);
  rest.moved();
  EXPECT_FALSE(rest.resting());
}

TEST(RestDetector, MotionIsNoneHoweverGentlyItBegins) {
  Rest rest;
  Sensor sensor;
  rest.restart(20);
  for (int k = 0; k < 200; ++k) {
    rest.take(sensor(0.0));
  }
  // A block of it covers 20 deviations of the noise.
  for (int k = 0; k < 60; ++k) {
    rest.take(sensor(kNoise * k));
  }
  EXPECT_FALSE(rest.resting());
}

/// Fast motion looks like noise in third differences; the calm before it says what the noise is, and may rise by 5 %.
TEST(RestDetector, NoiseIsThatOfTheCalmestBlock) {
  Rest rest;
  Sensor sensor;
  rest.restart(20);
  for (int k = 0; k < 200; ++k) {
    rest.take(sensor(0.0));
  }
  const double calm = rest.threshold(0.0);
  for (int k = 0; k < 200; ++k) {
    rest.take(sensor(0.01 * std::sin(1.5 * k)));
    EXPECT_FALSE(k > 20 && rest.resting());
  }
  // Ten blocks at most: 1.05^10 of the variance.
  EXPECT_LE(rest.threshold(0.0), calm * std::sqrt(std::pow(1.05, 10)) * (1.0 + 1e-9));
  EXPECT_GT(rest.threshold(0.0), calm);
}

TEST(RestDetector, NoNoiseAtAllDoesNotEndItsWork) {
  Rest rest;
  Sensor sensor;
  rest.restart(20);
  for (int k = 0; k < 60; ++k) {
    rest.take(0.2);
  }
  EXPECT_TRUE(rest.resting());
  for (int k = 0; k < 100; ++k) {
    rest.take(sensor(0.2));
  }
  EXPECT_GT(rest.threshold(0.0), kNoise);  // 0 was no noise that could rise by 5 %
}

}  // namespace
