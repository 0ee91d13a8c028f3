// SPDX-License-Identifier: MIT
// tests/golden/trace.csv sample by sample: the static estimator makes the bits that the Python
// package made, which reads its orders at run time. Settings are those of make_trace.py beside it.
// The same for ServoEstimator with servo_trace.csv.
#include <ehsid/arx_estimator.hpp>
#include <ehsid/servo_estimator.hpp>

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "policy_types.hpp"

namespace {

constexpr int kSamples = 660;
constexpr std::size_t kColumns = 17;       // behind the policy: command, position, status, ...
constexpr std::size_t kServoColumns = 13;  // behind the run
template <std::size_t kWidth>
using Row = std::array<std::uint32_t, kWidth>;

template <std::size_t kWidth>
struct Trace {
  std::array<std::string, kWidth> names;
  std::vector<Row<kWidth>> rows;
};

std::uint32_t bits(float number) {
  std::uint32_t word = 0;
  std::memcpy(&word, &number, sizeof word);
  return word;
}

float number(std::uint32_t word) {
  float value = 0.0F;
  std::memcpy(&value, &word, sizeof value);
  return value;
}

/// The rows of the file whose first column is `of`.
template <std::size_t kWidth>
Trace<kWidth> trace_of(const std::string& path, const std::string& of) {
  Trace<kWidth> trace;
  std::ifstream file(path);
  std::string line;
  for (bool first = true; std::getline(file, line); first = false) {
    std::istringstream fields(line);
    std::string field;
    std::getline(fields, field, ',');
    if (first) {
      for (std::string& name : trace.names) {
        std::getline(fields, name, ',');
      }
    } else if (field == of) {
      Row<kWidth> row{};
      for (std::uint32_t& word : row) {
        std::getline(fields, field, ',');
        word = static_cast<std::uint32_t>(std::stoul(field, nullptr, 16));
      }
      trace.rows.push_back(row);
    }
  }
  return trace;
}

template <std::size_t kWidth>
void expect_row(const Row<kWidth>& made, const Row<kWidth>& row, const Trace<kWidth>& trace,
                const std::string& of, int sample) {
  for (std::size_t i = 2; i < kWidth; ++i) {
    ASSERT_EQ(made[i], row[i]) << of << ", sample " << sample << ": " << trace.names[i] << " is "
                               << number(made[i]) << " instead of " << number(row[i]);
  }
}

template <class Forgetting>
void expect_trace(const std::string& policy) {
  using Estimator = ehsid::ArxEstimator<float, 3, 3, 1, Forgetting>;
  typename Estimator::Options options;
  options.scaling = {5.0F, 0.3F, 0.25F, -0.02F};
  options.reset.short_window = 5.0F;
  options.reset.long_window = 60.0F;
  options.reset.trigger_ratio = 8.0F;
  options.reset.cool_down = 20;
  using Parameters = typename Estimator::Parameters;
  options.theta0 = Parameters{-1.5F, 0.5F, 0.0F, 0.02F, 0.0F, 0.0F};
  options.variance0 = Parameters{1e6F, 1e6F, 1e6F, 2.5e5F, 2.5e5F, 2.5e5F};
  Estimator estimator;
  ASSERT_EQ(estimator.configure(options), ehsid::Status::ok);

  const auto trace = trace_of<kColumns>(EHSID_GOLDEN_TRACE, policy);
  ASSERT_EQ(trace.rows.size(), static_cast<std::size_t>(kSamples)) << EHSID_GOLDEN_TRACE;
  int sample = 0;
  for (const Row<kColumns>& row : trace.rows) {
    const ehsid::Status status = estimator.step(number(row[0]), number(row[1]));
    Row<kColumns> made = {row[0], row[1], static_cast<std::uint32_t>(status),
                          bits(estimator.innovation()), bits(estimator.forgetting_factor())};
    const auto theta = estimator.theta_hat();
    const auto deviation = estimator.standard_deviation();
    for (int i = 0; i < Estimator::kN; ++i) {
      made[static_cast<std::size_t>(5 + i)] = bits(theta[i]);
      made[static_cast<std::size_t>(5 + Estimator::kN + i)] = bits(deviation[i]);
    }
    ASSERT_NO_FATAL_FAILURE(expect_row(made, row, trace, policy, sample));
    ++sample;
  }
}

/// Every 50 samples another estimator goes on from the saved state.
void expect_servo_trace(const std::string& run, std::size_t samples,
                        const ehsid::ServoEstimatorOptions<float>& options) {
  using Estimator = ehsid::ServoEstimator<float>;
  std::array<Estimator, 2> estimators;
  ASSERT_EQ(estimators[0].configure(options), ehsid::Status::ok);
  const auto trace = trace_of<kServoColumns>(EHSID_GOLDEN_SERVO_TRACE, run);
  ASSERT_EQ(trace.rows.size(), samples) << EHSID_GOLDEN_SERVO_TRACE;
  int sample = 0;
  std::vector<std::uint8_t> state(estimators[0].snapshot_bytes());
  for (const Row<kServoColumns>& row : trace.rows) {
    const auto now = static_cast<std::size_t>(sample / 50 % 2);
    Estimator& estimator = estimators[now];
    if (sample % 50 == 0 && sample > 0) {
      ASSERT_EQ(estimator.configure(options), ehsid::Status::ok);
      ASSERT_EQ(estimator.restore(state.data(), state.size()), ehsid::Status::ok);
    }
    const ehsid::Status status = estimator.step(number(row[0]), number(row[1]));
    Row<kServoColumns> made = {row[0], row[1], static_cast<std::uint32_t>(status)};
    const auto told = estimator.servo();
    std::size_t at = 3;
    for (const auto& value : {told.gain, told.omega_n, told.xi}) {
      made[at++] = bits(value.value);
      made[at++] = bits(value.half_width);
      made[at++] = static_cast<std::uint32_t>(value.reason);
    }
    estimator.save(state.data());
    for (std::size_t i = 0; i < 4; ++i) {
      made[at] |= std::uint32_t{state[state.size() - 4 + i]} << 8U * i;
    }
    ASSERT_NO_FATAL_FAILURE(expect_row(made, row, trace, run, sample));
    ++sample;
  }
}

TEST(GoldenServo, Steps) { expect_servo_trace("steps", 1100, {0.01F}); }
TEST(GoldenServo, Sine) { expect_servo_trace("sine", 600, {0.01F, 3, 0.05F, 0.25F}); }

template <class Policy>
struct Golden : testing::Test {};
using Policies = test::PolicyTypes<float>;
TYPED_TEST_SUITE(Golden, Policies, );

TYPED_TEST(Golden, Trace) { expect_trace<TypeParam>(TypeParam::kInfo.type); }

}  // namespace
