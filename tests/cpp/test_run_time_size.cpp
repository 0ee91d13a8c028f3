// SPDX-License-Identifier: MIT
// A size that is chosen at run time, as Python uses it, and the static size of firmware: every number the same bits
// after every sample, for every policy and n = 1 .. 12, over excitation, a hold, samples that are refused and
// a reset.
#include <array>
#include <cstdint>

// Unrolled loops do the same in the same order; without, this compiles in two thirds of the time.
#define EHSID_UNROLL
#include <ehsid/forgetting.hpp>
#include <ehsid/rls.hpp>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace {

using ehsid::Status;

constexpr int kMost = 12;
constexpr int kSamples = 580;

/// Regressors of kMost numbers, of which the first n are used, and outputs.
template <class Scalar>
struct Sample {
  std::array<Scalar, kMost> phi;
  Scalar y;
};

template <class Scalar>
std::vector<Sample<Scalar>> record() {
  std::mt19937 random(20111);
  std::normal_distribution<double> normal;
  std::vector<Sample<Scalar>> samples(kSamples);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const bool held = k >= 100 && k < 500;
    double y = 0.05 * normal(random);
    for (std::size_t i = 0; i < kMost; ++i) {
      const auto fresh = static_cast<Scalar>(normal(random));
      samples[k].phi[i] = held ? samples[99].phi[i] : fresh;
      y += (k < 520 ? 1.0 : 1.5) * (i % 2 == 0 ? 0.3 : -0.7) *
           static_cast<double>(samples[k].phi[i]);
    }
    samples[k].y = static_cast<Scalar>(y);
  }
  samples[50].phi[0] = std::numeric_limits<Scalar>::quiet_NaN();
  samples[60].y = std::numeric_limits<Scalar>::infinity();
  samples[70].phi[0] = std::numeric_limits<Scalar>::max();
  return samples;
}

/// Appends the bits of `count` numbers.
template <class Scalar>
void append(std::vector<std::uint64_t>& bits, const Scalar* values, int count) {
  for (int i = 0; i < count; ++i) {
    bits.push_back(ehsid::bits_of(values[i]));
  }
}

/// The status, and the whole state of a recursion of n parameters but for that of the policy.
template <class Recursion>
std::vector<std::uint64_t> readings(const Recursion& recursion, Status status) {
  const auto& state = recursion.state();
  const int n = recursion.size();
  std::vector<std::uint64_t> bits{static_cast<std::uint64_t>(status)};
  append(bits, state.theta.data(), n);
  append(bits, state.remainder.data(), n);
  append(bits, state.factors.d.data(), n);
  append(bits, state.factors.u.data(), n * (n - 1) / 2);
  append(bits, state.gain.data(), n);
  append(bits, &state.innovation, 1);
  append(bits, &state.forgetting_factor, 1);
  append(bits, &state.square, 1);
  append(bits, &state.mean_square, 1);
  append(bits, &state.weight, 1);
  append(bits, &state.recent_square, 1);
  return bits;
}

using History = std::vector<std::vector<std::uint64_t>>;

template <class Recursion, class Scalar>
History history(int n, const std::vector<Sample<Scalar>>& samples) {
  Recursion recursion;
  typename Recursion::Parameters theta0(n);
  typename Recursion::Parameters variance0(n);
  for (int i = 0; i < n; ++i) {
    theta0[i] = Scalar(0.1) * Scalar(i);
    variance0[i] = Scalar(100 + i);
  }
  Status status = recursion.start(theta0, variance0);
  History all;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    all.push_back(readings(recursion, status));
    typename Recursion::Regressor phi(n);
    for (int i = 0; i < n; ++i) {
      phi[i] = samples[k].phi[static_cast<std::size_t>(i)];
    }
    if (k == 200) {
      recursion.reset();
    }
    status = recursion.update(phi, samples[k].y);
  }
  const auto deviation = recursion.standard_deviation();
  const auto covariance = recursion.P();
  all.push_back(readings(recursion, status));
  append(all.back(), deviation.data(), n);
  append(all.back(), covariance.data(), n * n);
  return all;
}

