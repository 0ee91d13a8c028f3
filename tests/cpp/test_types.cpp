// SPDX-License-Identifier: MIT
#include <ehsid/types.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <type_traits>

namespace {

using ehsid::Array;
using ehsid::Status;
using ehsid::Vector;

template <class Scalar>
class Finite : public testing::Test {
 protected:
  using Limits = std::numeric_limits<Scalar>;
  static constexpr Scalar kBad[] = {Limits::quiet_NaN(), -Limits::quiet_NaN(),
                                    Limits::signaling_NaN(), Limits::infinity(),
                                    -Limits::infinity()};
};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Finite, Scalars, );

TYPED_TEST(Finite, AnyBitsAreJudgedAsTheLibraryJudgesThem) {
  using Bits = std::conditional_t<sizeof(TypeParam) == sizeof(float), std::uint32_t, std::uint64_t>;
  constexpr int kExponentBits = sizeof(TypeParam) == sizeof(float) ? 8 : 11;
  constexpr int kMantissaBits = static_cast<int>(8 * sizeof(TypeParam)) - 1 - kExponentBits;
  std::mt19937_64 random(1);
  int infinite = 0;
  for (Bits exponent = 0; exponent < Bits{1} << kExponentBits; ++exponent) {
    for (int i = 0; i < 64; ++i) {
      // Mantissas of zeros, one low bit, one high bit, and random ones; both signs.
      Bits mantissa = static_cast<Bits>(random()) & ((Bits{1} << kMantissaBits) - 1);
      mantissa = i < 2 ? 0 : i < 4 ? 1 : i < 6 ? Bits{1} << (kMantissaBits - 1) : mantissa;
      const Bits sign = static_cast<Bits>(i & 1) << (kExponentBits + kMantissaBits);
      const Bits bits = sign | exponent << kMantissaBits | mantissa;
      TypeParam value{};
      std::memcpy(&value, &bits, sizeof value);
      ASSERT_EQ(ehsid::is_finite(value), std::isfinite(value)) << std::hex << bits;
      ASSERT_EQ(ehsid::is_normal_positive(value), std::isnormal(value) && value > TypeParam(0))
          << std::hex << bits;
      infinite += std::isfinite(value) ? 0 : 1;
    }
  }
  EXPECT_EQ(infinite, 64);  // the last exponent only
}

TYPED_TEST(Finite, NormalAndPositiveEndsAtTheSmallestNormalNumber) {
  EXPECT_TRUE(ehsid::is_normal_positive(TestFixture::Limits::min()));
  EXPECT_TRUE(ehsid::is_normal_positive(TestFixture::Limits::max()));
  EXPECT_FALSE(ehsid::is_normal_positive(std::nextafter(TestFixture::Limits::min(), TypeParam(0))));
  for (const TypeParam bad :
       {TypeParam(0), TestFixture::Limits::denorm_min(), TestFixture::Limits::infinity()}) {
    EXPECT_FALSE(ehsid::is_normal_positive(bad)) << bad;
    EXPECT_FALSE(ehsid::is_normal_positive(-bad)) << -bad;
  }
  EXPECT_FALSE(ehsid::is_normal_positive(-TestFixture::Limits::min()));
  EXPECT_FALSE(ehsid::is_normal_positive(TestFixture::Limits::quiet_NaN()));
}

TYPED_TEST(Finite, OneBadEntryAnywhereIsFound) {
  constexpr int kN = 7;
  Array<TypeParam, kN> values;
  values.fill(std::numeric_limits<TypeParam>::max());
  Vector<TypeParam, kN> vector = Vector<TypeParam, kN>::Constant(-values[0]);
  EXPECT_TRUE(ehsid::all_finite<kN>(values));
  EXPECT_TRUE(ehsid::all_finite<kN>(vector));
  for (const TypeParam bad : TestFixture::kBad) {
    for (int i = 0; i < kN; ++i) {
      auto broken = values;
      broken[static_cast<std::size_t>(i)] = bad;
      EXPECT_FALSE(ehsid::all_finite<kN>(broken)) << "entry " << i;
      auto broken_vector = vector;
      broken_vector[i] = bad;
      EXPECT_FALSE(ehsid::all_finite<kN>(broken_vector)) << "entry " << i;
    }
  }
}

