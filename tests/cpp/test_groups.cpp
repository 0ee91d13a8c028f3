// SPDX-License-Identifier: MIT
// Loops in groups visit every number once and in order, and give the bits of a plain loop, whether the count fills groups
// or not and whether the compiler knows it or not.
#include <ehsid/groups.hpp>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <type_traits>
#include <utility>
#include <vector>

namespace {

using ehsid::Count;
using ehsid::kGroup;

// Two full groups of floats, four of doubles, and every rest.
constexpr int kMost = 9;

/// check(n, Count<n>) for every count from 0 to kMost.
template <class Check, int... kN>
void each_count(std::integer_sequence<int, kN...> /*counts*/, const Check& check) {
  (check(kN, Count<kN>{}), ...);
}
template <class Check>
void each_count(const Check& check) {
  each_count(std::make_integer_sequence<int, kMost + 1>{}, check);
}

std::vector<int> ascending(int n) {
  std::vector<int> all(static_cast<std::size_t>(n));
  std::iota(all.begin(), all.end(), 0);
  return all;
}

template <class Scalar>
using Numbers = std::array<Scalar, kMost + 1>;

/// Signed, with a fraction that has no end in binary, from the least normal number to a large one.
template <class Scalar>
Numbers<Scalar> numbers(int seed) {
  Numbers<Scalar> all{};
  for (int i = 0; i <= kMost; ++i) {
    const auto value = static_cast<Scalar>((i + seed) % 7 - 3) / static_cast<Scalar>(3 + i);
    all[static_cast<std::size_t>(i)] = (i + seed) % 5 == 0 ? value * Scalar(1e18) : value;
  }
  all[1] = std::numeric_limits<Scalar>::min();
  all[6] = Scalar(-0.0);
  return all;
}

template <class Scalar>
void expect_same_bits(const Numbers<Scalar>& found, const Numbers<Scalar>& wanted) {
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(ehsid::bits_of(found[i]), ehsid::bits_of(wanted[i])) << "number " << i;
  }
}

template <class Scalar>
struct Groups : testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Groups, Scalars, );

TEST(Loops, UpwardsVisitsEveryIndexInOrder) {
  each_count([](int n, auto count) {
    std::vector<int> at_run_time;
    std::vector<int> known;
    ehsid::upwards(n, [&](int i) { at_run_time.push_back(i); });
    ehsid::upwards(count, [&](auto i) { known.push_back(i); });
    EXPECT_EQ(at_run_time, ascending(n));
    EXPECT_EQ(known, ascending(n));
  });
}

TEST(Loops, ACountIsKnownWhereLoopsAreUnrolled) {
  const auto n = ehsid::count_of<6>(6);
  EXPECT_EQ(static_cast<int>(n), 6);
  EXPECT_EQ((std::is_same_v<decltype(n), const Count<6>>), ehsid::kUnrolled<6>);
  EXPECT_FALSE(ehsid::kUnrolled<17>);
  EXPECT_EQ(ehsid::count_of<17>(3), 3);
}

TYPED_TEST(Groups, VisitEveryIndexInOrderFullGroupsFirst) {
  each_count([](int n, auto count) {
    const auto indices = [](auto number) {
      std::vector<int> seen;
      int alone = 0;
      ehsid::in_groups<TypeParam>(number, [&](auto group) {
        constexpr bool kOne = std::is_same_v<typename decltype(group)::Values, TypeParam>;
        constexpr int kWidth = kOne ? 1 : kGroup<TypeParam>;
        EXPECT_TRUE(kWidth == 1 || alone == 0) << "a full group after single numbers";
        alone += kWidth == 1 ? 1 : 0;
        for (int i = 0; i < kWidth; ++i) {
          seen.push_back(group.begin + i);
        }
      });
      EXPECT_EQ(alone, kGroup<TypeParam> == 1 ? int{number} : int{number} % kGroup<TypeParam>);
      return seen;
    };
    EXPECT_EQ(indices(n), ascending(n));
    EXPECT_EQ(indices(count), ascending(n));
  });
}

