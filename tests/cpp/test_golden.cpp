// SPDX-License-Identifier: MIT
// tests/golden/trace.csv sample by sample: the static estimator makes the bits that the Python
// package made, which reads its orders at run time. Settings are those of make_trace.py beside it.
#include <ehsid/arx_estimator.hpp>

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
constexpr std::size_t kColumns = 17;  // behind the policy: command, position, status, ...
using Row = std::array<std::uint32_t, kColumns>;

struct Trace {
  std::array<std::string, kColumns> names;
  std::vector<Row> rows;
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

Trace trace_of(const std::string& policy) {
  Trace trace;
  std::ifstream file(EHSID_GOLDEN_TRACE);
  std::string line;
  while (std::getline(file, line)) {
    std::istringstream fields(line);
    std::string field;
    std::getline(fields, field, ',');
    if (field == "policy") {
      for (std::string& name : trace.names) {
        std::getline(fields, name, ',');
      }
    } else if (field == policy) {
      Row row{};
      for (std::uint32_t& word : row) {
        std::getline(fields, field, ',');
        word = static_cast<std::uint32_t>(std::stoul(field, nullptr, 16));
      }
      trace.rows.push_back(row);
    }
  }
  return trace;
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
  options.theta0 << -1.5F, 0.5F, 0.0F, 0.02F, 0.0F, 0.0F;
  options.variance0 << 1e6F, 1e6F, 1e6F, 2.5e5F, 2.5e5F, 2.5e5F;
  Estimator estimator;
  ASSERT_EQ(estimator.configure(options), ehsid::Status::ok);

  const Trace trace = trace_of(policy);
  ASSERT_EQ(trace.rows.size(), static_cast<std::size_t>(kSamples)) << EHSID_GOLDEN_TRACE;
  int sample = 0;
  for (const Row& row : trace.rows) {
    const ehsid::Status status = estimator.step(number(row[0]), number(row[1]));
    ASSERT_EQ(static_cast<std::uint32_t>(status), row[2])
        << policy << ", sample " << sample << ": status";
    Row made = {row[0], row[1], row[2], bits(estimator.innovation()),
                bits(estimator.forgetting_factor())};
    const auto theta = estimator.theta_hat();
    const auto deviation = estimator.standard_deviation();
    for (int i = 0; i < Estimator::kN; ++i) {
      made[static_cast<std::size_t>(5 + i)] = bits(theta[i]);
      made[static_cast<std::size_t>(5 + Estimator::kN + i)] = bits(deviation[i]);
    }
    for (std::size_t i = 3; i < kColumns; ++i) {
      ASSERT_EQ(made[i], row[i]) << policy << ", sample " << sample << ": " << trace.names[i]
                                 << " is " << number(made[i]) << " instead of " << number(row[i]);
    }
    ++sample;
  }
}

template <class Policy>
struct Golden : testing::Test {};
using Policies = test::PolicyTypes<float, 6>;
TYPED_TEST_SUITE(Golden, Policies, );

TYPED_TEST(Golden, Trace) { expect_trace<TypeParam>(TypeParam::kInfo.type); }

}  // namespace
