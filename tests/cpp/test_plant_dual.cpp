// SPDX-License-Identifier: MIT
#include <ehsid/plant/dual.hpp>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>

namespace {

using ehsid::plant::Lanes;

template <int kN>
using Dual = ehsid::plant::Dual<Lanes<kN>>;

/// Every operation once; only what complex numbers have, too.
template <class Number>
Number mixture(const Number& x, const Number& y) {
  using std::exp;
  using std::log;
  using std::sqrt;
  using std::tanh;
  Number sum = sqrt(x * y + 2.0) / (1.5 - y) - exp(-x) * tanh(y * 0.7);
  sum += log(3.0 * x) / 4.0;
  sum -= 2.0 / (x + y);
  sum *= 1.1;
  return -sum + 0.5 * (y - 3.0) + (2.0 - x) * (1.0 + y);
}

// Im f(x + i h) / h is the derivative without cancellation: Squire, Trapp, SIAM Review 40(1), 1998.
TEST(PlantDual, DerivativesAreThoseOfTheComplexStep) {
  using Complex = std::complex<double>;
  constexpr double kStep = 1e-30;
  for (const double x : {0.2, 0.9, 3.0}) {
    for (const double y : {-0.4, 0.3, 1.2}) {
      Dual<2> a(x);
      Dual<2> b(y);
      a.partial.set(0, 1.0);
      b.partial.set(1, 1.0);
      const Dual<2> found = mixture(a, b);
      if (x * y + 2.0 <= 0.0 || x + y == 0.0) {
        continue;
      }
      EXPECT_DOUBLE_EQ(found.value, mixture(x, y));
      const double by_x = mixture(Complex(x, kStep), Complex(y)).imag() / kStep;
      const double by_y = mixture(Complex(x), Complex(y, kStep)).imag() / kStep;
      EXPECT_NEAR(found.partial[0], by_x, 1e-13 * (1.0 + std::abs(by_x)));
      EXPECT_NEAR(found.partial[1], by_y, 1e-13 * (1.0 + std::abs(by_y)));
    }
  }
}

/// The mixture with the derivatives of both numbers in the lanes, each several times over and scaled.
template <class Partials>
ehsid::plant::Dual<Partials> mixture_in_lanes() {
  ehsid::plant::Dual<Partials> x(0.9);
  ehsid::plant::Dual<Partials> y(0.3);
  for (std::size_t i = 0; i < 4; ++i) {
    x.partial.set(i, 0.1 * static_cast<double>(i + 1));
    y.partial.set(7 - i, 0.3 * static_cast<double>(i + 1));
  }
  return mixture(x, y);
}

// The width of the blocks belongs to the processor; no bit of a result does.
TEST(PlantDual, TheWidthOfTheBlocksChangesNoBit) {
  const auto alone = mixture_in_lanes<Lanes<8, 1>>();
  const auto pairs = mixture_in_lanes<Lanes<8, 2>>();
  EXPECT_EQ(alone.value, pairs.value);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(alone.partial[i], pairs.partial[i]);
    EXPECT_NE(pairs.partial[i], 0.0);
  }
}

TEST(PlantDual, PowerClampAndAbsoluteValueHaveTheSlopeOfTheirBranch) {
  Dual<1> x(-2.0);
  x.partial.set(0, 1.0);
  EXPECT_EQ(ehsid::plant::absolute(x).value, 2.0);
  EXPECT_EQ(ehsid::plant::absolute(x).partial[0], -1.0);
  const Dual<1> low(-1.0);
  const Dual<1> high(1.0);
  EXPECT_EQ(ehsid::plant::clamp(x, low, high).value, -1.0);
  EXPECT_EQ(ehsid::plant::clamp(x, low, high).partial[0], 0.0);
  EXPECT_EQ(ehsid::plant::clamp(x * 0.25, low, high).partial[0], 0.25);
  const Dual<1> cube = ehsid::plant::power(-x, 3.0);
  EXPECT_DOUBLE_EQ(cube.value, 8.0);
  EXPECT_DOUBLE_EQ(cube.partial[0], -12.0);  // d (-x)^3 / dx = -3 x^2
}

TEST(PlantDual, ZeroIsNothingOnlyWhereNothingVaries) {
  Dual<1> x(0.0);
  EXPECT_TRUE(ehsid::plant::is_nothing(x));
  x.partial.set(0, 1.0);
  EXPECT_FALSE(ehsid::plant::is_nothing(x));
}

}  // namespace
