// SPDX-License-Identifier: MIT
// Settings, estimates and samples of any size, up to the largest numbers and down to the smallest: what is accepted gives
// finite outputs, and a state that can be reached can be saved and taken over again. For every policy, in float and double.
#include <ehsid/arx_estimator.hpp>

#include <cmath>
#include <limits>
#include <random>
#include <utility>

#include <gtest/gtest.h>

namespace {

using ehsid::SnapshotFault;
using ehsid::Status;

constexpr int kRuns = 60;
constexpr int kSamples = 250;  // past the long window of FRatio and the one of the reset

/// Numbers of every size, each from its own seed.
template <class Scalar>
class Numbers {
 public:
  explicit Numbers(unsigned seed) : random_(seed) {}

  bool one_of(int count) { return std::uniform_int_distribution<int>(1, count)(random_) == 1; }

  /// Above zero, from the smallest number to the largest; sometimes one of the two.
  Scalar positive() {
    using Limits = std::numeric_limits<Scalar>;
    if (one_of(8)) {
      return one_of(2) ? Limits::max() : Limits::denorm_min();
    }
    const auto least = static_cast<double>(Limits::min_exponent - Limits::digits);
    const auto most = static_cast<double>(Limits::max_exponent);
    const double exponent = std::uniform_real_distribution<double>(least, most)(random_);
    return static_cast<Scalar>(std::exp2(exponent));
  }

  Scalar real() { return one_of(2) ? positive() : -positive(); }

  /// From -1 to 1.
  Scalar ordinary() {
    return static_cast<Scalar>(std::uniform_real_distribution<double>(-1.0, 1.0)(random_));
  }

 private:
  std::mt19937 random_;
};

/// Replaces a setting now and then by a number of any size; the ranges are checked afterwards.
template <class Scalar, class Options>
void change(Numbers<Scalar>& numbers, Options& options) {
  const auto maybe = [&](Scalar& setting) {
    if (numbers.one_of(4)) {
      setting = numbers.positive();
    }
  };
  maybe(options.scaling.command_scale);
  maybe(options.scaling.position_scale);
  maybe(options.scaling.command_offset);
  maybe(options.scaling.position_offset);
  maybe(options.rls.information_margin);
  maybe(options.rls.covariance_ceiling);
  maybe(options.reset.short_window);
  maybe(options.reset.long_window);
  maybe(options.reset.trigger_ratio);
  maybe(options.reset.release_ratio);
  maybe(options.reset.floor);
  maybe(options.convergence.tolerance);
  maybe(options.convergence.magnitude);
  maybe(options.input_limit);
  options.reset_enabled = numbers.one_of(2);
  if (numbers.one_of(2)) {
    options.variance0.setConstant(numbers.positive());
  }
  using Policy = decltype(options.forgetting);
  Policy::settings([&](const ehsid::SettingInfo& /*setting*/, auto member) {
    maybe(member(options.forgetting));
  });
}

template <class Estimator>
void expect_finite(const Estimator& estimator) {
  const auto deviation = estimator.standard_deviation();
  const auto covariance = estimator.covariance();
  ASSERT_TRUE(ehsid::all_finite<Estimator::kN>(estimator.theta_hat()));
  for (int i = 0; i < Estimator::kN; ++i) {
    ASSERT_TRUE(ehsid::is_finite(deviation[i]) && deviation[i] >= 0);
    ASSERT_TRUE(ehsid::is_finite(covariance(i, i)) && covariance(i, i) >= 0);
  }
  ASSERT_TRUE(ehsid::is_finite(estimator.innovation()));
  ASSERT_TRUE(ehsid::is_forgetting_factor(estimator.forgetting_factor()));
  ASSERT_TRUE(ehsid::is_finite(estimator.residual_variance()) &&
              estimator.residual_variance() >= 0);
}

/// Outputs are finite, and the estimator takes its own snapshot without a change.
template <class Estimator>
void expect_sound(Estimator& estimator) {
  ASSERT_NO_FATAL_FAILURE(expect_finite(estimator));
  const auto saved = estimator.save();
  ASSERT_EQ(estimator.check(saved.data(), saved.size()), SnapshotFault::none);
  ASSERT_EQ(estimator.restore(saved), Status::ok);
  ASSERT_EQ(estimator.save(), saved);
}

/// Seeds the estimator with numbers of any size; most are refused.
template <class Estimator>
void seed(Numbers<typename Estimator::Scalar>& numbers, Estimator& estimator) {
  using Scalar = typename Estimator::Scalar;
  typename Estimator::Parameters theta = estimator.theta_hat();
  ehsid::UdFactors<Scalar, Estimator::kN> factors = estimator.recursion().state().factors;
  theta[0] = numbers.real();
  factors.d[1] = numbers.positive();
  factors.u[0] = numbers.real();
  static_cast<void>(estimator.seed(theta, factors, numbers.positive()));
}

/// One estimator with settings of any size and samples whose size changes now and then. Returns whether it was configured.
template <class Estimator>
bool run(unsigned random_seed) {
  using Scalar = typename Estimator::Scalar;
  Numbers<Scalar> numbers(random_seed);
  typename Estimator::Options options;
  change(numbers, options);
  Estimator estimator;
  const bool configured = estimator.configure(options) == Status::ok;
  Scalar command_size(1);
  Scalar position_size(1);
  for (int k = 0; k < kSamples; ++k) {
    if (numbers.one_of(60)) {
      seed(numbers, estimator);
    }
    if (numbers.one_of(30)) {
      command_size = numbers.positive();
      position_size = numbers.one_of(2) ? command_size : numbers.positive();
    }
    static_cast<void>(
        estimator.step(numbers.ordinary() * command_size, numbers.ordinary() * position_size));
    if (k + 1 == kSamples || numbers.one_of(10)) {
      expect_sound(estimator);
    } else {
      expect_finite(estimator);
    }
    if (testing::Test::HasFatalFailure()) {
      ADD_FAILURE() << "seed " << random_seed << ", sample " << k;
      return configured;
    }
  }
  return configured;
}

/// A precision and a policy: what each test is made for.
template <class Number, std::size_t kPlace>
struct Kind {
  using Scalar = Number;
  using Servo = ehsid::ArxEstimator<Scalar, 2, 2, 1, ehsid::PolicyAt<kPlace, Scalar>>;
};

template <class Kind>
struct Extremes : testing::Test {};

template <std::size_t... kPlaces>
testing::Types<Kind<float, kPlaces>..., Kind<double, kPlaces>...> every_kind(
    std::index_sequence<kPlaces...>);
using Kinds = decltype(every_kind(std::make_index_sequence<ehsid::kPolicies>{}));
TYPED_TEST_SUITE(Extremes, Kinds, );

TYPED_TEST(Extremes, GiveFiniteOutputsAndSnapshotsThatAreTakenOver) {
  int configured = 0;
  for (unsigned i = 0; i < kRuns && !this->HasFatalFailure(); ++i) {
    configured += run<typename TypeParam::Servo>(i) ? 1 : 0;
  }
  EXPECT_GT(configured, 0);
}

}  // namespace
