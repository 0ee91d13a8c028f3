// SPDX-License-Identifier: MIT
#include <ehsid/servo_filter.hpp>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include <cmath>
#include <random>

namespace {

using Filter = ehsid::ServoFilter<double>;
using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

Vector7 state_of(const Filter& filter) {
  const auto& s = filter.state();
  Vector7 x;
  x << s.position, s.velocity, s.acceleration, std::log(s.gain), std::log(s.rate),
      std::log(s.damping), s.bias;
  return x;
}

Matrix7 covariance_of(const Filter& filter) {
  Matrix7 p;
  for (int i = 0; i < 7; ++i) {
    for (int j = 0; j < 7; ++j) {
      p(i, j) = filter.covariance(i, j);
    }
  }
  return p;
}

/// One sample of the servo from this state, in steps of the Runge-Kutta method.
Vector7 moved(Vector7 x, double command) {
  constexpr int kSteps = 200;
  const double k = std::exp(x[3]);
  const double h = std::exp(x[4]);
  const double xi = std::exp(x[5]);
  const double demand = k * (command - x[6]);
  const auto slope = [&](const Eigen::Vector3d& s) -> Eigen::Vector3d {
    return {s[1], s[2], h * h * (demand - s[1]) - 2.0 * xi * h * s[2]};
  };
  Eigen::Vector3d s = x.head<3>();
  const double dt = 1.0 / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const Eigen::Vector3d a = slope(s);
    const Eigen::Vector3d b = slope(s + dt / 2 * a);
    const Eigen::Vector3d c = slope(s + dt / 2 * b);
    const Eigen::Vector3d d = slope(s + dt * c);
    s += dt / 6 * (a + 2 * b + 2 * c + d);
  }
  x.head<3>() = s;
  return x;
}

/// d moved / d x by central differences.
Matrix7 jacobian(const Vector7& x, double command) {
  Matrix7 f;
  for (int j = 0; j < 7; ++j) {
    const double step = 1e-5;
    Vector7 up = x;
    Vector7 down = x;
    up[j] += step;
    down[j] -= step;
    f.col(j) = (moved(up, command) - moved(down, command)) / (2.0 * step);
  }
  return f;
}

Filter started(double noise = 1e-4) {
  Filter filter;
  filter.start(0.8, 0.6, 0.4, {0.3, 0.2, 0.3, 0.1}, 4.0, noise);
  return filter;
}

constexpr Filter::Tuning kTuning{1e-6, 4.0, 1e-12, 0.0, false};

/// A textbook extended Kalman filter with full matrices and numeric sensitivities takes the same samples.
TEST(ServoFilter, IsTheExtendedKalmanFilterOfTheServo) {
  std::mt19937 random{5};
  std::normal_distribution<double> normal;
  Filter filter = started();
  Vector7 x = state_of(filter);
  Matrix7 p = covariance_of(filter);
  for (int k = 0; k < 200; ++k) {
    const double u = 2.0 * normal(random);
    const Matrix7 f = jacobian(x, u);
    // The disturbance is a velocity in front of the servo that is held for one sample: as the bias acts, over -k.
    const double k_now = std::exp(x[3]);
    const Vector7 g = -f.col(6) / k_now;
    Vector7 of_motion = Vector7::Zero();
    of_motion.head<3>() = g.head<3>();
    const double q = 0.01 * k_now * k_now * 0.5 * ((u - x[6]) * (u - x[6]) + kTuning.command);
    x = moved(x, u);
    p = f * p * f.transpose() + q * of_motion * of_motion.transpose();
    Vector7 drift;
    drift << 0, 0, 0, 1e-6, 1e-6, 4e-6, 0.1e-6 * 4.0;
    p += drift.asDiagonal();
    filter.renew();
    filter.predict(u, kTuning);

    const double y = x[0] + 0.02 * normal(random);
    const double s = p(0, 0) + 1e-4;
    const Vector7 gain = p.col(0) / s;
    ASSERT_LT(std::abs(y - x[0]) / std::sqrt(s), 4.0);  // none is limited
    x += gain * (y - x[0]);
    p -= gain * s * gain.transpose();
    filter.update(y, kTuning);

    ASSERT_LT((state_of(filter) - x).cwiseAbs().maxCoeff(), 1e-6) << k;
    ASSERT_LT((covariance_of(filter) - p).cwiseAbs().maxCoeff(), 1e-6 * p.cwiseAbs().maxCoeff())
        << k;
  }
  EXPECT_LT(filter.covariance(3, 3), 0.3 * 0.3 / 10.0);  // something was learned
}

