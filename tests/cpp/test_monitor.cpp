// SPDX-License-Identifier: MIT
#include <ehsid/forgetting.hpp>
#include <ehsid/monitor.hpp>
#include <ehsid/rls.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

namespace {

using Recursion = ehsid::Rls<double, 2, ehsid::Constant<double>>;
using Monitor = ehsid::ConvergenceMonitor<double>;
using ehsid::Status;

class Convergence : public testing::Test {
 protected:
  Convergence() { EXPECT_EQ(monitor_.configure(options_), Status::ok); }

  /// One sample of y = u - 0.5 v + noise.
  void sample(double noise) {
    const Recursion::Regressor phi(normal_(random_), normal_(random_));
    const double y = phi[0] - 0.5 * phi[1] + noise * normal_(random_);
    ASSERT_EQ(rls_.update(phi, y), Status::ok);
    monitor_.updated(rls_);
  }

  /// Is every standard deviation within the tolerance of its parameter?
  bool inside() const {
    const auto theta = rls_.theta_hat();
    const auto deviation = rls_.standard_deviation();
    bool all = true;
    for (int i = 0; i < 2; ++i) {
      const double size = std::max(std::abs(theta[i]), options_.magnitude);
      all = all && deviation[i] <= options_.tolerance * size;
    }
    return all;
  }

  Monitor::Options options_{};
  Monitor monitor_;
  Recursion rls_{ehsid::Constant<double>{1.0}};
  std::mt19937 random_{5};
  std::normal_distribution<double> normal_;
};

TEST_F(Convergence, NeedsEveryDeviationInsideForTheWholeHold) {
  int steady = 0;
  for (int k = 1; k <= 4000; ++k) {
    sample(1.0);
    const bool enough = k > 4;  // more samples than twice the parameters
    steady = enough && inside() ? steady + 1 : 0;
    ASSERT_EQ(monitor_.converged(), steady >= options_.hold) << "at " << k;
  }
  EXPECT_TRUE(monitor_.converged());
  monitor_.restart();
  EXPECT_FALSE(monitor_.converged());
}

TEST_F(Convergence, FewSamplesProveNothingHoweverSmallTheirErrors) {
  for (int k = 1; k <= 100; ++k) {
    sample(0.0);
    // Samples count from the fifth on: before, residuals are small because there are few of them.
    ASSERT_EQ(monitor_.converged(), k >= 4 + options_.hold) << "at " << k;
  }
}

TEST_F(Convergence, ExcitationIsTheShareOfSamplesWithInformation) {
  for (int k = 0; k < 50; ++k) {
    sample(1.0);
    monitor_.skipped();
  }
  EXPECT_NEAR(monitor_.excitation(), 0.5, 0.01);
  EXPECT_EQ(monitor_.samples(), 100);
  for (int k = 0; k < 2000; ++k) {
    monitor_.skipped();
  }
  EXPECT_LT(monitor_.excitation(), 1e-8);  // 0.99^2000 = 2e-9
}

TEST_F(Convergence, WhatWasKnownStaysKnownWithoutInformation) {
  for (int k = 0; k < 4000; ++k) {
    sample(0.1);
  }
  ASSERT_TRUE(monitor_.converged());
  for (int k = 0; k < 1000; ++k) {
    monitor_.skipped();
  }
  EXPECT_TRUE(monitor_.converged());
}

TEST(ConvergenceMonitor, CountersStopAtTheirLimit) {
  constexpr std::int32_t kLast = std::numeric_limits<std::int32_t>::max();
  Monitor::Options options;
  options.hold = kLast;
  Monitor monitor;
  ASSERT_EQ(monitor.configure(options), Status::ok);
  ASSERT_EQ(monitor.restore({kLast - 1, kLast - 1, 1.0}), Status::ok);
  Recursion rls{ehsid::Constant<double>{1.0}};
  for (int k = 0; k < 10; ++k) {
    ASSERT_EQ(rls.update({1.0, k % 2 == 0 ? 1.0 : -1.0}, 1.0), Status::ok);
  }
  for (int k = 0; k < 5; ++k) {
    monitor.updated(rls);
    EXPECT_EQ(monitor.samples(), kLast);
    EXPECT_EQ(monitor.state().steady, kLast);
    monitor.skipped();
  }
  EXPECT_TRUE(monitor.converged());
}

TEST(ConvergenceMonitor, OptionsAndStatesOutsideTheirRangesAreRefused) {
  Monitor monitor;
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(monitor.configure({bad, 0.1, 20}), Status::invalid_argument);
    EXPECT_EQ(monitor.configure({0.05, bad, 20}), Status::invalid_argument);
  }
  EXPECT_EQ(monitor.configure({0.05, 0.1, 0}), Status::invalid_argument);
  auto state = monitor.state();
  state.excitation = 1.5;
  EXPECT_EQ(monitor.restore(state), Status::invalid_argument);
  state = monitor.state();
  state.steady = -1;
  EXPECT_EQ(monitor.restore(state), Status::invalid_argument);
}

}  // namespace
