// SPDX-License-Identifier: MIT
#include <ehsid/bounded_math.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace {

template <class Scalar>
class BoundedMath : public ::testing::Test {};
using Scalars = ::testing::Types<float, double>;
TYPED_TEST_SUITE(BoundedMath, Scalars);

TYPED_TEST(BoundedMath, ExponentialFollowsTheLibrary) {
  using Scalar = TypeParam;
  // Four squarings double a relative error four times; the sum before them is within a unit of the last place.
  const double most = 40.0 * static_cast<double>(std::numeric_limits<Scalar>::epsilon());
  for (int i = -4000; i <= 4000; ++i) {
    const Scalar x = static_cast<Scalar>(i) / Scalar(1000);
    const double right = std::exp(static_cast<double>(x));
    EXPECT_NEAR(static_cast<double>(ehsid::bounded_exp(x)) / right, 1.0, most) << x;
  }
  EXPECT_EQ(ehsid::bounded_exp(Scalar(1e9)), ehsid::bounded_exp(Scalar(4)));
  EXPECT_EQ(ehsid::bounded_exp(Scalar(-1e9)), ehsid::bounded_exp(Scalar(-4)));
  EXPECT_EQ(ehsid::bounded_exp(Scalar(0)), Scalar(1));
}

TYPED_TEST(BoundedMath, LogarithmFollowsTheLibrary) {
  using Scalar = TypeParam;
  const double epsilon = static_cast<double>(std::numeric_limits<Scalar>::epsilon());
  Scalar x = std::numeric_limits<Scalar>::min();
  int tried = 0;
  while (x < std::numeric_limits<Scalar>::max() / Scalar(1.7)) {
    const double right = std::log(static_cast<double>(x));
    EXPECT_NEAR(static_cast<double>(ehsid::bounded_log(x)), right,
                4.0 * epsilon * (1.0 + std::abs(right)))
        << x;
    x *= Scalar(1.6180339);
    ++tried;
  }
  EXPECT_GT(tried, 300);
  EXPECT_EQ(ehsid::bounded_log(Scalar(1)), Scalar(0));
}

TYPED_TEST(BoundedMath, LogarithmOfWhatHasNoneIsThatOfTheLeastNumber) {
  using Scalar = TypeParam;
  const Scalar least = ehsid::bounded_log(std::numeric_limits<Scalar>::min());
  const Scalar strange[] = {Scalar(0), Scalar(-1), std::numeric_limits<Scalar>::infinity(),
                            std::numeric_limits<Scalar>::quiet_NaN(),
                            std::numeric_limits<Scalar>::denorm_min()};
  for (const Scalar x : strange) {
    EXPECT_EQ(ehsid::bounded_log(x), least);
  }
}

}  // namespace
