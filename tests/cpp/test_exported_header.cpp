// SPDX-License-Identifier: MIT
// The headers of tests/export configure an estimator that makes the bits Python made, over the whole record
// and in their own self-tests. What the rows hold stands in make_headers.py beside them.
#include "../export/cases.h"
#include "../export/servo_estimator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace {

using Words = std::vector<std::uint32_t>;

struct Sample {
  float command;
  float position;
};

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream text(line);
  for (std::string field; std::getline(text, field, ',');) {
    fields.push_back(field);
  }
  return fields;
}

std::vector<Sample> record() {
  std::vector<Sample> samples;
  std::ifstream file(EHSID_EXPORT_RECORD);
  std::string line;
  std::getline(file, line);  // names
  while (std::getline(file, line)) {
    const auto fields = fields_of(line);
    // Through double, as Python reads it: rounded twice, now and then another float.
    samples.push_back(
        {static_cast<float>(std::stod(fields.at(1))), static_cast<float>(std::stod(fields.at(2)))});
  }
  return samples;
}

/// Status, innovation and theta as words, by sample.
std::map<std::size_t, Words> trajectory_of(const std::string& name) {
  std::map<std::size_t, Words> rows;
  std::ifstream file(EHSID_EXPORT_TRAJECTORIES);
  for (std::string line; std::getline(file, line);) {
    const auto fields = fields_of(line);
    if (fields.at(0) == name) {
      Words& row = rows[std::stoul(fields.at(1))];
      for (std::size_t i = 2; i < fields.size(); ++i) {
        row.push_back(static_cast<std::uint32_t>(std::stoul(fields[i], nullptr, 16)));
      }
    }
  }
  return rows;
}

std::uint32_t bits(float number) {
  std::uint32_t word = 0;
  std::memcpy(&word, &number, sizeof word);
  return word;
}

template <class Estimator>
void expect_trajectory(const std::string& name, ehsid::Status (*configure)(Estimator&)) {
  Estimator estimator;
  ASSERT_EQ(configure(estimator), ehsid::Status::ok);
  const auto rows = trajectory_of(name);
  const auto samples = record();
  ASSERT_EQ(rows.size(), 64U) << EHSID_EXPORT_TRAJECTORIES;
  ASSERT_EQ(samples.size(), 1024U) << EHSID_EXPORT_RECORD;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const ehsid::Status status = estimator.step(samples[k].command, samples[k].position);
    const auto row = rows.find(k);
    if (row == rows.end()) {
      continue;
    }
    Words made = {static_cast<std::uint32_t>(status), bits(estimator.innovation())};
    const auto theta = estimator.theta_hat();
    for (int i = 0; i < Estimator::kN; ++i) {
      made.push_back(bits(theta[i]));
    }
    ASSERT_EQ(made, row->second) << name << ", sample " << k;
  }
}

#define EXPECT_TRAJECTORY(name) expect_trajectory(#name, name::configure);
TEST(ExportedHeader, MakesTheBitsOfPython){EXPORTED_CASES(EXPECT_TRAJECTORY)}
#define EXPECT_SELF_TEST(name) EXPECT_TRUE(name::self_test());
TEST(ExportedHeader, SelfTestsPass){EXPORTED_CASES(EXPECT_SELF_TEST)}

TEST(ExportedHeader, ConfiguresAServoEstimatorAndItsSelfTestPasses) {
  servo_estimator::Estimator estimator;
  EXPECT_TRUE(servo_estimator::self_test(estimator));
  EXPECT_EQ(estimator.options().dt_s, 0.002F);
  EXPECT_EQ(estimator.options().delay, 6);
  EXPECT_EQ(estimator.options().drift, 0.03F);
  EXPECT_EQ(estimator.options().tolerance, 0.15F);
}

TEST(ExportedHeader, SelfTestTellsOneBit) {
  const float one = 1.0F;
  float next = 0.0F;
  const std::uint32_t word = bits(one) + 1;
  std::memcpy(&next, &word, sizeof next);
  EXPECT_TRUE(exponential::same_bits(one, one));
  EXPECT_FALSE(exponential::same_bits(one, next));
  EXPECT_FALSE(exponential::same_bits(0.0F, -0.0F));
}

TEST(ExportedHeader, StartsFromTheModel) {
  exponential::Estimator estimator;
  ASSERT_EQ(exponential::configure(estimator), ehsid::Status::ok);
  const auto theta = estimator.theta_hat();
  const auto& factors = estimator.recursion().state().factors;
  for (int i = 0; i < exponential::Estimator::kN; ++i) {
    const float asked = ehsid::entry(exponential::kTheta0, i);
    // Scaled and back: two roundings.
    EXPECT_NEAR(theta[i], asked, 2e-7F * std::abs(asked));
  }
  EXPECT_EQ(factors.d, exponential::kFactors0.d);
  EXPECT_EQ(factors.u, exponential::kFactors0.u);
}

}  // namespace
