// SPDX-License-Identifier: MIT
// Zero-order hold against Eigen's matrix exponential; limits, refusals and what float adds are in
// test_servo_model.cpp. In 120 digits it is checked by tests/python/core/test_servo_model.py.
#include <ehsid/servo_discretisation.hpp>

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>

namespace {

using ehsid::ContinuousServo;
using ehsid::Sensitive;
using ehsid::Status;
using Theta = ehsid::Vector<double, 6>;

constexpr double kEps = std::numeric_limits<double>::epsilon();

struct Case {
  double x;   // omega_n dt
  double xi;  // one: the two poles coincide
};

class ZeroOrderHold : public testing::TestWithParam<Case> {};

TEST_P(ZeroOrderHold, DifferenceEquationPassesThroughTheSamplesOfTheContinuousServo) {
  constexpr double kDtS = 0.004;
  constexpr int kSamples = 40;
  const auto [x, xi] = GetParam();
  const double omega_n = x / kDtS;
  Theta theta;
  ASSERT_EQ(ehsid::discretise(ContinuousServo<double>{0.3, omega_n, xi}, kDtS, theta), Status::ok);

  // Eq. (5) in states (y, y'/K, y''/(K omega_n)) and the held command: one step is exp(M dt).
  Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
  m(0, 1) = 0.3;
  m(1, 2) = omega_n;
  m.row(2) << 0.0, -omega_n, -2.0 * xi * omega_n, omega_n;
  const Eigen::Matrix4d transition = (m * kDtS).exp();

  std::mt19937 random(4);
  std::uniform_real_distribution<double> draw(-1.0, 1.0);
  Eigen::Vector4d state = Eigen::Vector4d::Zero();
  std::array<double, kSamples> u{};
  std::array<double, kSamples> y{};
  double largest = 0.0;
  for (std::size_t k = 0; k < u.size(); ++k) {
    y[k] = state[0];
    largest = std::max(largest, std::abs(y[k]));
    u[k] = draw(random);
    state[3] = u[k];
    state = (transition * state).eval();
  }
  for (std::size_t k = 3; k < u.size(); ++k) {
    double predicted = 0.0;
    double terms = 0.0;  // their roundings add up
    for (std::size_t i = 0; i < 3; ++i) {
      const double past = -theta[static_cast<int>(i)] * y[k - 1 - i];
      const double driven = theta[static_cast<int>(3 + i)] * u[k - 1 - i];
      predicted += past + driven;
      terms += std::abs(past) + std::abs(driven);
    }
    // Eigen's exponential halves the matrix and squares: relative error of the order of its norm.
    const double norm = (m * kDtS).cwiseAbs().rowwise().sum().maxCoeff();
    ASSERT_NEAR(predicted, y[k], 32.0 * (1.0 + norm) * kEps * (terms + largest)) << "sample " << k;
  }
  EXPECT_GT(largest, 0.0);
}

INSTANTIATE_TEST_SUITE_P(Servos, ZeroOrderHold,
                         testing::Values(Case{0.01, 0.1}, Case{0.1, 0.0}, Case{0.3, 1.0},
                                         Case{0.5, 0.05}, Case{1.0, 0.7}, Case{1.0, 1.0},
                                         Case{1.0, 4.0}, Case{3.0, 0.2}, Case{8.0, 0.3},
                                         Case{0.2, 20.0}, Case{3.0, 0.0}, Case{5.0, 0.0}));

TEST(SampledServo, NumeratorAndDenominatorHaveTheSameSumAtOne) {
  // Velocity gain K: b1 + b2 + b3 = Q(1) K dt. Sampled below half its period each b is positive.
  for (double x = 1e-5; x < 3.0; x *= 3.0) {
    for (double xi = 0.01; xi < 10.0; xi *= 3.0) {
      Theta theta;
      ASSERT_EQ(ehsid::discretise(ContinuousServo<double>{2.0, x, xi}, 1.0, theta), Status::ok);
      const double q_at_one = ehsid::sample_servo(2.0 * xi * x, x * x).q_at_one.value;
      EXPECT_NEAR(theta.tail<3>().sum(), 2.0 * q_at_one, 8.0 * kEps * q_at_one);
      EXPECT_GT(theta.tail<3>().minCoeff(), 0.0) << "x " << x << ", xi " << xi;
      // The denominator holds the integrator: A(1) = 0, up to the rounding of its terms (8 at most).
      EXPECT_NEAR(1.0 + theta.head<3>().sum(), 0.0, 8.0 * kEps);
    }
  }
}

TEST(SampledServo, TwiceThePeriodSquaresThePoles) {
  for (double x = 1e-3; x < 4.0; x *= 2.3) {
    for (double xi = 0.02; xi < 4.0; xi *= 2.3) {
      const auto once = ehsid::sample_servo(2.0 * xi * x, x * x);
      const auto twice = ehsid::sample_servo(4.0 * xi * x, 4.0 * x * x);
      const double q2 = once.q2.value;
      const double v = 2.0 * xi * x;
      EXPECT_NEAR(twice.q2.value / (q2 * q2), 1.0, (32.0 + 8.0 * v) * kEps);
      // Q_2(1) = (1 - z1^2)(1 - z2^2) = Q(1) Q(-1), and Q(-1) = 2 + 2 q2 - Q(1)
      const double q = once.q_at_one.value;
      EXPECT_NEAR(twice.q_at_one.value, q * (2.0 + 2.0 * q2 - q), 64.0 * kEps * q * 4.0);
    }
  }
}

TEST(SampledServo, AfterALongPeriodTheStartIsForgotten) {
  // exp(-v) and the poles vanish: Q(z) = z^2, and b is the step response of a velocity source that
  // lags by v / y = 2 xi / omega_n dt = 1/64.
  const double rate = ehsid::kLargestServoRate<double>;
  const auto servo = ehsid::sample_servo(rate, 64.0 * rate);
  EXPECT_NEAR(servo.q_at_one.value, 1.0, 64.0 * kEps);
  EXPECT_LE(std::abs(servo.q2.value), std::exp(-700.0));
  EXPECT_NEAR(servo.b1.value, 1.0 - 1.0 / 64.0, 64.0 * kEps);
}

TEST(Sensitive, DerivativesFollowTheRulesOfCalculus) {
  // f = (2 - v)(3 + v y + y) + (v - y) / 2
  for (const double v_value : {-1.5, 0.25, 2.0}) {
    for (const double y_value : {-0.5, 0.75, 4.0}) {
      const Sensitive<double> v{v_value, 1.0, 0.0};
      const Sensitive<double> y{y_value, 0.0, 1.0};
      const auto f = (2.0 - v) * (3.0 + v * y + y) + 0.5 * (v - y);
      const double factor = 3.0 + v_value * y_value + y_value;
      // Dyadic numbers of few digits: exact.
      EXPECT_EQ(f.value, (2.0 - v_value) * factor + 0.5 * (v_value - y_value));
      EXPECT_EQ(f.by_v, -factor + (2.0 - v_value) * y_value + 0.5);
      EXPECT_EQ(f.by_y, (2.0 - v_value) * (v_value + 1.0) - 0.5);
    }
  }
}

}  // namespace
