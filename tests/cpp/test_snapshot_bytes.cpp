// SPDX-License-Identifier: MIT
// Snapshots of C++, where orders and size are static, of C, where the size is static, and of Python, where both are chosen
// at run time: the same bytes for every policy and n, and each takes over the others' (docs/linking.md).
#include "any_estimator.hpp"

#include <ehsid/c_api.h>
#include <ehsid/arx_estimator.hpp>

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace {

using ehsid::Status;
using ehsid::bindings::AnyEstimator;

/// A plant with a change and a hold.
class Signal {
 public:
  explicit Signal(int n) : random_(1U + static_cast<std::uint32_t>(n)) {}

  void next(float& command, float& position) {
    random_ = random_ * 1664525U + 1013904223U;  // Numerical Recipes' generator
    const bool held = k_ > 150 && k_ < 250;
    command = held ? 0.5F : (random_ >> 31U) != 0U ? 1.0F : -1.0F;
    position_ = 0.9F * position_ + (k_ < 300 ? 0.2F : 0.4F) * command;
    position = position_;
    ++k_;
  }

 private:
  std::uint32_t random_;
  float position_ = 0.0F;
  int k_ = 0;
};

constexpr int kSamples = 400;

/// What C++ saves after all samples. Takes over `other` and saves that again.
template <std::size_t kPlace, int kN>
std::string of_cpp(const std::string& other) {
  ehsid::ArxEstimator<float, kN / 2, kN / 2, 1, ehsid::PolicyAt<kPlace, float>, kN % 2 == 1>
      estimator;
  if (other.empty()) {
    Signal signal(kN);
    for (int k = 0; k < kSamples; ++k) {
      float command = 0.0F;
      float position = 0.0F;
      signal.next(command, position);
      static_cast<void>(estimator.step(command, position));
    }
  } else {
    EXPECT_EQ(estimator.restore(reinterpret_cast<const std::uint8_t*>(other.data()), other.size()),
              Status::ok);
  }
  const auto bytes = estimator.save();
  return {bytes.begin(), bytes.end()};
}

struct Policy {
  const char* name;
  std::array<const ehsid_kernel*, EHSID_MAX_PARAMETERS - 1> kernels;  // n = 2, 3, ..
  ehsid::bindings::ForgettingSettings settings;
  std::vector<std::pair<int, std::string (*)(const std::string&)>> cpp;  // for some n
};

#define EHSID_KERNELS(policy)                                                    \
  {EHSID_KERNEL(policy, 2),  EHSID_KERNEL(policy, 3),  EHSID_KERNEL(policy, 4),  \
   EHSID_KERNEL(policy, 5),  EHSID_KERNEL(policy, 6),  EHSID_KERNEL(policy, 7),  \
   EHSID_KERNEL(policy, 8),  EHSID_KERNEL(policy, 9),  EHSID_KERNEL(policy, 10), \
   EHSID_KERNEL(policy, 11), EHSID_KERNEL(policy, 12), EHSID_KERNEL(policy, 13)}

#define EHSID_POLICY_OF_TEST(policy)                                   \
  {#policy,                                                            \
   EHSID_KERNELS(policy),                                              \
   ehsid::bindings::PolicySettings<ehsid::place_of_policy(#policy)>{}, \
   {{2, of_cpp<ehsid::place_of_policy(#policy), 2>},                   \
    {6, of_cpp<ehsid::place_of_policy(#policy), 6>},                   \
    {13, of_cpp<ehsid::place_of_policy(#policy), 13>}}},

class SnapshotBytes : public testing::TestWithParam<Policy> {};

INSTANTIATE_TEST_SUITE_P(
    Policies, SnapshotBytes,
    testing::ValuesIn(std::vector<Policy>{EHSID_EACH_POLICY(EHSID_POLICY_OF_TEST)}),
    [](const testing::TestParamInfo<Policy>& made) { return std::string(made.param.name); });

std::string saved(const ehsid_estimator* estimator) {
  std::string bytes(EHSID_SNAPSHOT_BYTES(EHSID_MAX_PARAMETERS), '\0');
  std::size_t written = 0;
  EXPECT_EQ(ehsid_save(estimator, bytes.data(), bytes.size(), &written), EHSID_OK);
  bytes.resize(written);
  return bytes;
}

TEST_P(SnapshotBytes, AreThoseOfC) {
  for (int n = 2; n <= EHSID_MAX_PARAMETERS; ++n) {
    SCOPED_TRACE(n);
    ehsid::bindings::EstimatorSettings settings;
    settings.na = n / 2;
    settings.nb = n / 2;
    settings.offset = n % 2 == 1;
    settings.forgetting = GetParam().settings;
    settings.reset = ehsid::RmseResetOptions<double>{};
    const std::unique_ptr<AnyEstimator> python = ehsid::bindings::make_estimator<float>(settings);

    ehsid_configuration configuration;
    ASSERT_EQ(ehsid_default_configuration(&configuration,
                                          GetParam().kernels[static_cast<std::size_t>(n - 2)],
                                          settings.na, settings.nb, settings.nk, settings.offset),
              EHSID_OK);
    std::array<std::uint64_t, EHSID_STORAGE_WORDS(EHSID_MAX_PARAMETERS)> storage;
    ehsid_estimator* c = nullptr;
    ASSERT_EQ(ehsid_init(&c, storage.data(), sizeof storage, &configuration), EHSID_OK);
    ASSERT_EQ(saved(c), python->save());

    Signal signal(n);
    for (int k = 0; k < kSamples; ++k) {
      float command = 0.0F;
      float position = 0.0F;
      signal.next(command, position);
      const auto status = static_cast<int>(ehsid_step(c, command, position));
      const Status same = python->step(static_cast<double>(command), static_cast<double>(position));
      ASSERT_EQ(status, static_cast<int>(same)) << "sample " << k;
      ASSERT_EQ(saved(c), python->save()) << "sample " << k;
    }

    const std::unique_ptr<AnyEstimator> other = ehsid::bindings::make_estimator<float>(settings);
    EXPECT_EQ(other->restore(saved(c)), ehsid::SnapshotFault::none);
    EXPECT_EQ(other->save(), saved(c));
    const std::string bytes = python->save();
    ASSERT_EQ(ehsid_init(&c, storage.data(), sizeof storage, &configuration), EHSID_OK);
    EXPECT_EQ(ehsid_restore(c, bytes.data(), bytes.size()), EHSID_OK);
    EXPECT_EQ(saved(c), bytes);
    for (const auto& [size, cpp] : GetParam().cpp) {
      if (size == n) {
        EXPECT_EQ(cpp(""), bytes);
        EXPECT_EQ(cpp(bytes), bytes);
      }
    }
  }
}

}  // namespace
