// SPDX-License-Identifier: MIT
#include <ehsid/plant/valve.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

namespace {

using ehsid::plant::MeteringEdges;
using ehsid::plant::OfEdges;
using Complex = std::complex<double>;
using Dual = ehsid::plant::Dual<ehsid::plant::Lanes<6>>;

/// Conductance, pressure drop, exponent, laminar pressure, opening past the overlap and rounding.
using Point = std::array<double, 6>;
constexpr Point kPoint{3e-8, -2.1e6, 0.53, 4e4, 0.02, 0.01};

template <class Number>
struct Laws {
  Number rate, slope, area;
};

/// The laws as they are written down.
Laws<Complex> written(const std::array<Complex, 6>& x) {
  const auto& [c, drop, exponent, laminar, past, rounding] = x;
  const Complex power = (exponent - 1.0) * 0.5;
  const Complex softened = drop * drop + laminar * laminar;
  const Complex conductance = c * std::pow(softened, power);
  return {conductance * drop, conductance * (1.0 + 2.0 * power * drop * drop / softened),
          (past + std::sqrt(past * past + rounding * rounding)) * 0.5};
}

template <class Number>
Laws<Number> computed(const std::array<Number, 6>& x) {
  const MeteringEdges<Number> edges(Number(1.0), Number(1.0), x[2], x[3], x[5]);
  const Number other(1.0);
  const auto flows = edges.template flows<true>(OfEdges<Number>{other, other, x[0], other},
                                                OfEdges<Number>{other, other, x[1], other});
  return {flows[2].rate, flows[2].slope, edges.area(x[4])};
}

// Im f(x + i h) / h is the derivative without cancellation: Squire, Trapp, SIAM Review 40(1), 1998.
TEST(PlantValve, LawsAndDerivativesAreThoseThatAreWrittenDown) {
  constexpr double kStep = 1e-30;
  for (const double drop : {-2.1e6, -3e4, 0.0, 5e2, 8e6}) {
    Point point = kPoint;
    point[1] = drop;
    const Laws<double> plain = computed(point);
    std::array<Dual, 6> x;
    for (std::size_t i = 0; i < x.size(); ++i) {
      x[i] = Dual(point[i]);
      x[i].partial.set(i, 1.0);
    }
    const Laws<Dual> found = computed(x);
    EXPECT_EQ(found.rate.value, plain.rate);
    EXPECT_EQ(found.slope.value, plain.slope);
    EXPECT_EQ(found.area.value, plain.area);
    for (std::size_t i = 0; i < x.size(); ++i) {
      std::array<Complex, 6> moved;
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
