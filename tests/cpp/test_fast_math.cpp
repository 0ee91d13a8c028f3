// SPDX-License-Identifier: MIT
// Compiled with -ffast-math, which lets a compiler take every number for finite: the guard must hold.
#include <ehsid/forgetting.hpp>
#include <ehsid/rls.hpp>
#include <ehsid/servo_estimator.hpp>

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

template <class Scalar>
void expect_refused_by_servo_estimator() {
  volatile Scalar zero = 0;
  ehsid::ServoEstimator<Scalar> estimator;
  typename ehsid::ServoEstimator<Scalar>::Options options;
  EXPECT_EQ(estimator.configure(options), ehsid::Status::invalid_argument);
  options.dt_s = Scalar(0.01);
  ASSERT_EQ(estimator.configure(options), ehsid::Status::ok);
  Scalar velocity(0);
  Scalar y(0);
  const auto run = [&] {
    for (int k = 0; k < 1500; ++k) {
      const Scalar u = k / 25 % 3 == 1 ? Scalar(-1) : Scalar(0.7);
      ASSERT_FALSE(ehsid::is_error(estimator.step(u, y)));
      velocity += Scalar(0.2) * (Scalar(0.001) * u - velocity);
      y += velocity;
    }
  };
  run();
  const Scalar before = estimator.servo().gain.value;
  const Scalar one = Scalar(1) + zero;
  for (const Scalar bad : {one / zero, -one / zero, zero / zero}) {
    EXPECT_EQ(estimator.step(bad, y), ehsid::Status::invalid_input);
    EXPECT_EQ(estimator.step(one, bad), ehsid::Status::invalid_input);
    options.dt_s = bad;
    EXPECT_EQ(estimator.configure(options), ehsid::Status::invalid_argument);
  }
  EXPECT_EQ(estimator.servo().gain.value, before);
  run();
  EXPECT_NEAR(estimator.servo().gain.value, Scalar(0.1), Scalar(0.01));
  EXPECT_TRUE(estimator.servo().gain.trusted);
}

TEST(FastMath, ServoEstimatorOfFloat) { expect_refused_by_servo_estimator<float>(); }
TEST(FastMath, ServoEstimatorOfDouble) { expect_refused_by_servo_estimator<double>(); }

}  // namespace
