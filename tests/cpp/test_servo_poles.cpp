// SPDX-License-Identifier: MIT
// Poles of the sampled servo against eigenvalues of the companion matrix and the complex logarithm
// of the library. How logarithm and angle round is in test_servo_model.cpp.
#include <ehsid/servo_poles.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <random>

#include "eigenvalues.hpp"

namespace {

using Complex = std::complex<double>;
using Theta = ehsid::Vector<double, 6>;
using ehsid::detail::ServoDenominator;

constexpr double kEps = std::numeric_limits<double>::epsilon();

/// (z - p)(z - z1)(z - z2) multiplied out; z1 and z2 a conjugate pair or both real.
Theta theta_of(double p, Complex z1, Complex z2) {
  const double q1 = -(z1 + z2).real();
  const double q2 = (z1 * z2).real();
  Theta theta = Theta::Zero();
  theta.head<3>() << q1 - p, q2 - p * q1, -p * q2;
  return theta;
}

/// A servo with its integrator within 1e-3 of one and its pair well inside, but not near zero.
class Servos : public testing::TestWithParam<unsigned> {
 protected:
  Servos() {
    std::mt19937 random(GetParam());
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    p_ = 1.0 + 2e-3 * (uniform(random) - 0.5);
    if (GetParam() % 2 == 0) {
      z1_ = std::polar(0.2 + 0.7 * uniform(random), 0.3 + 2.5 * uniform(random));
      z2_ = std::conj(z1_);
    } else {
      z1_ = 0.5 + 0.4 * uniform(random);
      z2_ = 0.1 + 0.3 * uniform(random);
    }
    theta_ = theta_of(p_, z1_, z2_);
  }

  // The poles lie 0.09 apart at least, so A'(z) is 8e-3 or more and a coefficient's rounding moves a
  // pole by at most 8 eps / 8e-3 (coefficients sum to 8 at most); twice for the solver's own.
  static constexpr double kTolerance = 2e3 * kEps;

  double p_ = 0.0;
  Complex z1_;
  Complex z2_;
  Theta theta_;
};

TEST_P(Servos, IntegratorIsTheEigenvalueNearestToOne) {
  const auto z = roots_as_eigenvalues({theta_[0], theta_[1], theta_[2]});
  const auto nearest = *std::min_element(z.begin(), z.end(), [](Complex a, Complex b) {
    return std::abs(a - 1.0) < std::abs(b - 1.0);
  });
  const ServoDenominator<double> poles(theta_);
  EXPECT_NEAR(poles.factors.root, nearest.real() - 1.0, kTolerance);
  EXPECT_NEAR(poles.factors.root, p_ - 1.0, kTolerance);
}

TEST_P(Servos, PairIsWhatIsLeft) {
  const ServoDenominator<double> poles(theta_);
  EXPECT_NEAR(poles.q2, (z1_ * z2_).real(), kTolerance);
  EXPECT_NEAR(poles.q_at_one, ((1.0 - z1_) * (1.0 - z2_)).real(), kTolerance);
  EXPECT_NEAR(poles.next_distance(), std::min(std::abs(1.0 - z1_), std::abs(1.0 - z2_)),
              10.0 * kTolerance);  // conditioned with the distance of the two poles
  EXPECT_EQ(poles.factors.discriminant < 0.0, z1_.imag() != 0.0);
}

TEST_P(Servos, LogarithmsAreThoseOfTheLibrary) {
  const auto logarithms = ServoDenominator<double>(theta_).logarithms();
  const Complex s1 = std::log(z1_);
  const Complex s2 = std::log(z2_);
  // d ln z = dz / z, z at least 0.1, and products of logarithms up to 4
  EXPECT_NEAR(logarithms.v, -(s1 + s2).real(), 10.0 * kTolerance);
  EXPECT_NEAR(logarithms.y, (s1 * s2).real(), 100.0 * kTolerance);
  EXPECT_NEAR(logarithms.angle, std::abs(s1.imag()), 100.0 * kTolerance);
}

TEST_P(Servos, GradientsAreThoseOfDifferences) {
  const ServoDenominator<double> poles(theta_);
  // Relative error of a central difference: h^2 over the square of the poles' distance; its
  // rounding: kTolerance / h.
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 6; ++i) {
    const ServoDenominator<double> up(theta_ + kStep * Theta::Unit(i));
    const ServoDenominator<double> down(theta_ - kStep * Theta::Unit(i));
    const auto check = [&](double above, double below, double gradient) {
      const double slope = (above - below) / (2.0 * kStep);
      EXPECT_NEAR(gradient, slope, 1e-6 * (1.0 + std::abs(slope))) << "by entry " << i;
    };
    check(up.factors.root, down.factors.root, poles.d_pole[i]);
    check(up.q2, down.q2, poles.d_q2[i]);
    check(up.q_at_one, down.q_at_one, poles.d_q_at_one[i]);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Servos, testing::Range(0U, 40U));

template <class Scalar>
class Cubic : public testing::Test {
 protected:
  static constexpr Scalar kEps = std::numeric_limits<Scalar>::epsilon();
};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Cubic, Scalars, );

