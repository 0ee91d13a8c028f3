// SPDX-License-Identifier: MIT
// exp and ln by series against those of the library in more digits.
#include <ehsid/bounded_math.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace {

template <class Scalar>
using Limits = std::numeric_limits<Scalar>;

/// Distance in units of the last place of the right value.
template <class Scalar>
double units(Scalar found, long double right) {
  int exponent = 0;
  static_cast<void>(std::frexp(right, &exponent));
  const long double unit = std::ldexp(1.0L, exponent - Limits<Scalar>::digits);
  return static_cast<double>(std::abs(static_cast<long double>(found) - right) / unit);
}

template <class Scalar>
double worst_of_exp() {
  constexpr int kSteps = 400000;
  double worst = 0.0;
  for (int i = -kSteps; i <= kSteps; ++i) {
    const Scalar x = Scalar(4) * static_cast<Scalar>(i) / static_cast<Scalar>(kSteps);
    worst = std::max(worst, units(ehsid::bounded_exp(x), std::exp(static_cast<long double>(x))));
  }
  return worst;
}

/// Over numbers m 2^e with every e, and about 1, where ln is small.
template <class Scalar>
double worst_of_log() {
  double worst = 0.0;
  const auto look = [&worst](Scalar x) {
    worst = std::max(worst, units(ehsid::bounded_log(x), std::log(static_cast<long double>(x))));
  };
  for (int e = Limits<Scalar>::min_exponent - 1; e < Limits<Scalar>::max_exponent; ++e) {
    for (int m = 0; m < 64; ++m) {
      look(std::ldexp(Scalar(1) + static_cast<Scalar>(m) / Scalar(64), e));
    }
  }
  for (int i = 1; i < 200000; ++i) {
    const Scalar apart = static_cast<Scalar>(i) / Scalar(400000);
    look(Scalar(1) + apart);
    look(Scalar(1) - apart);
  }
  for (Scalar apart = Limits<Scalar>::epsilon(); apart < Scalar(0.1); apart *= Scalar(2)) {
    look(Scalar(1) + apart);
    look(Scalar(1) - apart);
  }
  return worst;
}

TEST(BoundedExp, IsWithinTheStatedUnitsOfTheLastPlace) {
  EXPECT_LT(worst_of_exp<float>(), 32.0);
  EXPECT_LT(worst_of_exp<double>(), 32.0);
}

TEST(BoundedLog, IsWithinThreeUnitsOfTheLastPlace) {
  EXPECT_LT(worst_of_log<float>(), 3.0);
  EXPECT_LT(worst_of_log<double>(), 3.0);
}

template <class Scalar>
class BoundedMath : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(BoundedMath, Scalars, );

TYPED_TEST(BoundedMath, ExpIsLimitedAndPassesOnNan) {
  using Scalar = TypeParam;
  const Scalar infinity = Limits<Scalar>::infinity();
  EXPECT_EQ(ehsid::bounded_exp(Scalar(0)), Scalar(1));
  EXPECT_EQ(ehsid::bounded_exp(Limits<Scalar>::denorm_min()), Scalar(1));
  for (const Scalar beyond : {Scalar(4.001), Scalar(1e6), Limits<Scalar>::max(), infinity}) {
    EXPECT_EQ(ehsid::bounded_exp(beyond), ehsid::bounded_exp(Scalar(4)));
    EXPECT_EQ(ehsid::bounded_exp(-beyond), ehsid::bounded_exp(Scalar(-4)));
  }
  EXPECT_FALSE(ehsid::is_finite(ehsid::bounded_exp(Limits<Scalar>::quiet_NaN())));
}

TYPED_TEST(BoundedMath, LogOfWhatHasNoneIsThatOfTheLeastNormalNumber) {
  using Scalar = TypeParam;
  const Scalar least = ehsid::bounded_log(Limits<Scalar>::min());
  EXPECT_LT(units(least, std::log(static_cast<long double>(Limits<Scalar>::min()))), 3.0);
  EXPECT_EQ(ehsid::bounded_log(Scalar(1)), Scalar(0));
  for (const Scalar bad :
       {Scalar(0), -Scalar(0), Scalar(-1), Limits<Scalar>::lowest(), Limits<Scalar>::denorm_min(),
        Limits<Scalar>::min() / Scalar(2), Limits<Scalar>::infinity(), -Limits<Scalar>::infinity(),
        Limits<Scalar>::quiet_NaN(), -Limits<Scalar>::quiet_NaN()}) {
    EXPECT_EQ(ehsid::bounded_log(bad), least);
  }
}

TYPED_TEST(BoundedMath, LogUndoesExp) {
  using Scalar = TypeParam;
  for (int i = -64; i <= 64; ++i) {
    const Scalar x = static_cast<Scalar>(i) / Scalar(16);
    EXPECT_NEAR(ehsid::bounded_log(ehsid::bounded_exp(x)), x, 24 * Limits<Scalar>::epsilon());
  }
}

}  // namespace