TYPED_TEST(Groups, GiveTheBitsOfAPlainLoop) {
  using Scalar = TypeParam;
  const auto a = numbers<Scalar>(1);
  const auto b = numbers<Scalar>(4);
  each_count([&](int n, auto count) {
    SCOPED_TRACE(n);
    const Scalar limit = Scalar(0.25);
    Numbers<Scalar> wanted{};
    for (int i = 0; i < n; ++i) {
      const auto at = static_cast<std::size_t>(i);
      Scalar value = a[at] * b[at] + a[at] / (b[at] * b[at] + limit);
      value = value < limit ? value : limit;
      value = value > -limit ? value : -limit;
      wanted[at] = value * static_cast<Scalar>(i + 1);
    }
    const auto grouped = [&](auto number) {
      Numbers<Scalar> result{};
      ehsid::in_groups<Scalar>(number, [&](auto group) {
        const auto left = group.load(a.data());
        const auto right = group.gather(b.data());
        auto value = left * right + left / (right * right + limit);
        value = group.larger(group.smaller(value, limit), -limit);
        group.scatter(
            group.map(value, [](int i, Scalar one) { return one * static_cast<Scalar>(i + 1); }),
            result.data());
      });
      return result;
    };
    expect_same_bits(grouped(n), wanted);
    expect_same_bits(grouped(count), wanted);
  });
}

TYPED_TEST(Groups, JudgeEveryNumberOfAGroup) {
  using Scalar = TypeParam;
  const Scalar infinity = std::numeric_limits<Scalar>::infinity();
  const auto usable = [](const Numbers<Scalar>& squarable, const Numbers<Scalar>& finite,
                         const Numbers<Scalar>& positive) {
    bool all = true;
    ehsid::in_groups<Scalar>(2 * kGroup<Scalar> + 1, [&](auto group) {
      all = group.usable(group.load(squarable.data()), group.load(finite.data()),
                         group.load(positive.data())) &&
            all;
    });
    return all;
  };
  Numbers<Scalar> good;
  good.fill(Scalar(2));
  EXPECT_TRUE(usable(good, good, good));
  for (std::size_t at = 0; at < 2 * kGroup<Scalar> + 1; ++at) {
    const auto with = [&](Scalar value) {
      auto changed = good;
      changed[at] = value;
      return changed;
    };
    for (const Scalar bad : {infinity, -infinity, std::numeric_limits<Scalar>::quiet_NaN()}) {
      EXPECT_FALSE(usable(with(bad), good, good)) << at;
      EXPECT_FALSE(usable(good, with(bad), good)) << at;
      EXPECT_FALSE(usable(good, good, with(bad))) << at;
    }
    const Scalar large = std::numeric_limits<Scalar>::max();
    EXPECT_FALSE(usable(with(large), good, good)) << at;
    EXPECT_TRUE(usable(good, with(-large), good)) << at;
    EXPECT_TRUE(usable(good, good, with(large))) << at;
    for (const Scalar bad : {Scalar(0), Scalar(-2), std::numeric_limits<Scalar>::denorm_min()}) {
      EXPECT_FALSE(usable(good, good, with(bad))) << at;
      EXPECT_TRUE(usable(with(bad), with(bad), good)) << at;
    }
  }
}

TYPED_TEST(Groups, CompareEveryNumberOfAGroup) {
  using Scalar = TypeParam;
  constexpr int kN = kGroup<Scalar>;
  const auto at_most = [](const Numbers<Scalar>& a, const Numbers<Scalar>& b) {
    bool all = true;
    ehsid::in_groups<Scalar>(kN, [&](auto group) {
      all = group.at_most(group.load(a.data()), group.load(b.data())) && all;
    });
    return all;
  };
  const auto a = numbers<Scalar>(2);
  EXPECT_TRUE(at_most(a, a));
  for (std::size_t i = 0; i < kN; ++i) {
    auto less = a;
    less[i] = std::nextafter(a[i], -std::numeric_limits<Scalar>::infinity());
    EXPECT_TRUE(at_most(less, a)) << i;
    EXPECT_FALSE(at_most(a, less)) << i;
  }
}

TYPED_TEST(Groups, KeepCopiesTheFirstNumbersOnly) {
  using Scalar = TypeParam;
  const auto from = numbers<Scalar>(3);
  each_count([&](int n, auto count) {
    SCOPED_TRACE(n);
    auto wanted = numbers<Scalar>(5);
    auto kept = wanted;
    auto kept_known = wanted;
    for (int i = 0; i < n; ++i) {
      wanted[static_cast<std::size_t>(i)] = from[static_cast<std::size_t>(i)];
    }
    ehsid::keep_groups<Scalar>(n, from.data(), kept.data());
    ehsid::keep_groups<Scalar>(count, from.data(), kept_known.data());
    expect_same_bits(kept, wanted);
    expect_same_bits(kept_known, wanted);
  });
}

TYPED_TEST(Groups, KeepCopiesAWholeArray) {
  using Scalar = TypeParam;
  const auto from = numbers<Scalar>(3);
  auto to = numbers<Scalar>(5);
  ehsid::keep_numbers<kMost + 1>(kMost + 1, from, to);
  expect_same_bits(to, from);
}

}  // namespace