/// One policy, which still lacks precision and size.
template <std::size_t kPlace>
struct PolicyOf {
  template <class Scalar>
  using Type = ehsid::PolicyAt<kPlace, Scalar>;
};

void expect_same(const History& fixed, const History& chosen, int n) {
  ASSERT_EQ(fixed.size(), chosen.size());
  for (std::size_t k = 0; k < fixed.size(); ++k) {
    ASSERT_EQ(fixed[k], chosen[k]) << "n = " << n << ", after " << k << " samples";
  }
}

template <class Scalar, class Policy, int kN>
void compare() {
  constexpr int kUpTo = ehsid::up_to(kMost + 1);
  using Fixed = ehsid::Rls<Scalar, kN, typename Policy::template Type<Scalar>>;
  using Chosen = ehsid::Rls<Scalar, kUpTo, typename Policy::template Type<Scalar>>;
  const auto samples = record<Scalar>();
  expect_same(history<Fixed>(kN, samples), history<Chosen>(kN, samples), kN);
}

template <class Scalar, class Policy, int... kSteps>
void compare_sizes(std::integer_sequence<int, kSteps...> /*sizes*/) {
  (compare<Scalar, Policy, kSteps + 1>(), ...);
}

template <class Policy>
struct RunTimeSize : testing::Test {};
template <std::size_t... kPlaces>
testing::Types<PolicyOf<kPlaces>...> every_policy(std::index_sequence<kPlaces...>);
using Policies = decltype(every_policy(std::make_index_sequence<ehsid::kPolicies>{}));
TYPED_TEST_SUITE(RunTimeSize, Policies, );

// From n = 2 on test_snapshot_bytes.cpp compares whole estimators in float, those that C has compiled.
TYPED_TEST(RunTimeSize, SameBitsInFloatWithOneParameter) { compare<float, TypeParam, 1>(); }

TYPED_TEST(RunTimeSize, SameBitsInDouble) {
  compare_sizes<double, TypeParam>(std::make_integer_sequence<int, kMost>{});
}

TEST(RunTimeSize, RecordReachesEveryBranch) {
  using Recursion = ehsid::Rls<float, ehsid::up_to(6), ehsid::Constant<float>>;
  std::vector<bool> seen(16, false);
  for (const auto& bits : history<Recursion>(6, record<float>())) {
    seen[bits[0]] = true;
  }
  EXPECT_TRUE(seen[static_cast<std::size_t>(Status::ok)]);
  EXPECT_TRUE(seen[static_cast<std::size_t>(Status::no_information)]);
  EXPECT_TRUE(seen[static_cast<std::size_t>(Status::invalid_input)]);
  EXPECT_TRUE(seen[static_cast<std::size_t>(Status::numerical_limit)]);
}

TEST(RunTimeSize, RefusesWhatHasNoRoomOrAnotherSize) {
  using Recursion = ehsid::Rls<float, ehsid::up_to(4), ehsid::Constant<float>>;
  using Parameters = Recursion::Parameters;
  Recursion recursion;
  EXPECT_EQ(recursion.size(), 4);
  ASSERT_EQ(recursion.start(Parameters::Zero(3), Parameters::Ones(3)), Status::ok);
  EXPECT_EQ(recursion.size(), 3);
  const auto before = readings(recursion, Status::ok);
  EXPECT_EQ(recursion.start(Parameters::Zero(2), Parameters::Ones(3)), Status::invalid_argument);
  EXPECT_EQ(recursion.start(Parameters(), Parameters()), Status::invalid_argument);
  EXPECT_EQ(
      recursion.start_from_covariance(Parameters::Zero(2), Recursion::Covariance::Identity(3, 3)),
      Status::invalid_argument);
  ehsid::UdFactors<float, ehsid::up_to(4)> two{};
  ASSERT_TRUE(two.set_diagonal(Parameters::Ones(2)));
  EXPECT_EQ(recursion.seed(Parameters::Zero(3), two, 0.0F), Status::invalid_argument);
  EXPECT_EQ(recursion.size(), 3);
  EXPECT_EQ(readings(recursion, Status::ok), before);
}

}  // namespace
