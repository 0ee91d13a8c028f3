// SPDX-License-Identifier: MIT
// Compiled with -ffast-math, which lets a compiler take every number for finite: the guard must hold.
#include <ehsid/forgetting.hpp>
#include <ehsid/rls.hpp>

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#ifndef __FAST_MATH__
#error "this test says nothing without -ffast-math"
#endif

namespace {

template <class Scalar>
void expect_judged_right() {
  using Limits = std::numeric_limits<Scalar>;
  volatile Scalar zero = 0;  // so that the compiler cannot know the numbers
  for (const Scalar value : {Limits::max(), Limits::lowest(), Limits::denorm_min(), Scalar(1)}) {
    EXPECT_TRUE(ehsid::is_finite(value + zero));
  }
  const Scalar one = zero + Scalar(1);
  EXPECT_FALSE(ehsid::is_finite(one / zero));
  EXPECT_FALSE(ehsid::is_finite(-one / zero));
  EXPECT_FALSE(ehsid::is_finite(zero / zero));
  const Scalar huge = Limits::max() + zero;
  EXPECT_FALSE(ehsid::is_finite(huge * huge));
  ehsid::Array<Scalar, 3> values = {one, zero / zero, one};
  EXPECT_FALSE(ehsid::all_finite<3>(values));
  values[1] = one;
  EXPECT_TRUE(ehsid::all_finite<3>(values));
}

TEST(FastMath, GuardOfFloat) { expect_judged_right<float>(); }
TEST(FastMath, GuardOfDouble) { expect_judged_right<double>(); }

template <class Scalar>
void expect_refused() {
  using Limits = std::numeric_limits<Scalar>;
  volatile Scalar zero = 0;
  ehsid::Rls<Scalar, 3, ehsid::Constant<Scalar>> rls;
  const ehsid::Vector<Scalar, 3> good(Scalar(1), Scalar(-2), Scalar(0.5));
  ASSERT_EQ(rls.update(good, Scalar(1)), ehsid::Status::ok);
  const auto before = rls.state();
  const Scalar one = Scalar(1) + zero;
  for (const Scalar bad : {one / zero, -one / zero, zero / zero}) {
    EXPECT_EQ(rls.update(good, bad), ehsid::Status::invalid_input);
    for (int i = 0; i < 3; ++i) {
      ehsid::Vector<Scalar, 3> phi = good;
      phi[i] = bad;
      EXPECT_EQ(rls.update(phi, Scalar(1)), ehsid::Status::invalid_input);
    }
  }
  EXPECT_EQ(rls.update(good, Limits::max()), ehsid::Status::numerical_limit);
  EXPECT_EQ(rls.update(Limits::max() / Scalar(4) * good, one), ehsid::Status::numerical_limit);
  EXPECT_EQ(std::memcmp(&before, &rls.state(), sizeof before), 0);
}

TEST(FastMath, UpdateOfFloat) { expect_refused<float>(); }
TEST(FastMath, UpdateOfDouble) { expect_refused<double>(); }

}  // namespace
