// SPDX-License-Identifier: MIT
#include <ehsid/arx_estimator.hpp>
#include <ehsid/forgetting.hpp>
#include <ehsid/whiteness.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

namespace {

using ehsid::Status;
using Monitor = ehsid::WhitenessMonitor<double>;

/// What the monitor reads of a recursion, made by hand.
struct Residuals {
  struct Values {
    double innovation;
    double square;
    double mean_square;
    double weight;
    double forgetting_factor;
  };

  Values values{0.0, 0.0, 1.0, 1e3, 1.0};

  const Values& state() const { return values; }
  static int size() { return 6; }

  void next(double innovation) {
    values.innovation = innovation;
    values.square = innovation * innovation;
  }
};

/// Near the largest numbers of the type.
struct Huge {
  struct Values {
    float innovation;
    float square;
    float mean_square;
    float weight;
    float forgetting_factor;
  };

  Values values{-1e19F, 9e18F, 1e-30F, 1e6F, 1.0F};

  const Values& state() const { return values; }
  static int size() { return 6; }
};

/// The six sums as the header defines them, over the whole record.
double statistic(const std::vector<double>& z, const std::vector<double>& leaving, double rho) {
  double total = 0.0;
  for (int test = 0; test < 6; ++test) {
    double sum = 0.0;
    double square = 0.0;
    for (std::size_t k = 0; k < z.size(); ++k) {
      // The command that leaves the regressor at k - 1 is the first one that it lacks at k.
      const std::size_t lag = static_cast<std::size_t>(test < 3 ? test + 1 : 2 * (test - 3) + 1);
      const double past = k < lag ? 0.0 : (test < 3 ? z : leaving)[k - lag];
      sum = rho * sum + z[k] * past;
      square = rho * rho * square + z[k] * z[k] * past * past;
    }
    total += square > 0.0 ? sum * sum / square : 0.0;
  }
  return total;
}

TEST(Whiteness, StatisticIsThatOfTheDefinition) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (const double lambda : {1.0, 0.999}) {
    Monitor monitor;
    Residuals residuals;
    residuals.values.forgetting_factor = lambda;
    std::vector<double> z;
    std::vector<double> leaving;
    // The terms of a statistic are of six samples; the last sample is repeated so that all are of one state but for these.
    for (int k = 0; k < 600; ++k) {
      const double innovation = normal(random);
      const double command = normal(random);
      residuals.next(innovation);
      monitor.updated(residuals, command);
      const double most = 3.0;
      z.push_back(std::min(most, std::max(-most, innovation)));
      leaving.push_back(command);
    }
    const auto& state = monitor.state();
    double formed = 0.0;
    for (std::size_t i = 0; i < 6; ++i) {
      formed += state.sums[i] * state.sums[i] / state.squares[i];
    }
    const double rho = lambda < 1.0 - 1e-5 ? lambda : 1.0 - 1e-5;
    EXPECT_NEAR(formed, statistic(z, leaving, rho), 1e-10 * (1.0 + formed));
  }
}

TEST(Whiteness, AlarmAndReleaseHaveAHysteresis) {
  Monitor monitor;
  Residuals residuals;
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  double error = 0.0;
  for (int k = 0; k < 2000; ++k) {
    error = 0.5 * error + std::sqrt(0.75) * normal(random);
    residuals.next(error);
    monitor.updated(residuals, normal(random));
    if (monitor.state().samples < Monitor::kFewest) {
      ASSERT_TRUE(monitor.white()) << "with so few samples";
    }
  }
  ASSERT_FALSE(monitor.white());
  EXPECT_DOUBLE_EQ(monitor.inflation(), std::sqrt(1.0 + monitor.statistic()));
  residuals.values.forgetting_factor = 0.99;  // the memory is 500 samples all the same
  bool was_white = false;
  for (int k = 0; k < 20000 && !was_white; ++k) {
    residuals.next(normal(random));
    monitor.updated(residuals, normal(random));
    was_white = monitor.white();
    ASSERT_EQ(was_white, monitor.statistic() <= Monitor::kRelease);
  }
  EXPECT_TRUE(was_white);
  EXPECT_EQ(monitor.inflation(), 1.0);
}

