// SPDX-License-Identifier: MIT
// Float32 results to the last bit: every compiler and the Python package must agree with one table,
// tests/golden/float32_bits.inc. Samples and layout are those of float32_bits.py beside it.
#include <cstdint>
#include <cstring>
#include <ehsid/arx_estimator.hpp>
#include <vector>

#include <gtest/gtest.h>

#include "policy_types.hpp"

namespace {

struct Sample {
  float command;
  float position;
};

std::vector<Sample> samples() {
  std::uint32_t word = 2463534242U;
  std::int32_t u[3] = {};
  std::int32_t y[3] = {};
  std::vector<Sample> all;
  for (int k = 0; k < 4000; ++k) {
    word ^= word << 13;  // Marsaglia's xorshift32
    word ^= word >> 17;
    word ^= word << 5;
    const std::int32_t gain = k >= 2500 ? 2 : 1;
    const std::int32_t model =
        2293 * y[0] - 1825 * y[1] + 556 * y[2] + gain * (394 * u[0] - 595 * u[1] + 302 * u[2]);
    // Rounded down, whatever the sign.
    const std::int32_t rounded = model >= 0 ? model / 1024 : -((1023 - model) / 1024);
    const std::int32_t next_y = rounded + static_cast<std::int32_t>((word >> 8) % 33U) - 16;
    const bool held = k >= 1500 && k < 2500;
    const std::int32_t random = (word & 1U) != 0U ? 1024 : -1024;
    for (int i = 2; i > 0; --i) {
      y[i] = y[i - 1];
      u[i] = u[i - 1];
    }
    y[0] = next_y;
    u[0] = held ? 512 : random;
    all.push_back({static_cast<float>(u[0]) / 1024.0F, static_cast<float>(y[0]) / 1024.0F});
  }
  return all;
}

/// 64-bit FNV-1a.
class Hash {
 public:
  void add(std::uint8_t byte) { value_ = (value_ ^ byte) * 0x100000001b3ULL; }
  void add(float number) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    for (int shift = 0; shift < 32; shift += 8) {
      add(static_cast<std::uint8_t>(bits >> shift & 0xffU));
    }
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325ULL;
};

template <class Forgetting>
std::uint64_t bits() {
  using Estimator = ehsid::ArxEstimator<float, 3, 2, 2, Forgetting, true>;
  typename Estimator::Options options;
  options.scaling.command_scale = 0.75F;
  options.scaling.position_scale = 3.0F;
  options.scaling.position_offset = 0.5F;
  Estimator estimator;
  EXPECT_EQ(estimator.configure(options), ehsid::Status::ok);
  Hash hash;
  for (const Sample& sample : samples()) {
    const ehsid::Status status = estimator.step(sample.command, sample.position);
    const auto theta = estimator.theta_hat();
    const auto deviation = estimator.standard_deviation();
    for (int i = 0; i < Estimator::kN; ++i) {
      hash.add(theta[i]);
    }
    for (int i = 0; i < Estimator::kN; ++i) {
      hash.add(deviation[i]);
    }
    hash.add(static_cast<std::uint8_t>(status));
  }
  return hash.value();
}

struct Expected {
  const char* policy;
  std::uint64_t bits;
};
#define EXPECTED_BITS(policy, expected) {#policy, expected##ULL},
constexpr Expected kExpected[] = {
#include "../golden/float32_bits.inc"
};

template <class Policy>
struct Float32Bits : testing::Test {};
using Policies = test::PolicyTypes<float>;
TYPED_TEST_SUITE(Float32Bits, Policies, );

TYPED_TEST(Float32Bits, AreThoseOfPython) {
  int compared = 0;
  for (const Expected& expected : kExpected) {
    if (std::strcmp(expected.policy, TypeParam::kInfo.type) == 0) {
      EXPECT_EQ(bits<TypeParam>(), expected.bits);
      ++compared;
    }
  }
  EXPECT_EQ(compared, 1);
}

}  // namespace
