// SPDX-License-Identifier: MIT
// The factors against the full matrix in double, which Eigen computes.
#include <ehsid/ud.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace {

constexpr int kN = 5;
using Factors = ehsid::UdFactors<double, kN>;
using Matrix = Eigen::Matrix<double, kN, kN>;
using Vector = Eigen::Matrix<double, kN, 1>;
using Array = ehsid::Array<double, kN>;

// Condition numbers go up to kCondition; a factorisation loses about that many times epsilon, and
// each of the kN^2 operations on an entry adds a rounding.
constexpr double kCondition = 1e6;
constexpr double kTolerance = kN * kN * kCondition * std::numeric_limits<double>::epsilon();

class Ud : public testing::TestWithParam<unsigned> {
 protected:
  Ud() : random_(GetParam()) {
    // Q diag(1 .. 1/kCondition) Q', with a random Q: a reflection at a random plane for each parameter.
    Matrix q = Matrix::Identity();
    for (int i = 0; i < kN; ++i) {
      const Vector normal = Vector::NullaryExpr([&](int) { return normal_(random_); });
      q -= (2.0 / normal.squaredNorm()) * normal * (normal.transpose() * q);
    }
    Vector eigenvalues;
    for (int i = 0; i < kN; ++i) {
      eigenvalues[i] = std::pow(kCondition, -static_cast<double>(i) / (kN - 1));
    }
    p_ = q * eigenvalues.asDiagonal() * q.transpose();
    p_ = (0.5 * (p_ + p_.transpose())).eval();
    inverse_ = q * eigenvalues.cwiseInverse().asDiagonal() * q.transpose();
    phi_ = Vector::NullaryExpr([&](int) { return normal_(random_); });
    factorised_ = factors_.factorise(p_);
  }

  void expect_near(const Matrix& actual, const Matrix& expected) const {
    EXPECT_LE((actual - expected).norm(), kTolerance * expected.norm());
    EXPECT_EQ(actual, actual.transpose());
  }

  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  Matrix p_;
  Matrix inverse_;
  Vector phi_;
  Factors factors_{};
  bool factorised_ = false;
};

TEST_P(Ud, FactorsMultiplyBackToTheMatrix) {
  ASSERT_TRUE(factorised_);
  EXPECT_TRUE(factors_.usable());
  expect_near(factors_.matrix(), p_);
  for (int i = 0; i < kN; ++i) {
    EXPECT_NEAR(factors_.variance(i), p_(i, i), kTolerance * p_.norm());
  }
}

TEST_P(Ud, ProjectionIsTheQuadraticForm) {
  Array f;
  EXPECT_NEAR(factors_.project(phi_, f), phi_.dot(p_ * phi_), kTolerance * phi_.squaredNorm());
}

TEST_P(Ud, MeasurementIsEquation13) {
  // Equal in (13); they differ where a policy forgets behind the measurement.
  const double r = 0.95;
  const double shrink = 0.8;
  Array numerator;
  factors_.project(phi_, numerator);
  Array variances{};
  const double alpha = factors_.measure(factors_, numerator, r, shrink, variances);
  const Vector column = p_ * phi_;
  EXPECT_NEAR(alpha, r + phi_.dot(column), kTolerance * alpha);
  expect_near(factors_.matrix(), (p_ - column * column.transpose() / alpha) / shrink);
  for (int i = 0; i < kN; ++i) {
    EXPECT_NEAR(numerator[static_cast<std::size_t>(i)], column[i], kTolerance * column.norm());
    EXPECT_EQ(variances[static_cast<std::size_t>(i)], factors_.variance(i));
  }
}

TEST_P(Ud, MeasurementIntoOthersIsThatInPlace) {
  Array numerator;
  factors_.project(phi_, numerator);
  Array in_place = numerator;
  Factors other;
  Array variances{};
  const double alpha = other.measure(factors_, numerator, 0.95, 0.8, variances);
  EXPECT_EQ(factors_.measure(factors_, in_place, 0.95, 0.8, variances), alpha);
  EXPECT_EQ(other.d, factors_.d);
  EXPECT_EQ(other.u, factors_.u);
  EXPECT_EQ(numerator, in_place);
}

TEST_P(Ud, TraceIsThatOfTheMatrix) {
  Array weights;
  double expected = 0.0;
  for (int i = 0; i < kN; ++i) {
    weights[static_cast<std::size_t>(i)] = 1.0 + i;
    expected += (1.0 + i) * p_(i, i);
  }
  EXPECT_NEAR(factors_.weighted_trace(weights), expected, kTolerance * expected);
}

TEST_P(Ud, ScalingScales) {
  factors_.scale(0.25);
  expect_near(factors_.matrix(), 0.25 * p_);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Ud, testing::Range(0U, 20U));