TEST(Whiteness, ErrorsOfRoundingAreNotNoise) {
  Monitor monitor;
  Residuals residuals;
  residuals.values.mean_square = 1e-14;
  for (int k = 0; k < 5000; ++k) {
    residuals.next(1e-7);  // as coloured as can be
    monitor.updated(residuals, 1.0);
    ASSERT_TRUE(monitor.white());
  }
  EXPECT_TRUE(monitor.enough());
  EXPECT_EQ(monitor.statistic(), 0.0);
}

TEST(Whiteness, SkippedSamplesKeepTheLagsAndEnterNoSum) {
  // Noise whose sign alternates, and every other sample skipped: what is left has no neighbour at lag 1 and 3.
  Monitor monitor;
  Residuals residuals;
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 1000; ++k) {
    residuals.next(normal(random));
    if (k % 2 == 0) {
      monitor.updated(residuals, 0.0);
    } else {
      monitor.skipped(0.0);
    }
  }
  EXPECT_EQ(monitor.state().samples, 500);
  EXPECT_EQ(monitor.state().squares[0], 0.0);
  EXPECT_GT(monitor.state().squares[1], 100.0);
  EXPECT_EQ(monitor.state().squares[2], 0.0);
}

TEST(Whiteness, AHoleInTheHistoryEndsThePast) {
  Monitor monitor;
  Residuals residuals;
  residuals.next(1.0);
  monitor.updated(residuals, 1.0);
  monitor.interrupted();
  monitor.updated(residuals, 1.0);
  for (const double square : monitor.state().squares) {
    EXPECT_EQ(square, 0.0);
  }
}

TEST(Whiteness, CountersStopAtTheirLimit) {
  Monitor monitor;
  auto state = monitor.state();
  state.samples = std::numeric_limits<std::int32_t>::max() - 1;
  state.tested = std::numeric_limits<std::int32_t>::max() - 1;
  ASSERT_EQ(monitor.restore(state), Status::ok);
  Residuals residuals;
  residuals.next(1.0);
  for (int k = 0; k < 5; ++k) {
    monitor.updated(residuals, 1.0);
  }
  EXPECT_EQ(monitor.state().samples, std::numeric_limits<std::int32_t>::max());
  EXPECT_EQ(monitor.state().tested, std::numeric_limits<std::int32_t>::max());
  EXPECT_TRUE(monitor.enough());
}

TEST(Whiteness, HugeCommandsAndErrorsLeaveEveryNumberFinite) {
  ehsid::WhitenessMonitor<float> monitor;
  const Huge huge;
  for (int k = 0; k < 300000; ++k) {
    monitor.updated(huge, std::numeric_limits<float>::max());
    ASSERT_TRUE(ehsid::is_finite(monitor.statistic()));
    ASSERT_TRUE(ehsid::WhitenessMonitor<float>::usable(monitor.state()));
  }
  EXPECT_FALSE(monitor.white());
  EXPECT_TRUE(ehsid::is_finite(monitor.inflation()));
}

