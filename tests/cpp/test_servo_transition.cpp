// SPDX-License-Identifier: MIT
#include <ehsid/servo_transition.hpp>

#include <gtest/gtest.h>

#include <cmath>

namespace {

using Transition = ehsid::ServoTransition<double>;

struct Motion {
  long double position;
  long double error;
  long double acceleration;
};

/// One period of e'' + 2 xi h e' + h^2 e = 0 and position' = e by the classical Runge-Kutta method, which shares nothing
/// with the series of the header. Its error is below (h / steps)^4.
Motion simulated(long double h, long double xi, Motion m) {
  constexpr int kSteps = 20000;
  const long double dt = 1.0L / kSteps;
  const auto slope = [h, xi](const Motion& at) {
    return Motion{at.error, at.acceleration, -2.0L * xi * h * at.acceleration - h * h * at.error};
  };
  const auto moved = [](const Motion& at, const Motion& by, long double step) {
    return Motion{at.position + step * by.position, at.error + step * by.error,
                  at.acceleration + step * by.acceleration};
  };
  for (int i = 0; i < kSteps; ++i) {
    const Motion a = slope(m);
    const Motion b = slope(moved(m, a, dt / 2));
    const Motion c = slope(moved(m, b, dt / 2));
    const Motion d = slope(moved(m, c, dt));
    m = moved(moved(moved(moved(m, a, dt / 6), b, dt / 3), c, dt / 3), d, dt / 6);
  }
  return m;
}

class ServoTransition : public ::testing::TestWithParam<std::pair<double, double>> {};

TEST_P(ServoTransition, IsTheSolutionOfTheServo) {
  const auto [h, xi] = GetParam();
  const Transition t = ehsid::servo_transition(h, xi);
  const Motion from_error = simulated(h, xi, {0.0L, 1.0L, 0.0L});
  const Motion from_acceleration = simulated(h, xi, {0.0L, 0.0L, 1.0L});
  // Relative to the largest that the coefficient can be; where it is small, W and S keep their own digits.
  const double most = 1e-11;
  EXPECT_NEAR(t.w.value, static_cast<double>(1.0L - from_error.error), most * (1.0 + h));
  EXPECT_NEAR(t.s.value, static_cast<double>(1.0L - from_error.position), most * (1.0 + h));
  EXPECT_NEAR(t.pull.value, static_cast<double>(-from_error.acceleration), most * h * (1.0 + h));
  EXPECT_NEAR(t.e.value, static_cast<double>(from_acceleration.error), most);
  EXPECT_NEAR(t.i.value, static_cast<double>(from_acceleration.position), most);
  EXPECT_NEAR(t.decay.value, static_cast<double>(from_acceleration.acceleration), most * (1.0 + h));
}

TEST_P(ServoTransition, SensitivitiesAreThoseOfDifferences) {
  const auto [h, xi] = GetParam();
  constexpr double kStep =
      1e-4;  // in the logarithm; the error of a central difference is its square over 6
  const Transition t = ehsid::servo_transition(h, xi);
  const Transition faster = ehsid::servo_transition(h * std::exp(kStep), xi);
  const Transition slower = ehsid::servo_transition(h * std::exp(-kStep), xi);
  const Transition stiffer = ehsid::servo_transition(h, xi * std::exp(kStep));
  const Transition looser = ehsid::servo_transition(h, xi * std::exp(-kStep));
  const auto check = [&](ehsid::ServoCoefficient<double> Transition::* one, const char* name) {
    const double by_rate = ((faster.*one).value - (slower.*one).value) / (2.0 * kStep);
    const double by_damping = ((stiffer.*one).value - (looser.*one).value) / (2.0 * kStep);
    const double most = 1e-5 * (1.0 + h * h * h) * (1.0 + xi);
    EXPECT_NEAR((t.*one).by_rate, by_rate, most) << name;
    EXPECT_NEAR((t.*one).by_damping, by_damping, most) << name;
  };
  check(&Transition::s, "S");
  check(&Transition::w, "W");
  check(&Transition::e, "E");
  check(&Transition::i, "I");
  check(&Transition::decay, "decay");
  check(&Transition::pull, "pull");
}

INSTANTIATE_TEST_SUITE_P(Servos, ServoTransition,
                         ::testing::Values(std::pair{1e-3, 0.3}, std::pair{0.02, 0.1},
                                           std::pair{0.25, 0.5}, std::pair{0.25, 2.0},
                                           std::pair{1.0, 1.0}, std::pair{2.5, 0.2},
                                           std::pair{2.5, 0.9}, std::pair{6.0, 0.05},
                                           std::pair{1.5, 5.0}));

TEST(ServoTransitionDigits, SmallRatesKeepThem) {
  // W = h^2 / 2 - xi h^3 / 3 ... and S = h^2 / 6 ...: no digit is lost where h is small.
  const auto t = ehsid::servo_transition(1e-4, 0.5);
  EXPECT_NEAR(t.w.value / (0.5e-8 * (1.0 - 1e-4 / 3.0)), 1.0, 1e-8);
  EXPECT_NEAR(t.s.value / (1e-8 / 6.0 * (1.0 - 1e-4 / 4.0)), 1.0, 1e-8);
  const auto single = ehsid::servo_transition(1e-4F, 0.5F);
  EXPECT_NEAR(static_cast<double>(single.w.value) / t.w.value, 1.0, 1e-6);
}

}  // namespace