TYPED_TEST(Cubic, IntegerRootsNearestToZero) {
  // Coefficients exact in float; simple roots 1 apart, of sizes up to 9: conditioned with 9^3.
  const TypeParam tolerance = TypeParam(1000) * TestFixture::kEps;
  for (int a = -9; a <= 9; ++a) {
    for (int b = a + 1; b <= 9; ++b) {
      for (int c = b + 1; c <= 9; ++c) {
        const auto c2 = static_cast<TypeParam>(-(a + b + c));
        const auto c1 = static_cast<TypeParam>(a * b + a * c + b * c);
        const auto c0 = static_cast<TypeParam>(-a * b * c);
        const auto factors = ehsid::split_cubic(c2, c1, c0);
        const int least = std::min({std::abs(a), std::abs(b), std::abs(c)});
        ASSERT_NEAR(std::abs(factors.root), static_cast<TypeParam>(least), tolerance)
            << a << " " << b << " " << c;
        ASSERT_GE(factors.discriminant, TypeParam(0)) << a << " " << b << " " << c;
      }
    }
  }
}

TYPED_TEST(Cubic, FactorsMultiplyBack) {
  // Roots of sizes from 1e-3 to 1e2, every third time a complex pair, sometimes coincident.
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto draw = [&] { return uniform(random) * std::pow(10.0, 2.5 * uniform(random) - 0.5); };
  for (int k = 0; k < 5000; ++k) {
    const double r = draw();
    const double s = k % 5 == 0 ? r : draw();
    const double t = k % 7 == 0 ? s : draw();
    const double b = k % 3 == 0 ? -2.0 * s : -(s + t);
    const double c = k % 3 == 0 ? s * s + t * t : s * t;
    const auto c2 = static_cast<TypeParam>(b - r);
    const auto c1 = static_cast<TypeParam>(c - r * b);
    const auto c0 = static_cast<TypeParam>(-r * c);
    const auto f = ehsid::split_cubic(c2, c1, c0);
    const TypeParam tolerance = TypeParam(16) * TestFixture::kEps;
    const TypeParam size_of_c1 = std::abs(f.c) + std::abs(f.root * f.b);
    ASSERT_NEAR(f.b - f.root, c2, tolerance * (std::abs(f.b) + std::abs(f.root))) << "case " << k;
    ASSERT_NEAR(f.c - f.root * f.b, c1, tolerance * size_of_c1) << "case " << k;
    ASSERT_NEAR(-f.root * f.c, c0, tolerance * std::abs(f.root * f.c)) << "case " << k;
  }
}

TYPED_TEST(Cubic, ASmallPairBesideALargeRootKeepsItsDigits) {
  // (x - r)(x^2 + b x + c): b and c are well conditioned, c0 = -r c and c1 = c - r b, but they drown in
  // the rounding of c2 = b - r.
  const auto r = static_cast<TypeParam>(1000.1);
  const auto b = static_cast<TypeParam>(1e-3);
  const auto c = static_cast<TypeParam>(1e-6);
  const auto f = ehsid::split_cubic(b - r, c - r * b, -r * c);
  const TypeParam tolerance = TypeParam(16) * TestFixture::kEps;
  EXPECT_NEAR(f.root / r, TypeParam(1), tolerance);
  EXPECT_NEAR(f.b / b, TypeParam(1), tolerance);
  EXPECT_NEAR(f.c / c, TypeParam(1), tolerance);
}

TYPED_TEST(Cubic, ARootOfZeroIsExact) {
  const auto real = ehsid::split_cubic(TypeParam(3), TypeParam(2), TypeParam(0));
  EXPECT_EQ(real.root, TypeParam(0));
  EXPECT_EQ(real.b, TypeParam(3));
  EXPECT_EQ(real.c, TypeParam(2));
  const auto pair = ehsid::split_cubic(TypeParam(1), TypeParam(2), TypeParam(0));
  EXPECT_EQ(pair.root, TypeParam(0));
  EXPECT_EQ(pair.discriminant, TypeParam(-1.75));
  const auto triple = ehsid::split_cubic(TypeParam(0), TypeParam(0), TypeParam(0));
  EXPECT_EQ(triple.root, TypeParam(0));
  EXPECT_EQ(triple.c, TypeParam(0));
}

TYPED_TEST(Cubic, ATripleRootIsFoundWithinTheCubeRootOfTheRounding) {
  for (const TypeParam r : {TypeParam(-1), TypeParam(0.25), TypeParam(8)}) {  // exact powers of two
    const auto f = ehsid::split_cubic(TypeParam(-3) * r, TypeParam(3) * r * r, -r * r * r);
    // |x - r|^3 is the value, at most some 16 roundings of |r|^3
    EXPECT_NEAR(f.root / r, TypeParam(1), std::cbrt(TypeParam(16) * TestFixture::kEps));
  }
}

TYPED_TEST(Cubic, LogarithmOverTheWholeRange) {
  using Limits = std::numeric_limits<TypeParam>;
  const TypeParam tolerance = TypeParam(16) * TestFixture::kEps;
  for (const TypeParam z : {Limits::denorm_min(), Limits::min(), Limits::max()}) {
    EXPECT_NEAR(ehsid::real_logarithm(z) / std::log(z), TypeParam(1), tolerance);
  }
  EXPECT_EQ(ehsid::real_logarithm(TypeParam(1)), TypeParam(0));
}

TYPED_TEST(Cubic, AngleOnTheAxes) {
  const TypeParam one(1);
  const auto pi = static_cast<TypeParam>(3.14159265358979323846L);
  EXPECT_EQ(ehsid::upper_angle(one, TypeParam(0)), TypeParam(0));
  EXPECT_EQ(ehsid::upper_angle(-one, TypeParam(0)), pi);
  EXPECT_NEAR(ehsid::upper_angle(TypeParam(0), one), pi / 2, TypeParam(8) * TestFixture::kEps);
  EXPECT_NEAR(ehsid::upper_angle(-one, one), TypeParam(0.75) * pi,
              TypeParam(16) * TestFixture::kEps);
}

}  // namespace