TEST(Whiteness, ImpossibleStatesAreRefused) {
  Monitor monitor;
  const auto good = monitor.state();
  const auto refused = [&](auto change) {
    auto state = good;
    change(state);
    return monitor.restore(state) == Status::invalid_argument;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(refused([&](auto& s) { s.errors[0] = nan; }));
  EXPECT_TRUE(refused([](auto& s) { s.errors[2] = 4.0; }));
  EXPECT_TRUE(refused([](auto& s) { s.commands[4] = -1e7; }));
  EXPECT_TRUE(refused([&](auto& s) { s.sums[5] = nan; }));
  EXPECT_TRUE(refused([](auto& s) { s.squares[0] = -1.0; }));
  EXPECT_TRUE(refused([](auto& s) {
    s.sums[0] = 1e30;
    s.squares[0] = 1e-30;
  }));
  EXPECT_TRUE(refused([](auto& s) { s.statistic = -1.0; }));
  EXPECT_TRUE(refused([&](auto& s) { s.partial = nan; }));
  EXPECT_TRUE(refused([](auto& s) { s.samples = -1; }));
  EXPECT_TRUE(refused([](auto& s) { s.tested = -1; }));
  EXPECT_TRUE(refused([](auto& s) { s.next = 6; }));
  EXPECT_TRUE(refused([](auto& s) { s.coloured = 2; }));
  EXPECT_EQ(monitor.restore(good), Status::ok);
}

class Estimators : public testing::Test {
 protected:
  using Estimator = ehsid::ArxEstimator<float, 3, 3, 1>;

  /// One sample of model (16) with white noise in the equation and on the measured position.
  Status sample(Estimator& estimator, double equation_noise, double position_noise) {
    const double command = (random_() & 1U) != 0U ? 1.0 : -1.0;
    const double y = 2.2390 * y_[0] - 1.7820 * y_[1] + 0.5427 * y_[2] + 0.3850 * u_[0] -
                     0.5810 * u_[1] + 0.2954 * u_[2] + equation_noise * normal_(random_);
    const double measured = y + position_noise * normal_(random_);
    for (int i = 2; i > 0; --i) {
      y_[i] = y_[i - 1];
      u_[i] = u_[i - 1];
    }
    y_[0] = y;
    u_[0] = command;
    return estimator.step(static_cast<float>(command), static_cast<float>(measured));
  }

  double y_[3] = {};
  double u_[3] = {};
  std::mt19937 random_{11};
  std::normal_distribution<double> normal_;
};

TEST_F(Estimators, ANoisySensorIsSeenAndNothingConverges) {
  Estimator estimator;
  for (int k = 0; k < 3000; ++k) {
    static_cast<void>(sample(estimator, 0.0, 0.01));
    ASSERT_FALSE(estimator.converged()) << "at " << k;
  }
  EXPECT_FALSE(estimator.whiteness().white());
  const float inflation = std::sqrt(1.0F + estimator.whiteness().statistic());
  const auto plain = estimator.recursion().standard_deviation();
  for (int i = 0; i < 6; ++i) {
    const float enlarged = inflation * plain[i];
    EXPECT_FLOAT_EQ(estimator.standard_deviation()[i], enlarged);
    EXPECT_FLOAT_EQ(estimator.covariance()(i, i), enlarged * enlarged);
  }
}

TEST_F(Estimators, WhiteNoiseChangesNothing) {
  Estimator estimator;
  for (int k = 0; k < 3000; ++k) {
    static_cast<void>(sample(estimator, 0.01, 0.0));
    ASSERT_EQ(estimator.standard_deviation(), estimator.recursion().standard_deviation());
  }
  EXPECT_TRUE(estimator.converged());
}

TEST_F(Estimators, NoNoiseIsNoReasonNotToConverge) {
  Estimator estimator;
  for (int k = 0; k < 500; ++k) {
    static_cast<void>(sample(estimator, 0.0, 0.0));
  }
  EXPECT_TRUE(estimator.whiteness().white());
  EXPECT_TRUE(estimator.converged());
}

TEST_F(Estimators, ARestoredEstimatorGoesOnAsTheFirst) {
  Estimator first;
  for (int k = 0; k < 1000; ++k) {
    static_cast<void>(sample(first, 0.0, 0.01));
  }
  Estimator second;
  ASSERT_EQ(second.restore(first.save()), Status::ok);
  for (int k = 0; k < 50; ++k) {
    const auto random = random_;
    const auto normal = normal_;
    double y[3];
    double u[3];
    std::copy(y_, y_ + 3, y);
    std::copy(u_, u_ + 3, u);
    static_cast<void>(sample(first, 0.0, 0.01));
    random_ = random;
    normal_ = normal;
    std::copy(y, y + 3, y_);
    std::copy(u, u + 3, u_);
    static_cast<void>(sample(second, 0.0, 0.01));
    ASSERT_EQ(first.save(), second.save()) << "at " << k;
  }
}

TEST_F(Estimators, ARefusedSampleLeavesTheSumsAlone) {
  Estimator estimator;
  for (int k = 0; k < 500; ++k) {
    static_cast<void>(sample(estimator, 0.0, 0.01));
  }
  const auto before = estimator.whiteness().state();
  ASSERT_EQ(estimator.step(0.0F, std::numeric_limits<float>::quiet_NaN()), Status::invalid_input);
  ASSERT_EQ(sample(estimator, 0.0, 0.01), Status::filling);
  const auto& after = estimator.whiteness().state();
  EXPECT_EQ(after.sums, before.sums);
  EXPECT_EQ(after.squares, before.squares);
  EXPECT_EQ(after.samples, before.samples);
  for (const float error : after.errors) {
    EXPECT_EQ(error, 0.0F) << "what follows has no past";
  }
}

}  // namespace
