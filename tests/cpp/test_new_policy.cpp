// SPDX-License-Identifier: MIT
// A forgetting policy of a user, which is in no list: its own description is all that checks, C interface and estimator
// need to know of it.
#include "../../cpp/src/c_kernel.hpp"

#include <array>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

namespace {

/// A constant forgetting factor above a floor.
template <class Scalar>
struct FlooredConstant {
  static constexpr std::uint32_t kId = 99;
  static constexpr bool kFollowsErrors = false;
  static constexpr ehsid::PolicyInfo kInfo{"floored_constant", "FlooredConstant",
                                           "constant forgetting factor above a floor", "this test"};

  Scalar lambda = Scalar(0.99);
  Scalar lambda_min = Scalar(0.9);

  template <class Visit>
  static constexpr void settings(Visit visit) {
    visit(ehsid::SettingInfo{"lambda", ehsid::Range::factor(), "1", "forgetting factor", 0},
          [](auto& owner) -> auto& { return owner.lambda; });
    visit(ehsid::SettingInfo{"lambda_min", ehsid::Range::factor(), "1", "its least value", 1},
          [](auto& owner) -> auto& { return owner.lambda_min; });
  }

  bool valid() const { return ehsid::settings_valid(*this); }
  Scalar loss() const { return Scalar(1) - factor(); }
  void restart() {}
  ehsid::ForgettingFactors<Scalar> peek(const ehsid::Evidence<Scalar>& /*evidence*/) const {
    return {factor(), Scalar(1)};
  }
  void accept(const ehsid::Evidence<Scalar>& /*evidence*/) {}

 private:
  Scalar factor() const { return lambda > lambda_min ? lambda : lambda_min; }
};

constexpr ehsid_kernel kKernel = ehsid::c::kernel<FlooredConstant<float>, 2>();

ehsid_configuration configuration() {
  ehsid_configuration made;
  EXPECT_EQ(ehsid_default_configuration(&made, &kKernel, 1, 1, 1, false), EHSID_OK);
  return made;
}

TEST(NewPolicy, TheCInterfaceKnowsItsDefaultsAndRanges) {
  ehsid_configuration made = configuration();
  EXPECT_EQ(made.forgetting.lambda, 0.99F);
  EXPECT_EQ(made.forgetting.lambda_min, 0.9F);
  std::array<std::uint64_t, EHSID_STORAGE_WORDS(2)> storage;
  ehsid_estimator* estimator = nullptr;
  for (const float wrong : {0.0F, 1.5F, std::numeric_limits<float>::quiet_NaN()}) {
    made.forgetting.lambda_min = wrong;
    EXPECT_EQ(ehsid_init(&estimator, storage.data(), sizeof storage, &made),
              EHSID_INVALID_ARGUMENT);
  }
}

TEST(NewPolicy, TheCInterfaceMakesTheBitsOfTheEstimator) {
  ehsid_configuration made = configuration();
  made.forgetting.lambda = 0.5F;
  made.forgetting.lambda_min = 0.97F;
  std::array<std::uint64_t, EHSID_STORAGE_WORDS(2)> storage;
  ehsid_estimator* c = nullptr;
  ASSERT_EQ(ehsid_init(&c, storage.data(), sizeof storage, &made), EHSID_OK);

  using Estimator = ehsid::ArxEstimator<float, 1, 1, 1, FlooredConstant<float>>;
  Estimator estimator;
  typename Estimator::Options options;
  options.forgetting = {0.5F, 0.97F};
  ASSERT_EQ(estimator.configure(options), ehsid::Status::ok);

  float position = 0.0F;
  for (int k = 0; k < 100; ++k) {
    const float command = k % 7 < 3 ? 1.0F : -0.5F;
    EXPECT_EQ(static_cast<int>(ehsid_step(c, command, position)),
              static_cast<int>(estimator.step(command, position)));
    position = 0.9F * position + 0.2F * command + (k % 5 == 0 ? 0.01F : 0.0F);
  }
  std::array<float, 2> theta{};
  ASSERT_EQ(ehsid_theta(c, theta.data(), theta.size()), EHSID_OK);
  EXPECT_EQ(theta[0], estimator.theta_hat()[0]);
  EXPECT_EQ(theta[1], estimator.theta_hat()[1]);
  ehsid_report report;
  ASSERT_EQ(ehsid_read(c, &report), EHSID_OK);
  EXPECT_EQ(report.forgetting_factor, 0.97F);
}

}  // namespace
