// SPDX-License-Identifier: MIT
// Compiled with -ffast-math, which lets a compiler take every number for finite: the guard must hold.
#include <ehsid/types.hpp>

#include <gtest/gtest.h>

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

}  // namespace