TEST(UdFactors, RefusesWhatIsNotACovarianceAndKeepsItsOwn) {
  Factors factors;
  ASSERT_TRUE(factors.set_diagonal(Vector::Constant(2.0)));
  const Matrix before = factors.matrix();
  const double bad[] = {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(),
                        std::numeric_limits<double>::infinity()};
  for (const double value : bad) {
    Vector variances = Vector::Ones();
    variances[3] = value;
    EXPECT_FALSE(factors.set_diagonal(variances));
    EXPECT_FALSE(factors.factorise(variances.asDiagonal()));
  }
  Matrix singular = Matrix::Ones();
  EXPECT_FALSE(factors.factorise(singular));
  Matrix indefinite = Matrix::Identity();
  indefinite(0, 1) = indefinite(1, 0) = 1.5;
  EXPECT_FALSE(factors.factorise(indefinite));
  EXPECT_EQ(factors.matrix(), before);
}

TEST(UdFactors, AMatrixSingularInThisPrecisionIsRefused) {
  constexpr double kEps = std::numeric_limits<double>::epsilon();
  ehsid::UdFactors<double, 2> factors;
  Eigen::Matrix2d matrix = Eigen::Matrix2d::Ones();
  matrix(1, 1) += kEps;  // one rounding away from singular: the pivot that is left is noise
  EXPECT_FALSE(factors.factorise(matrix));
  matrix(1, 1) = 1.0 + 8.0 * kEps;
  EXPECT_TRUE(factors.factorise(matrix));
}

TEST(UdFactors, UsableMeansFiniteWithPositiveNormalDiagonal) {
  using Limits = std::numeric_limits<double>;
  Factors factors;
  ASSERT_TRUE(factors.set_diagonal(Vector::Constant(Limits::min())));
  EXPECT_TRUE(factors.usable());
  for (const double bad :
       {0.0, -1.0, Limits::denorm_min(), Limits::infinity(), Limits::quiet_NaN()}) {
    for (double& value : factors.d) {
      value = bad;
      EXPECT_FALSE(factors.usable()) << bad;
      value = 1.0;
    }
  }
  for (const double bad : {Limits::infinity(), Limits::quiet_NaN()}) {
    for (double& value : factors.u) {
      value = bad;
      EXPECT_FALSE(factors.usable()) << bad;
      value = -1e3;
    }
  }
  EXPECT_TRUE(factors.usable());
}

TEST(UdFactors, NoFactorThatIsNotFiniteHidesFromTheTrace) {
  // What Rls relies on. Weights of zero: from a start variance whose inverse is too small for a number.
  using Limits = std::numeric_limits<double>;
  for (const double weight : {1.0, Limits::denorm_min(), 0.0}) {
    Array weights;
    weights.fill(weight);
    for (const double d : {1.0, Limits::min()}) {
      Factors factors;
      ASSERT_TRUE(factors.set_diagonal(Vector::Constant(d)));
      factors.u.fill(-0.5);
      EXPECT_TRUE(ehsid::is_finite(factors.weighted_trace(weights)));
      for (const double bad : {Limits::infinity(), -Limits::infinity(), Limits::quiet_NaN()}) {
        for (double& value : factors.u) {
          value = bad;
          EXPECT_FALSE(ehsid::is_finite(factors.weighted_trace(weights)));
          value = -0.5;
        }
      }
    }
  }
}

TEST(UdFactors, FactorsStayPositiveInFloatWhereTheMatrixDoesNot) {
  // Two regressors that hardly differ, many times: the textbook update (13) in float goes indefinite.
  ehsid::UdFactors<float, 3> factors;
  ASSERT_TRUE(factors.set_diagonal(Eigen::Vector3f::Constant(1e6F)));
  Eigen::Matrix3f textbook = Eigen::Matrix3f::Identity() * 1e6F;
  bool textbook_failed = false;
  for (int k = 0; k < 2000; ++k) {
    const Eigen::Vector3f phi(1.0F, 1.0F + 1e-3F * static_cast<float>(k % 2), 1.0F);
    ehsid::Array<float, 3> f;
    factors.project(phi, f);
    ehsid::Array<float, 3> variances{};
    factors.measure(factors, f, 1.0F, 1.0F, variances);
    ASSERT_TRUE(factors.usable()) << "at " << k;
    const Eigen::Vector3f column = textbook * phi;
    textbook -= column * column.transpose() / (1.0F + phi.dot(column));
    textbook_failed = textbook_failed || !(textbook.diagonal().minCoeff() > 0.0F);
  }
  EXPECT_TRUE(textbook_failed);
}

}  // namespace
