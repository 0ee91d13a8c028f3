// SPDX-License-Identifier: MIT
// The contract that every policy keeps; what each of them promises beyond it is in test_forgetting.py.
#include <ehsid/forgetting.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <set>

namespace {

constexpr int kN = 3;

template <class Policy>
class Forgetting : public testing::Test {
 protected:
  ehsid::Evidence<float> draw() {
    const float innovation = 3.0F * normal_(random_);
    const float information = std::abs(normal_(random_));
    return {innovation, information, random_() % 10 == 0 ? 0.0F : 1.0F};
  }

  std::mt19937 random_{11};
  std::normal_distribution<float> normal_;
};

using Policies =
    testing::Types<ehsid::Constant<float>, ehsid::Exponential<float>, ehsid::ErrorDriven<float>,
                   ehsid::FRatio<float>, ehsid::Directional<float>, ehsid::RandomWalk<float, kN>>;
TYPED_TEST_SUITE(Forgetting, Policies, );

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

TYPED_TEST(Forgetting, LossIsNotNegative) {
  ehsid::UdFactors<float, kN> factors;
  ASSERT_TRUE(factors.set_diagonal(ehsid::Vector<float, kN>::Constant(0.5F)));
  TypeParam policy;
  for (int k = 0; k < 300; ++k) {
    policy.accept(this->draw());
    ASSERT_GE(policy.loss(factors), 0.0F);
  }
}

TEST(ForgettingIds, AreDistinct) {
  const std::set<int> ids = {static_cast<int>(ehsid::Constant<float>::kId),
                             static_cast<int>(ehsid::Exponential<float>::kId),
                             static_cast<int>(ehsid::ErrorDriven<float>::kId),
                             static_cast<int>(ehsid::FRatio<float>::kId),
                             static_cast<int>(ehsid::Directional<float>::kId),
                             static_cast<int>(ehsid::RandomWalk<float, kN>::kId)};
  EXPECT_EQ(ids.size(), 6U);
}

}  // namespace
