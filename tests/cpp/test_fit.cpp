// SPDX-License-Identifier: MIT
#include <ehsid/fit.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace {

using Fit = ehsid::FitMonitor<double>;

struct Sample {
  double output;
  double innovation;
};

std::vector<Sample> samples(int count) {
  std::mt19937 random{11};
  std::normal_distribution<double> normal;
  std::vector<Sample> made;
  made.reserve(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) {
    made.push_back({5.0 + std::sin(0.01 * k) + 0.3 * normal(random), 0.2 * normal(random)});
  }
  return made;
}

/// 100 (1 - rms(epsilon) / rms(y - mean(y))) as sums over all samples, each with its weight.
double weighted_fit(const std::vector<Sample>& seen, const std::vector<double>& weights) {
  double total = 0.0;
  double mean = 0.0;
  double square = 0.0;
  double variance = 0.0;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    total += weights[k];
    mean += weights[k] * seen[k].output;
    square += weights[k] * seen[k].innovation * seen[k].innovation;
  }
  mean /= total;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    variance += weights[k] * (seen[k].output - mean) * (seen[k].output - mean);
  }
  return 100.0 * (1.0 - std::sqrt(square / variance));
}

/// Each step rounds by a few eps, relative to mean^2 / variance = 25 / 0.6 at worst: 4000 steps stay below
/// 4000 * 4 * 42 * 2.2e-16 = 1.5e-10 of 100 %.
constexpr double kRounding = 1.5e-8;

TEST(Fit, IsTheFormulaUntilTheWindowIsFull) {
  const auto seen = samples(Fit::kWindow);
  Fit fit;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    fit.update(seen[k].output, seen[k].innovation);
    if (k == 9 || k == 99 || k + 1 == seen.size()) {
      const std::vector<Sample> so_far(seen.begin(),
                                       seen.begin() + static_cast<std::ptrdiff_t>(k) + 1);
      ASSERT_NEAR(fit.percent(), weighted_fit(so_far, std::vector<double>(k + 1, 1.0)), kRounding);
    }
  }
}

TEST(Fit, FadesExponentiallyThen) {
  const auto seen = samples(4 * Fit::kWindow);
  const double kept = 1.0 - 1.0 / Fit::kWindow;
  Fit fit;
  std::vector<double> weights(seen.size(), 1.0);
  for (std::size_t k = 0; k < seen.size(); ++k) {
    fit.update(seen[k].output, seen[k].innovation);
    // Newest last; those of the first window count alike.
    const std::size_t first = Fit::kWindow - 1;
    weights[k] = std::pow(kept, static_cast<double>(seen.size() - 1 - (k > first ? k : first)));
  }
  EXPECT_NEAR(fit.percent(), weighted_fit(seen, weights), kRounding);
}

TEST(Fit, SaysNothingOfAnOutputThatRests) {
  Fit fit;
  EXPECT_EQ(fit.percent(), 0.0);
  for (int k = 0; k < 10; ++k) {
    fit.update(3.0, 0.1);
  }
  EXPECT_EQ(fit.percent(), 0.0);
}

TEST(Fit, IsPerfectWithoutInnovationsAndNegativeWhereTheMeanIsBetter) {
  Fit perfect;
  Fit poor;
  for (int k = 0; k < 10; ++k) {
    const double output = k % 2 == 0 ? 1.0 : -1.0;
    perfect.update(output, 0.0);
    poor.update(output, 2.0);
  }
  EXPECT_EQ(perfect.percent(), 100.0);
  EXPECT_NEAR(poor.percent(), -100.0, 1e-12);
  poor.restart();
  EXPECT_EQ(poor.state().samples, 0);
}

TEST(Fit, StaysFiniteWhateverComes) {
  const float values[] = {0.0F, 1e-45F, -1e-30F, 1.0F, -9e18F, 9e18F, 3e38F};
  ehsid::FitMonitor<float> fit;
  for (const float output : values) {
    for (const float innovation : values) {
      fit.update(output, innovation);
      ASSERT_TRUE(ehsid::is_finite(fit.percent())) << output << ", " << innovation;
      ASSERT_TRUE(ehsid::is_finite(fit.state().variance)) << output << ", " << innovation;
    }
  }
}

}  // namespace
