// SPDX-License-Identifier: MIT
// tests/golden/trace.csv sample by sample: the static estimator makes the bits that the Python package
// made, which reads its orders at run time. Settings are those of make_trace.py beside the trace.
#include <ehsid/servo_estimator.hpp>

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace {

constexpr int kSamples = 260;
constexpr std::size_t kColumns = 17;  // behind the policy: command, position, status, ...
using Row = std::array<std::uint32_t, kColumns>;

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

std::vector<Row> rows_of(const std::string& policy) {
  std::vector<Row> rows;
  std::ifstream file(EHSID_GOLDEN_TRACE);
  std::string line;
  while (std::getline(file, line)) {
    std::istringstream fields(line);
    std::string field;
    std::getline(fields, field, ',');
    if (field != policy) {
      continue;
    }
    Row row{};
    for (std::uint32_t& word : row) {
      std::getline(fields, field, ',');
      word = static_cast<std::uint32_t>(std::stoul(field, nullptr, 16));
    }
    rows.push_back(row);
  }
  return rows;
}

template <class Forgetting>
void expect_trace(const std::string& policy) {
  using Estimator = ehsid::ServoEstimator<float, 3, 3, 1, Forgetting>;
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

  const std::vector<Row> rows = rows_of(policy);
  ASSERT_EQ(rows.size(), static_cast<std::size_t>(kSamples)) << EHSID_GOLDEN_TRACE;
  int sample = 0;
  for (const Row& row : rows) {
    const ehsid::Status status = estimator.step(number(row[0]), number(row[1]));
    Row made = {row[0], row[1], static_cast<std::uint32_t>(status), bits(estimator.innovation()),
                bits(estimator.forgetting_factor())};
    const auto theta = estimator.theta_hat();
    const auto deviation = estimator.standard_deviation();
    for (int i = 0; i < Estimator::kN; ++i) {
      made[static_cast<std::size_t>(5 + i)] = bits(theta[i]);
      made[static_cast<std::size_t>(5 + Estimator::kN + i)] = bits(deviation[i]);
    }
    ASSERT_EQ(made, row) << policy << ", sample " << sample;
    ++sample;
  }
}

TEST(Golden, Constant) { expect_trace<ehsid::Constant<float>>("Constant"); }
TEST(Golden, Exponential) { expect_trace<ehsid::Exponential<float>>("Exponential"); }
TEST(Golden, ErrorDriven) { expect_trace<ehsid::ErrorDriven<float>>("ErrorDriven"); }
TEST(Golden, FRatio) { expect_trace<ehsid::FRatio<float>>("FRatio"); }
TEST(Golden, Directional) { expect_trace<ehsid::Directional<float>>("Directional"); }
TEST(Golden, RandomWalk) { expect_trace<ehsid::RandomWalk<float, 6>>("RandomWalk"); }

}  // namespace