TEST(ServoFilter, HeldParametersKeepValueAndVariance) {
  Filter filter = started();
  Filter::Tuning hold = kTuning;
  hold.hold_servo = true;
  for (int k = 0; k < 50; ++k) {
    filter.predict(k % 20 < 10 ? 2.0 : -2.0, kTuning);
    const double rate = filter.state().rate;
    const double before[] = {filter.covariance(4, 4), filter.covariance(4, 5),
                             filter.covariance(5, 5)};
    const double gain_before = filter.covariance(3, 3);
    filter.update(filter.state().position + 0.01, hold);
    EXPECT_EQ(filter.state().rate, rate);
    EXPECT_EQ(filter.covariance(4, 4), before[0]);
    EXPECT_EQ(filter.covariance(4, 5), before[1]);
    EXPECT_EQ(filter.covariance(5, 5), before[2]);
    EXPECT_LE(filter.covariance(3, 3), gain_before);
  }
  const Matrix7 p = covariance_of(filter);
  EXPECT_GT(Eigen::LLT<Matrix7>(p + 1e-12 * Matrix7::Identity()).matrixL().determinant(), 0.0);
}

TEST(ServoFilter, ASingleOutlierMovesNoFurtherThanItsLimit) {
  Filter small = started();
  Filter large = started();
  small.predict(1.0, kTuning);
  large.predict(1.0, kTuning);
  const double deviation = std::sqrt(small.covariance(0, 0) + small.state().noise);
  small.update(small.state().position + 4.0 * deviation, kTuning);
  large.update(large.state().position + 1e6, kTuning);
  EXPECT_NEAR(large.state().gain, small.state().gain, 1e-9);
  EXPECT_NEAR(large.state().position, small.state().position, 1e-9);
  EXPECT_EQ(large.state().outliers, 1);
}

TEST(ServoFilter, InnovationsTuneTheNoiseOfTheSensor) {
  std::mt19937 random{8};
  std::normal_distribution<double> normal;
  Filter filter = started(1e-2);  // 100 times the true variance
  Filter::Tuning adapt = kTuning;
  adapt.adaptation = 0.01;
  double position = 0.0;
  double velocity = 0.0;
  double acceleration = 0.0;
  const auto t = ehsid::servo_transition(0.6, 0.4);
  for (int k = 0; k < 6000; ++k) {
    const double u = k % 60 < 30 ? 2.0 : -2.0;
    const double error = velocity - 0.8 * u;
    const double a = acceleration;
    position += velocity - t.s.value * error + t.i.value * a;
    velocity += t.e.value * a - t.w.value * error;
    acceleration = t.decay.value * a - t.pull.value * error;
    filter.renew();
    filter.predict(u, adapt);
    filter.update(position + 0.01 * normal(random), adapt);
  }
  // The step of 0.007 leaves a scatter of about sqrt(0.007) of the variance.
  EXPECT_NEAR(filter.state().noise / 1e-4, 1.0, 0.3);
  EXPECT_LT(filter.state().disturbance, 0.01);
  EXPECT_NEAR(filter.state().gain, 0.8, 0.005);
  EXPECT_NEAR(filter.state().rate, 0.6, 0.01);
  EXPECT_NEAR(filter.state().damping, 0.4, 0.02);
}

}  // namespace
