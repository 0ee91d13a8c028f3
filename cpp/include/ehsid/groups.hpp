// SPDX-License-Identifier: MIT
// Numbers of an array that are computed together: a processor with vectors of 128 bits divides four floats in the time of
// one. Each number goes through the same operations in the same order as alone, so no bit of a result depends on it.
#pragma once

#include <ehsid/types.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

// Vectors as the compilers know them, without a header of the processor's. Not with -Os, where flash goes before speed;
// not with -ffast-math, which may remove the guards (see bits_of()).
#if (defined(__GNUC__) || defined(__clang__)) && (defined(__SSE2__) || defined(__aarch64__)) && \
    !defined(__OPTIMIZE_SIZE__) && !(defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#define EHSID_VECTORS 1
#else
#define EHSID_VECTORS 0
#endif

namespace ehsid {

/// Numbers in a full group: 4 floats, 2 doubles; 1 of any other type, and where the processor has no vectors, as a Cortex-M.
template <class Scalar>
constexpr int kGroup = EHSID_VECTORS == 1 && std::is_floating_point<Scalar>::value
                           ? static_cast<int>(16 / sizeof(Scalar))
                           : 1;

/// Numbers begin .. begin + kWidth - 1 of an array. Values holds them and has the operators of Scalar.
template <class Scalar, int kWidth>
struct Group;

/// One number alone.
template <class Scalar>
struct Group<Scalar, 1> {
  using Values = Scalar;
  int begin;

  EHSID_ALWAYS_INLINE Values load(const Scalar* from) const { return from[begin]; }
  EHSID_ALWAYS_INLINE void store(const Values& values, Scalar* to) const { to[begin] = values; }
  EHSID_ALWAYS_INLINE Values gather(const Scalar* from) const { return from[begin]; }
  EHSID_ALWAYS_INLINE void scatter(const Values& values, Scalar* to) const { to[begin] = values; }
  template <class Function>
  EHSID_ALWAYS_INLINE Values map(const Values& values, const Function& function) const {
    return function(begin, values);
  }
  EHSID_ALWAYS_INLINE static Values smaller(const Values& a, const Scalar& b) {
    return a < b ? a : b;
  }
  EHSID_ALWAYS_INLINE static Values larger(const Values& a, const Scalar& b) {
    return a > b ? a : b;
  }
  EHSID_ALWAYS_INLINE static bool at_most(const Values& a, const Values& b) { return a <= b; }
  EHSID_ALWAYS_INLINE static bool usable(const Values& squarable, const Values& finite,
                                         const Values& positive) {
    return is_squarable(squarable) && is_finite(finite) && is_normal_positive(positive);
  }
};

#if EHSID_VECTORS
template <class Scalar, int kWidth>
struct Group {
  static_assert(kWidth == kGroup<Scalar>, "a group is full or one number");
  using Word = std::make_signed_t<typename Bits<Scalar>::Word>;
  typedef Scalar Values __attribute__((vector_size(16)));
  typedef Word Truths
      __attribute__((vector_size(16)));  // of a comparison: -1 where it is true, else 0
  int begin;

  EHSID_ALWAYS_INLINE Values load(const Scalar* from) const {
    Values values;
    std::memcpy(&values, from + begin, sizeof values);
    return values;
  }
  EHSID_ALWAYS_INLINE void store(const Values& values, Scalar* to) const {
    std::memcpy(to + begin, &values, sizeof values);
  }
  /// load() of numbers that were just computed one by one: a single load would wait for all of their stores.
  EHSID_ALWAYS_INLINE Values gather(const Scalar* from) const {
    return gather(from + begin, std::make_integer_sequence<int, kWidth>{});
  }
  /// store() of numbers that are used one by one next.
  EHSID_ALWAYS_INLINE void scatter(const Values& values, Scalar* to) const {
    for (int i = 0; i < kWidth; ++i) {
      to[begin + i] = values[i];
    }
  }
  /// function(index, value) of each number.
  template <class Function>
  EHSID_ALWAYS_INLINE Values map(Values values, const Function& function) const {
    for (int i = 0; i < kWidth; ++i) {
      values[i] = function(begin + i, values[i]);
    }
    return values;
  }
  EHSID_ALWAYS_INLINE static Values smaller(const Values& a, Scalar b) {
    return a < b ? a : Values{} + b;
  }
  EHSID_ALWAYS_INLINE static Values larger(const Values& a, Scalar b) {
    return a > b ? a : Values{} + b;
  }
  /// a <= b of all numbers?
  EHSID_ALWAYS_INLINE static bool at_most(const Values& a, const Values& b) { return all(a <= b); }
  /// is_squarable(), is_finite() and is_normal_positive() of all numbers? A signed comparison serves as well as theirs: the
  /// sign is taken off or must not be set.
  EHSID_ALWAYS_INLINE static bool usable(const Values& squarable, const Values& finite,
                                         const Values& positive) {
    constexpr Word kExponent = word(Bits<Scalar>::kExponent);
    return all(((bits(squarable) & kExponent) < word(Bits<Scalar>::kSquareOverflows)) &
               ((bits(finite) & kExponent) < kExponent) &
               (bits(positive) >= word(Bits<Scalar>::kLeastNormal)) & (bits(positive) < kExponent));
  }

 private:
  EHSID_ALWAYS_INLINE static bool all(const Truths& truths) {
    std::uint64_t halves[2];
    std::memcpy(halves, &truths, sizeof halves);
    return (halves[0] & halves[1]) == ~std::uint64_t{0};
  }
  static constexpr Word word(typename Bits<Scalar>::Word bits) { return static_cast<Word>(bits); }
  EHSID_ALWAYS_INLINE static Truths bits(const Values& values) {
    Truths words;
    std::memcpy(&words, &values, sizeof words);
    return words;
  }
  template <int... kIndex>
  EHSID_ALWAYS_INLINE static Values gather(const Scalar* from,
                                           std::integer_sequence<int, kIndex...> /*indices*/) {
    return Values{from[kIndex]...};
  }
};
#endif

/// A count that the compiler knows.
template <int kCount>
using Count = std::integral_constant<int, kCount>;

/// Does every number of a loop over kN get its own code, as with EHSID_UNROLL?
template <int kN>
constexpr bool kUnrolled =
#if EHSID_VECTORS && defined(__OPTIMIZE__)
    kN > 0 && kN <= 16;
#else
    false;
#endif

/// n as a Count where loops over kN are unrolled.
template <int kN>
EHSID_ALWAYS_INLINE inline auto count_of(int n) {
  if constexpr (kUnrolled<kN>) {
    return Count<kN>{};
  } else {
    return n;
  }
}

/// step(group) for all of n numbers: full groups first, then number by number. n: int, or Count.
template <class Scalar, class Step>
EHSID_ALWAYS_INLINE inline void in_groups(int n, const Step& step) {
  int i = 0;
  if constexpr (kGroup<Scalar> > 1) {
    for (; i + kGroup<Scalar> <= n; i += kGroup<Scalar>) {
      step(Group<Scalar, kGroup<Scalar>>{i});
    }
  }
  EHSID_UNROLL
  for (; i < n; ++i) {
    step(Group<Scalar, 1>{i});
  }
}

template <class Scalar, int kSize, int kBegin = 0, class Step>
EHSID_ALWAYS_INLINE inline void in_groups(Count<kSize> n, const Step& step) {
  if constexpr (kBegin < kSize) {
    constexpr int kWidth = kBegin + kGroup<Scalar> <= kSize ? kGroup<Scalar> : 1;
    step(Group<Scalar, kWidth>{kBegin});
    in_groups<Scalar, kSize, kBegin + kWidth>(n, step);
  }
}

/// step(i) for i = 0 .. n - 1. n: int, or Count, then i is one, too.
template <class Step>
EHSID_ALWAYS_INLINE inline void upwards(int n, const Step& step) {
  EHSID_UNROLL
  for (int i = 0; i < n; ++i) {
    step(i);
  }
}

template <int kSize, int kBegin = 0, class Step>
EHSID_ALWAYS_INLINE inline void upwards(Count<kSize> n, const Step& step) {
  if constexpr (kBegin < kSize) {
    step(Count<kBegin>{});
    upwards<kSize, kBegin + 1>(n, step);
  }
}

/// dot() of as many entries as the compiler knows of: clang leaves a loop over them a loop.
template <int kSize, class Left, class Right>
EHSID_ALWAYS_INLINE inline auto dot(Count<kSize> /*size*/, const Left& left, const Right& right) {
  auto sum = entry(left, 0) * entry(right, 0);
  upwards<kSize, 1>(Count<kSize>{}, [&](const int i) EHSID_INLINE_LAMBDA {
    sum += entry(left, i) * entry(right, i);
  });
  return sum;
}

/// to = from, the first n numbers, group by group.
template <class Scalar, class Number>
EHSID_ALWAYS_INLINE inline void keep_groups(Number n, const Scalar* from, Scalar* to) {
  in_groups<Scalar>(
      n, [&](const auto group) EHSID_INLINE_LAMBDA { group.store(group.load(from), to); });
}

/// to = from, the first n numbers of arrays of size kN. Group by group where loops over kN are unrolled: as the numbers have
/// just been stored, so that no load waits for several stores.
template <int kN, class Scalar, std::size_t kCapacity>
EHSID_ALWAYS_INLINE inline void keep_numbers(int n, const std::array<Scalar, kCapacity>& from,
                                             std::array<Scalar, kCapacity>& to) {
  if constexpr (kUnrolled<kN>) {
    keep_groups(Count<kN>{}, from.data(), to.data());
  } else {
    keep<kN>(n, from, to);
  }
}

}  // namespace ehsid
