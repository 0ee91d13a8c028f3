// SPDX-License-Identifier: MIT
// The contract that every policy keeps; what each of them promises beyond it is in test_forgetting.py.
#include <cctype>
#include <cmath>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "policy_types.hpp"

namespace {

template <class Policy>
class Forgetting : public testing::Test {
 protected:
  ehsid::Evidence<float> draw() {
    const float innovation = 3.0F * normal_(random_);
    const float information = std::abs(normal_(random_));
    return {innovation, information};
  }

  std::mt19937 random_{11};
  std::normal_distribution<float> normal_;
};

using Types = test::PolicyTypes<float>;
TYPED_TEST_SUITE(Forgetting, Types, );

template <class Policy>
bool same_bytes(const Policy& a, const Policy& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

TYPED_TEST(Forgetting, IsPlainDataWithAValidDefault) {
  EXPECT_TRUE(std::is_trivially_copyable<TypeParam>::value);
  EXPECT_TRUE(TypeParam{}.valid());
}

TYPED_TEST(Forgetting, FactorsAreInRangeWhateverTheErrors) {
  TypeParam policy;
  for (int k = 0; k < 5000; ++k) {
    auto evidence = this->draw();
    if (k % 100 == 0) {
      evidence.innovation = 1e18F;
    }
    const auto lambda = policy.peek(evidence);
    ASSERT_TRUE(ehsid::is_forgetting_factor(lambda.before)) << "at " << k;
    ASSERT_TRUE(ehsid::is_forgetting_factor(lambda.after)) << "at " << k;
    policy.accept(evidence);
    ASSERT_TRUE(policy.valid()) << "at " << k;
  }
}

TYPED_TEST(Forgetting, PeekChangesNothingAndTellsTheSameTwice) {
  TypeParam policy;
  for (int k = 0; k < 300; ++k) {
    const auto evidence = this->draw();
    const TypeParam before = policy;
    const auto first = policy.peek(evidence);
    const auto second = policy.peek(evidence);
    ASSERT_EQ(first.before, second.before);
    ASSERT_EQ(first.after, second.after);
    ASSERT_TRUE(same_bytes(policy, before));
    policy.accept(evidence);
  }
}

TYPED_TEST(Forgetting, RestartIsANewBeginning) {
  TypeParam used;
  TypeParam fresh;
  for (int k = 0; k < 257; ++k) {
    used.accept(this->draw());
  }
  used.restart();
  for (int k = 0; k < 300; ++k) {
    auto evidence = this->draw();
    if (k % 50 < 5) {
      evidence.innovation *= 20.0F;  // a change every policy answers
    }
    const auto again = used.peek(evidence);
    const auto first = fresh.peek(evidence);
    ASSERT_EQ(again.before, first.before) << "at " << k;
    ASSERT_EQ(again.after, first.after) << "at " << k;
    used.accept(evidence);
    fresh.accept(evidence);
  }
}

TYPED_TEST(Forgetting, LossIsAShare) {
  TypeParam policy;
  for (int k = 0; k < 300; ++k) {
    policy.accept(this->draw());
    ASSERT_GE(policy.loss(), 0.0F);
    ASSERT_LE(policy.loss(), 1.0F);
  }
}

/// Calls change(range, a number of a setting) on a new policy for each setting; is the policy then valid?
template <class Policy, class Change>
std::vector<bool> valid_after(Change change) {
  std::vector<bool> valid;
  std::size_t count = 0;
  Policy::settings([&](const ehsid::SettingInfo& /*setting*/, auto /*member*/) { ++count; });
  for (std::size_t changed = 0; changed < count; ++changed) {
    Policy policy;
    std::size_t at = 0;
    Policy::settings([&](const ehsid::SettingInfo& setting, auto member) {
      if (at++ == changed) {
        change(setting.range, member(policy));
      }
    });
    valid.push_back(policy.valid());
  }
  return valid;
}

TYPED_TEST(Forgetting, RangesOfTheSettingsAreThoseThatValidChecks) {
  const auto expect = [](bool expected, auto change) {
    const std::vector<bool> valid = valid_after<TypeParam>(change);
    EXPECT_EQ(valid, std::vector<bool>(valid.size(), expected));
    EXPECT_FALSE(valid.empty());
  };
  expect(false, [](const ehsid::Range& /*range*/, float& number) { number = std::nanf(""); });
  expect(false, [](const ehsid::Range& /*range*/, float& number) { number = INFINITY; });
  expect(false, [](const ehsid::Range& range, float& number) {
    number = static_cast<float>(range.minimum) - (range.open ? 0.0F : 1e-3F);
  });
  expect(true, [](const ehsid::Range& range, float& number) {
    number = static_cast<float>(range.minimum) + (range.open ? 1e-6F : 0.0F);
  });
  expect(true, [](const ehsid::Range& range, float& number) {
    number = range.bounded ? static_cast<float>(range.maximum) : 1e6F;
  });
  expect(false, [](const ehsid::Range& range, float& number) {
    number = range.bounded ? static_cast<float>(range.maximum) + 1e-3F : -1e6F;
  });
}

TYPED_TEST(Forgetting, IsNamedAlikeEverywhere) {
  std::string type;
  bool upper = true;
  for (const char letter : std::string(TypeParam::kInfo.id)) {
    if (letter != '_') {
      type += static_cast<char>(upper ? std::toupper(letter) : letter);
    }
    upper = letter == '_';
  }
  EXPECT_EQ(type, TypeParam::kInfo.type);
  constexpr std::size_t kPlace = ehsid::place_of_policy(TypeParam::kInfo.id);
  EXPECT_TRUE((std::is_same<ehsid::PolicyAt<kPlace, float>, TypeParam>::value));
}

TEST(ForgettingList, TellsNamesApart) {
  EXPECT_EQ(ehsid::place_of_policy("constant"), 0U);
  for (const char* id : {"", "constan", "constant_", "Constant"}) {
    EXPECT_EQ(ehsid::place_of_policy(id), ehsid::kPolicies) << id;
  }
}

}  // namespace
