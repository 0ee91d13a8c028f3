// SPDX-License-Identifier: MIT
// A forgetting policy of a user, which is in no list: its own text is all that checks, C interface, estimator and bank
// need to know of it.
#include "../../cpp/src/c_kernel.hpp"

#include <ehsid/bank/rls_bank.hpp>

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace ehsid::user {

/// A constant forgetting factor above a floor.
template <class T>
struct FlooredConstant {
  using Scalar = ScalarOf<T>;
  template <class Lanes>
  using Over = FlooredConstant<Lanes>;
  static constexpr std::uint32_t kId = 99;
  static constexpr bool kFollowsErrors = false;
  static constexpr PolicyInfo kInfo{"floored_constant", "FlooredConstant",
                                    "constant forgetting factor above a floor", "this test"};

  T lambda = T(Scalar(0.99));
  T lambda_min = T(Scalar(0.9));

  template <class Visit>
  static constexpr void settings(Visit visit) {
    visit(SettingInfo{"lambda", Range::factor(), "1", "forgetting factor", 0},
          [](auto& owner) -> auto& { return owner.lambda; });
    visit(SettingInfo{"lambda_min", Range::factor(), "1", "its least value", 1},
          [](auto& owner) -> auto& { return owner.lambda_min; });
  }

  bool valid() const { return settings_valid(*this); }
  EHSID_ALWAYS_INLINE T loss() const { return T(1) - larger(lambda, lambda_min); }
  EHSID_ALWAYS_INLINE void restart(const TruthOf<T>& /*where*/ = TruthOf<T>(true)) {}
  EHSID_ALWAYS_INLINE ForgettingFactors<T> peek(const Evidence<T>& /*evidence*/) const {
    return {larger(lambda, lambda_min), T(1)};
  }
  EHSID_ALWAYS_INLINE void accept(const Evidence<T>& /*evidence*/,
                                  const TruthOf<T>& /*where*/ = TruthOf<T>(true)) {}
};

/// As above, with a state: once `patience` samples have been taken, nothing is forgotten any more.
template <class T>
struct Tiring {
  using Scalar = ScalarOf<T>;
  using Count = CountOf<T>;
  template <class Lanes>
  using Over = Tiring<Lanes>;
  static constexpr std::uint32_t kId = 98;
  static constexpr bool kFollowsErrors = false;
  static constexpr PolicyInfo kInfo{"tiring", "Tiring", "forgets for some samples", "this test"};

  T lambda = T(Scalar(0.9));
  T patience = T(20);
  Count taken = Count(0);

  template <class Visit>
  static constexpr void fields(Visit visit) {
    visit(&Tiring::taken);
  }
  template <class Visit>
  static constexpr void settings(Visit visit) {
    visit(SettingInfo{"lambda", Range::factor(), "1", "forgetting factor", 0},
          [](auto& owner) -> auto& { return owner.lambda; });
    visit(SettingInfo{"patience", Range::at_least(1.0), "samples", "how long", 1},
          [](auto& owner) -> auto& { return owner.patience; });
  }

  bool valid() const { return settings_valid(*this); }
  EHSID_ALWAYS_INLINE T loss() const { return T(1) - factor(); }
  EHSID_ALWAYS_INLINE void restart(const TruthOf<T>& where = TruthOf<T>(true)) {
    taken = select(where, Count(0), taken);
  }
  EHSID_ALWAYS_INLINE ForgettingFactors<T> peek(const Evidence<T>& /*evidence*/) const {
    return {factor(), T(1)};
  }
  EHSID_ALWAYS_INLINE void accept(const Evidence<T>& /*evidence*/,
                                  const TruthOf<T>& where = TruthOf<T>(true)) {
    taken = select(where, taken + Count(1), taken);
  }

 private:
  EHSID_ALWAYS_INLINE T factor() const {
    return select(static_cast<T>(taken) < patience, lambda, T(1));
  }
};

}  // namespace ehsid::user

namespace {

using ehsid::user::FlooredConstant;
using ehsid::user::Tiring;

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

template <class Forgetting>
void bank_has_the_bits_of_single_ones(std::vector<Forgetting> policies) {
  using One = ehsid::Rls<float, 2, Forgetting>;
  std::vector<One> alone(policies.size());
  ehsid::RlsBank<float, 2, Forgetting> bank(alone.size());
  for (std::size_t i = 0; i < alone.size(); ++i) {
    ASSERT_EQ(alone[i].configure(policies[i], {}), ehsid::Status::ok);
    bank.set(i, alone[i]);
  }
  std::vector<float> phi(2 * alone.size());
  std::vector<float> y(alone.size());
  std::vector<std::uint8_t> status(alone.size());
  for (int k = 0; k < 60; ++k) {
    for (std::size_t i = 0; i < alone.size(); ++i) {
      phi[i] = k % 7 < 3 ? 1.0F : -0.5F;
      phi[alone.size() + i] = 0.1F * static_cast<float>((k + static_cast<int>(i)) % 5) - 0.2F;
      // Now and then a sample that one lane must refuse, so that the lanes get out of step.
      const bool refused = k % 11 == static_cast<int>(i);
      y[i] = refused ? std::numeric_limits<float>::quiet_NaN()
                     : 0.3F * phi[i] - 0.7F * phi[alone.size() + i] + (k % 3 == 0 ? 0.01F : 0.0F);
    }
    bank.update(phi.data(), y.data(), status.data());
    for (std::size_t i = 0; i < alone.size(); ++i) {
      const auto own = alone[i].update({phi[i], phi[alone.size() + i]}, y[i]);
      ASSERT_EQ(static_cast<ehsid::Status>(status[i]), own) << i << " at " << k;
      One copy = alone[i];
      copy.reset_all();
      bank.get(i, copy);
      ASSERT_EQ(copy.theta_hat(), alone[i].theta_hat()) << i << " at " << k;
      ASSERT_EQ(copy.forgetting_factor(), alone[i].forgetting_factor()) << i << " at " << k;
    }
  }
}

TEST(NewPolicy, ABankTakesItAsItIs) {
  bank_has_the_bits_of_single_ones<FlooredConstant<float>>(
      {{}, {0.5F, 0.97F}, {0.95F, 0.9F}, {1.0F, 0.5F}, {0.9F, 0.9F}});
}

TEST(NewPolicy, ABankTakesOneWithAStateOfItsOwn) {
  bank_has_the_bits_of_single_ones<Tiring<float>>(
      {{}, {0.8F, 10.0F, 0}, {0.99F, 40.0F, 5}, {0.95F, 1.0F, 0}, {0.9F, 30.0F, 29}});
}

}  // namespace
