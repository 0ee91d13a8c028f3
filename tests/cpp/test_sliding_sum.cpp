// SPDX-License-Identifier: MIT
#include <ehsid/sliding_sum.hpp>

#include <gtest/gtest.h>

#include <deque>
#include <limits>
#include <numeric>
#include <random>
#include <tuple>

namespace {

template <class Window>
class SlidingSum : public testing::Test {};
using Windows = testing::Types<ehsid::SlidingSum<float, 1>, ehsid::SlidingSum<float, 2>,
                               ehsid::SlidingSum<float, 10>, ehsid::SlidingSum<float, 100>>;
TYPED_TEST_SUITE(SlidingSum, Windows, );

TYPED_TEST(SlidingSum, IsTheSumOfTheLastValues) {
  constexpr std::size_t kWindow = std::tuple_size<decltype(TypeParam::slots)>::value;
  TypeParam sum;
  std::deque<int> window;
  std::mt19937 random(1);
  // Whole numbers: every order of addition gives the same float, so equality is exact.
  std::uniform_int_distribution<int> draw(0, 1000);
  for (int k = 0; k < 1000; ++k) {
    const int value = draw(random);
    window.push_back(value);
    if (window.size() > kWindow) {
      window.pop_front();
    }
    const auto expected = static_cast<float>(std::accumulate(window.begin(), window.end(), 0));
    ASSERT_EQ(sum.peek(static_cast<float>(value)), expected) << "at " << k;
    sum.push(static_cast<float>(value));
    ASSERT_TRUE(sum.usable());
  }
}

TYPED_TEST(SlidingSum, ASpikeIsGoneWhenItLeavesTheWindow) {
  constexpr std::size_t kWindow = std::tuple_size<decltype(TypeParam::slots)>::value;
  TypeParam sum;
  sum.push(1e20F);
  for (std::size_t k = 1; k < kWindow; ++k) {
    EXPECT_GE(sum.peek(1.0F), 1e20F);
    sum.push(1.0F);
  }
  EXPECT_EQ(sum.peek(1.0F), static_cast<float>(kWindow));
}

TYPED_TEST(SlidingSum, AMillionPushesDoNotDrift) {
  constexpr std::size_t kWindow = std::tuple_size<decltype(TypeParam::slots)>::value;
  TypeParam sum;
  for (int k = 0; k < 1000000; ++k) {
    sum.push(0.1F);
  }
  // At most kWindow additions of one rounding each.
  const float expected = 0.1F * static_cast<float>(kWindow);
  const float rounding = static_cast<float>(kWindow) * std::numeric_limits<float>::epsilon();
  EXPECT_NEAR(sum.peek(0.1F), expected, expected * rounding);
}

TYPED_TEST(SlidingSum, AWriteOutsideTheWindowIsNotUsable) {
  TypeParam sum;
  sum.next = std::tuple_size<decltype(TypeParam::slots)>::value;
  EXPECT_FALSE(sum.usable());
  sum.next = -1;
  EXPECT_FALSE(sum.usable());
}

}  // namespace
