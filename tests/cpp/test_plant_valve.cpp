// SPDX-License-Identifier: MIT
#include <ehsid/plant/valve.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

namespace {

using ehsid::plant::Edge;
using ehsid::plant::OfEdges;
using ehsid::plant::Orifices;
using Complex = std::complex<double>;
using Dual = ehsid::plant::Dual<ehsid::plant::Lanes<7>>;

/// Conductance, pressure drop, exponent, laminar pressure, opening past the overlap, rounding and closing.
using Point = std::array<double, 7>;
constexpr Point kPoint{3e-8, -2.1e6, 0.53, 4e4, 0.012, 0.01, 0.3};

template <class Number>
struct Laws {
  Number rate, slope, area;
};

/// The laws as they are written down.
Laws<Complex> written(const std::array<Complex, 7>& x) {
  const auto& [c, drop, exponent, laminar, past, rounding, closing] = x;
  const Complex power = (exponent - 1.0) * 0.5;
  const Complex softened = drop * drop + laminar * laminar;
  const Complex conductance = c * std::pow(softened, power);
  const Complex leaks = (past + std::sqrt(past * past + rounding * rounding)) * 0.5;
  const Complex width = 2.0 * rounding;
  const double opening = past.real();
  const Complex closes = opening <= -width.real() ? Complex(0.0)
                         : opening >= width.real()
                             ? past
                             : (past + width) * (past + width) / (4.0 * width);
  return {conductance * drop, conductance * (1.0 + 2.0 * power * drop * drop / softened),
          (1.0 - closing) * leaks + closing * closes};
}

template <class Number>
Laws<Number> computed(const std::array<Number, 7>& x) {
  const Orifices<Number> orifices(Number(1.0), Number(1.0), x[2], x[3]);
  const Number other(1.0);
  const auto flows = orifices.template flows<true>(OfEdges<Number>{other, other, x[0], other},
                                                   OfEdges<Number>{other, other, x[1], other});
  return {flows[2].rate, flows[2].slope,
          Edge<Number>{Number(1.0), Number(0.0), x[5], x[6]}.conductance(x[4])};
}

// Im f(x + i h) / h is the derivative without cancellation: Squire, Trapp, SIAM Review 40(1), 1998.
TEST(PlantValve, LawsAndDerivativesAreThoseThatAreWrittenDown) {
  constexpr double kStep = 1e-30;
  // Openings before the rounding of the edge, in it on either side of null, and after it.
  constexpr std::array<double, 5> kDrops{-2.1e6, -3e4, 0.0, 5e2, 8e6};
  constexpr std::array<double, 5> kOpenings{0.012, -0.03, -0.012, 0.03, 0.0};
  for (std::size_t at = 0; at < kDrops.size(); ++at) {
    const double drop = kDrops[at];
    Point point = kPoint;
    point[1] = drop;
    point[4] = kOpenings[at];
    const Laws<double> plain = computed(point);
    std::array<Dual, 7> x;
    for (std::size_t i = 0; i < x.size(); ++i) {
      x[i] = Dual(point[i]);
      x[i].partial.set(i, 1.0);
    }
    const Laws<Dual> found = computed(x);
    EXPECT_EQ(found.rate.value, plain.rate);
    EXPECT_EQ(found.slope.value, plain.slope);
    EXPECT_EQ(found.area.value, plain.area);
    for (std::size_t i = 0; i < x.size(); ++i) {
      std::array<Complex, 7> moved;
      std::copy(point.begin(), point.end(), moved.begin());
      moved[i] += Complex(0.0, kStep);
      const Laws<Complex> exact = written(moved);
      const auto agree = [&](const Dual& dual, const Complex& law) {
        // A dozen roundings, some of them in sums of terms of both signs that are ten times as large.
        constexpr double kTolerance = 1e-13;
        EXPECT_NEAR(dual.value, law.real(), kTolerance * std::abs(law.real()));
        const double slope = law.imag() / kStep;
        EXPECT_NEAR(dual.partial[i], slope, kTolerance * std::abs(slope)) << i << " at " << drop;
      };
      agree(found.rate, exact.rate);
      agree(found.slope, exact.slope);
      agree(found.area, exact.area);
    }
  }
}

}  // namespace