TEST(Status, ErrorsAreTheRefusals) {
  for (const Status normal :
       {Status::ok, Status::filling, Status::no_information, Status::disabled, Status::reset}) {
    EXPECT_FALSE(ehsid::is_error(normal));
  }
  for (const Status error : {Status::invalid_input, Status::out_of_range, Status::numerical_limit,
                             Status::invalid_argument}) {
    EXPECT_TRUE(ehsid::is_error(error));
  }
}

TEST(Status, CodesAreThoseOfRecordsAlreadyWritten) {
  // Trajectories store the number of a status: a new one goes to the end of its kind, none moves.
  const Status in_order[] = {
      Status::ok,           Status::filling,         Status::no_information,
      Status::disabled,     Status::reset,           Status::invalid_input,
      Status::out_of_range, Status::numerical_limit, Status::invalid_argument};
  int code = 0;
  for (const Status status : in_order) {
    EXPECT_EQ(static_cast<int>(status), code++);
  }
}

TEST(Dot, IsTheSumFromTheFirstEntryToTheLast) {
  // In float 1e8 + 1 is 1e8: each order of addition has a result of its own.
  const Array<float, 4> values = {1e8F, 1.0F, -1e8F, 1.0F};
  const Vector<float, 4> ones = Vector<float, 4>::Ones();
  EXPECT_EQ(ehsid::dot<4>(values, ones), 1.0F);
  EXPECT_EQ(ehsid::dot<4>(ones, values), 1.0F);
  EXPECT_EQ(ehsid::dot<4>(ehsid::as_vector(values).eval(), ones), 1.0F);
}

TEST(Dot, OfSixteenEntriesIsTheScalarProduct) {
  constexpr int kN = 16;
  std::mt19937 random(2);
  std::uniform_int_distribution<int> draw(-1000, 1000);
  for (int k = 0; k < 100; ++k) {
    Vector<float, kN> left;
    Vector<float, kN> right;
    int expected = 0;
    for (int i = 0; i < kN; ++i) {
      const int a = draw(random);
      const int b = draw(random);
      expected += a * b;  // at most 16e6: exact in float, at every partial sum
      left[i] = static_cast<float>(a);
      right[i] = static_cast<float>(b);
    }
    ASSERT_EQ(ehsid::dot<kN>(left, right), static_cast<float>(expected));
  }
}

TEST(Vocabulary, AnArrayIsSeenAsAVectorWithoutACopy) {
  Array<double, 3> values = {1.0, 2.0, 3.0};
  const auto seen = ehsid::as_vector(values);
  EXPECT_EQ(seen.data(), values.data());
  values[1] = -5.0;
  EXPECT_EQ(seen, Eigen::Vector3d(1.0, -5.0, 3.0));
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(ehsid::entry(values, i), seen[i]);
    EXPECT_EQ(ehsid::entry(Vector<double, 3>(seen), i), seen[i]);
  }
}

TEST(Squarable, HasAFiniteSquare) {
  EXPECT_TRUE(ehsid::is_squarable(-9.2e18F));
  EXPECT_FALSE(ehsid::is_squarable(9.3e18F));  // 2^63
  EXPECT_FALSE(ehsid::is_squarable(std::numeric_limits<float>::quiet_NaN()));
  EXPECT_TRUE(ehsid::is_squarable(-6.7e153));
  EXPECT_FALSE(ehsid::is_squarable(std::numeric_limits<double>::infinity()));
}

TEST(Status, HasAName) {
  constexpr const char* name = ehsid::to_string(Status::no_information);  // known to the compiler
  EXPECT_STREQ(name, "no_information");
  EXPECT_STREQ(ehsid::to_string(Status::ok), "ok");
  EXPECT_STREQ(ehsid::to_string(Status::invalid_argument), "invalid_argument");
  // NOLINTNEXTLINE(clang-analyzer-optin.core.EnumCastOutOfRange): a caller in C can pass any number
  EXPECT_STREQ(ehsid::to_string(static_cast<Status>(9)), "unknown");
}

TEST(BoundedProduct, StopsAtTheLargestNumber) {
  const float largest = std::numeric_limits<float>::max();
  EXPECT_EQ(ehsid::bounded_product(2.0F, -3.0F), -6.0F);
  EXPECT_EQ(ehsid::bounded_product(1e30F, -1e30F), -largest);
  EXPECT_EQ(ehsid::bounded_product(-1e30F, -1e30F), largest);
}

}  // namespace
