// SPDX-License-Identifier: MIT
// One period of the servo against a matrix exponential with more digits, and its sensitivities against differences of that.
#include <ehsid/servo_transition.hpp>

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace {

using Long = long double;
using Matrix = Eigen::Matrix<Long, 4, 4>;
/// S, W, E, I, the decay and the pull.
using Six = std::array<Long, 6>;

/// exp(m) by the Taylor series of exp(m / 2^k), squared k times.
Matrix exponential(const Matrix& m) {
  int squarings = 0;
  for (Long norm = m.cwiseAbs().rowwise().sum().maxCoeff(); norm > 0.5L; norm *= 0.5L) {
    ++squarings;
  }
  const Matrix small = std::ldexp(1.0L, -squarings) * m;
  Matrix sum = Matrix::Identity();
  for (int n = 24; n >= 1; --n) {
    sum = (Matrix::Identity() + small * sum / static_cast<Long>(n)).eval();
  }
  for (int i = 0; i < squarings; ++i) {
    sum = (sum * sum).eval();
  }
  return sum;
}

/// From x' = v, v' = h b, b' = -2 xi h b - h (v - r) over the time 1; a = h b.
Six reference(Long rate, Long damping) {
  Matrix m = Matrix::Zero();
  m(0, 1) = 1.0L;
  m(1, 2) = rate;
  m.row(2) << 0.0L, -rate, -2.0L * damping * rate, rate;
  const Matrix once = exponential(m);
  return {once(0, 3),        once(1, 3), once(1, 2) / rate,
          once(0, 2) / rate, once(2, 2), once(2, 3) * rate};
}

/// Derivative by the logarithm of a parameter, by differences of fourth order.
template <class Function>
Six by_logarithm(const Function& of, Long parameter) {
  constexpr Long kStep = 1e-4L;
  const auto at = [&](int steps) { return of(parameter * std::exp(kStep * steps)); };
  const Six far = at(2);
  const Six near = at(1);
  const Six behind = at(-1);
  const Six far_behind = at(-2);
  Six made{};
  for (std::size_t i = 0; i < made.size(); ++i) {
    made[i] = (8.0L * (near[i] - behind[i]) - (far[i] - far_behind[i])) / (12.0L * kStep);
  }
  return made;
}

template <class Scalar>
void expect_exact(double h, double xi) {
  const auto rate = static_cast<Scalar>(h);
  const auto damping = static_cast<Scalar>(xi);
  const auto found = ehsid::servo_transition(rate, damping);
  const auto exact_rate = static_cast<Long>(rate);
  const auto exact_damping = static_cast<Long>(damping);
  const Six right = reference(exact_rate, exact_damping);
  const Six by_rate = by_logarithm([&](Long x) { return reference(x, exact_damping); }, exact_rate);
  const Six by_damping =
      by_logarithm([&](Long x) { return reference(exact_rate, x); }, exact_damping);
  // How large each can be: for a short period the first term of its series, else what a period at rest or a period of
  // ringing makes of it.
  const Long square = exact_rate * exact_rate;
  const Six size{std::min(square / 6.0L, 1.0L),
                 std::min(square / 2.0L, 1.0L),
                 std::min(1.0L / exact_rate, 1.0L),
                 std::min(1.0L / square, 0.5L),
                 1.0L,
                 std::min(square, exact_rate)};
  const std::array<ehsid::ServoCoefficient<Scalar>, 6> all{found.s, found.w,     found.e,
                                                           found.i, found.decay, found.pull};
  // Each doubling of the time adds a rounding to an angle of the size of the rate.
  const auto eps = static_cast<Long>(std::numeric_limits<Scalar>::epsilon());
  const Long much = 8.0L + 4.0L * exact_rate * (1.0L + exact_damping);
  const Long differences = 1e-11L;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto where = testing::Message() << "coefficient " << i << ", h " << h << ", xi " << xi;
    EXPECT_LE(std::abs(static_cast<Long>(all[i].value) - right[i]), much * eps * size[i]) << where;
    const Long steep = 1.0L + exact_rate;
    EXPECT_LE(std::abs(static_cast<Long>(all[i].by_rate) - by_rate[i]),
              (2.0L * much * eps + differences) * steep * size[i])
        << where;
    EXPECT_LE(std::abs(static_cast<Long>(all[i].by_damping) - by_damping[i]),
              (2.0L * much * eps + differences) * steep * size[i])
        << where;
  }
}

constexpr std::array<double, 14> kRates{1e-4, 1e-3, 0.01, 0.05, 0.2, 0.24, 0.26,
                                        0.5,  1.0,  2.0,  3.1,  6.0, 11.0, 20.0};
constexpr std::array<double, 11> kDampings{0.01, 0.05, 0.2, 0.5, 0.9, 0.999999,
                                           1.0,  1.1,  2.0, 3.5, 5.0};

TEST(ServoTransition, IsThatOfTheContinuousServoWithItsSensitivities) {
  for (const double h : kRates) {
    for (const double xi : kDampings) {
      expect_exact<double>(h, xi);
      expect_exact<float>(h, xi);
    }
  }
}

TEST(ServoTransition, OfALongPeriodIsTheHeldVelocity) {
  const auto t = ehsid::servo_transition(20.0, 1.0);
  EXPECT_NEAR(t.w.value, 1.0, 1e-6);
  EXPECT_NEAR(t.s.value, 1.0 - 2.0 / 20.0, 1e-6);  // delay 2 xi / omega_n
  EXPECT_NEAR(t.decay.value, 0.0, 1e-6);
}

}  // namespace
