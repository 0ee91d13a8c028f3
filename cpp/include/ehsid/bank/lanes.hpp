// SPDX-License-Identifier: MIT
// Numbers that go through the same operations side by side: one lane for each estimator of a bank.
//
// Built on the vector types of gcc and clang. They become the instructions of the function that uses them: SSE2 or NEON by
// default, AVX2 or AVX-512 in a function that is marked for them, see isa.hpp. Every operation is the IEEE 754 operation in
// each lane, so a lane has the bits of the scalar code. All of it must be inlined into the marked function: a function of
// its own would have the default instructions, and another calling convention.
#pragma once

#include <ehsid/types.hpp>

#include <cmath>
#include <cstdint>
#include <type_traits>

#if !defined(__GNUC__) && !defined(__clang__)
#error "ehsid/bank needs the vector types of gcc or clang"
#endif

#if !defined(__clang__)
#pragma GCC diagnostic ignored "-Wpsabi"  // of a calling convention that no call ever uses
#endif

namespace ehsid::bank {

/// A signed integer as wide as the number, so that both have as many lanes in a register.
template <class Number>
using Whole = std::conditional_t<sizeof(Number) == 4, std::int32_t, std::int64_t>;

namespace detail {

/// All bits one. No constant, so that no compiler knows: see Lanes.
alignas(64) inline std::int32_t marks[16] = {-1, -1, -1, -1, -1, -1, -1, -1,
                                             -1, -1, -1, -1, -1, -1, -1, -1};

}  // namespace detail

/// True or false in each lane: all bits one, or zero. Word: the Whole of the numbers that were compared.
template <class Word, int kWidth>
struct alignas(kWidth * sizeof(Word)) Mask {
  typedef Word Native __attribute__((vector_size(kWidth * sizeof(Word))));
  typedef std::int8_t Bytes __attribute__((vector_size(kWidth)));
  typedef std::uint64_t Chunks __attribute__((vector_size(kWidth * sizeof(Word))));
  typedef std::uint64_t ChunksOfBytes __attribute__((vector_size(kWidth < 8 ? 8 : kWidth)));
  Native native;

  // Copied as a register: gcc would copy a struct whose size is no register of the default instructions in pieces.
  Mask() = default;
  EHSID_ALWAYS_INLINE Mask(const Mask& from) : native(from.native) {}
  EHSID_ALWAYS_INLINE Mask& operator=(const Mask& from) {
    native = from.native;
    return *this;
  }
  EHSID_ALWAYS_INLINE Mask(const Native& from) : native(from) {}
  EHSID_ALWAYS_INLINE explicit Mask(bool all) : native(Native{} - Word(all ? 1 : 0)) {}

  EHSID_ALWAYS_INLINE friend Mask operator&(const Mask& a, const Mask& b) {
    return a.native & b.native;
  }
  EHSID_ALWAYS_INLINE friend Mask operator|(const Mask& a, const Mask& b) {
    return a.native | b.native;
  }
  EHSID_ALWAYS_INLINE friend Mask operator~(const Mask& a) { return ~a.native; }

  EHSID_ALWAYS_INLINE bool operator[](int lane) const { return native[lane] != 0; }
  EHSID_ALWAYS_INLINE void set(int lane, bool value) { native[lane] = value ? Word(-1) : Word(0); }
};

/// True in some lane?
template <class Word, int kWidth>
EHSID_ALWAYS_INLINE inline bool any(const Mask<Word, kWidth>& mask) {
  std::uint64_t found = 0;
  if constexpr (sizeof(mask.native) > 32) {  // AVX-512 makes bytes of them at once
    const auto bytes = __builtin_convertvector(mask.native, typename Mask<Word, kWidth>::Bytes);
    using Chunks = typename Mask<Word, kWidth>::ChunksOfBytes;
    const auto chunks = reinterpret_cast<Chunks>(bytes);
    EHSID_UNROLL
    for (int i = 0; i < kWidth / 8; ++i) {
      found |= chunks[i];
    }
  } else {
    const auto chunks = reinterpret_cast<typename Mask<Word, kWidth>::Chunks>(mask.native);
    EHSID_UNROLL
    for (std::size_t i = 0; i < sizeof(mask.native) / sizeof(std::uint64_t); ++i) {
      found |= chunks[i];
    }
  }
  return found != 0;
}

/// True in every lane?
template <class Word, int kWidth>
EHSID_ALWAYS_INLINE inline bool all(const Mask<Word, kWidth>& mask) {
  return !any(~mask);
}

/// One number of each estimator. Operators as of the number itself; a lone number stands for itself in every lane.
template <class Number_, int kWidth_>
struct alignas(kWidth_ * sizeof(Number_)) Lanes {
  using Number = Number_;
  static constexpr int kWidth = kWidth_;
  using Truth = Mask<Whole<Number>, kWidth>;
  typedef Number Native __attribute__((vector_size(kWidth * sizeof(Number))));
  typedef Number Loose
      __attribute__((vector_size(kWidth * sizeof(Number)), aligned(sizeof(Number)), may_alias));
  Native native;

  // With 512 bits gcc takes a comparison apart, number by number, unless a choice between two vectors follows that it
  // cannot foresee. So there a mask is such a choice, between zero and ones of which it does not know that they are ones.
#if defined(__clang__)
  static constexpr bool kChooses = false;
#else
  static constexpr bool kChooses = kWidth * sizeof(Number) > 32;
#endif

  Lanes() = default;
  EHSID_ALWAYS_INLINE Lanes(const Lanes& from) : native(from.native) {}
  EHSID_ALWAYS_INLINE Lanes& operator=(const Lanes& from) {
    native = from.native;
    return *this;
  }
  EHSID_ALWAYS_INLINE Lanes(const Native& from) : native(from) {}
  EHSID_ALWAYS_INLINE explicit Lanes(Number value) : native(value - Native{}) {}

  /// From kWidth numbers at any address, and to them.
  EHSID_ALWAYS_INLINE static Lanes from(const Number* numbers) {
    const Native all = *reinterpret_cast<const Loose*>(numbers);
    return all;
  }
  EHSID_ALWAYS_INLINE void to(Number* numbers) const {
    *reinterpret_cast<Loose*>(numbers) = native;
  }

  EHSID_ALWAYS_INLINE Number operator[](int lane) const { return native[lane]; }
  EHSID_ALWAYS_INLINE void set(int lane, Number value) { native[lane] = value; }

  EHSID_ALWAYS_INLINE Lanes operator-() const { return -native; }
  EHSID_ALWAYS_INLINE Lanes& operator+=(const Lanes& b) { return *this = *this + b; }
  EHSID_ALWAYS_INLINE Lanes& operator-=(const Lanes& b) { return *this = *this - b; }
  EHSID_ALWAYS_INLINE Lanes& operator*=(const Lanes& b) { return *this = *this * b; }
  EHSID_ALWAYS_INLINE Lanes& operator/=(const Lanes& b) { return *this = *this / b; }
  EHSID_ALWAYS_INLINE friend Lanes operator+(const Lanes& a, const Lanes& b) {
    return a.native + b.native;
  }
  EHSID_ALWAYS_INLINE friend Lanes operator-(const Lanes& a, const Lanes& b) {
    return a.native - b.native;
  }
  EHSID_ALWAYS_INLINE friend Lanes operator*(const Lanes& a, const Lanes& b) {
    return a.native * b.native;
  }
  EHSID_ALWAYS_INLINE friend Lanes operator/(const Lanes& a, const Lanes& b) {
    return a.native / b.native;
  }

  EHSID_ALWAYS_INLINE friend Truth operator<(const Lanes& a, const Lanes& b) {
    if constexpr (kChooses) {
      const Native chosen = a.native < b.native ? *marks() : Native{};
      return reinterpret_cast<typename Truth::Native>(chosen);
    } else {
      return a.native < b.native;
    }
  }
  EHSID_ALWAYS_INLINE friend Truth operator<=(const Lanes& a, const Lanes& b) {
    if constexpr (kChooses) {
      const Native chosen = a.native <= b.native ? *marks() : Native{};
      return reinterpret_cast<typename Truth::Native>(chosen);
    } else {
      return a.native <= b.native;
    }
  }
  EHSID_ALWAYS_INLINE friend Truth operator==(const Lanes& a, const Lanes& b) {
    if constexpr (kChooses) {
      const Native chosen = a.native == b.native ? *marks() : Native{};
      return reinterpret_cast<typename Truth::Native>(chosen);
    } else {
      return a.native == b.native;
    }
  }
  EHSID_ALWAYS_INLINE friend Truth operator!=(const Lanes& a, const Lanes& b) { return ~(a == b); }
  EHSID_ALWAYS_INLINE friend Truth operator>(const Lanes& a, const Lanes& b) { return b < a; }
  EHSID_ALWAYS_INLINE friend Truth operator>=(const Lanes& a, const Lanes& b) { return b <= a; }

 private:
  EHSID_ALWAYS_INLINE static const Loose* marks() {
    return reinterpret_cast<const Loose*>(detail::marks);
  }
};

template <class Word, int kWidth>
EHSID_ALWAYS_INLINE inline Mask<Word, kWidth> both(const Mask<Word, kWidth>& a,
                                                   const Mask<Word, kWidth>& b) {
  return a & b;
}
template <class Word, int kWidth>
EHSID_ALWAYS_INLINE inline Mask<Word, kWidth> either(const Mask<Word, kWidth>& a,
                                                     const Mask<Word, kWidth>& b) {
  return a | b;
}

/// a where the mask is true, else b.
template <class Number, int kWidth>
EHSID_ALWAYS_INLINE inline Lanes<Number, kWidth> select(const Mask<Whole<Number>, kWidth>& mask,
                                                        const Lanes<Number, kWidth>& a,
                                                        const Lanes<Number, kWidth>& b) {
  if constexpr (Lanes<Number, kWidth>::kChooses) {
    // By its bits: out of a loop gcc 12 would take a comparison that it then cannot express.
    using Bits = typename Mask<Whole<Number>, kWidth>::Native;
    const Bits bits = (mask.native & reinterpret_cast<Bits>(a.native)) |
                      (~mask.native & reinterpret_cast<Bits>(b.native));
    return reinterpret_cast<typename Lanes<Number, kWidth>::Native>(bits);
  } else {
    return mask.native ? a.native : b.native;
  }
}

/// The smaller, b where one is NaN: as a < b ? a : b.
template <class Number, int kWidth>
EHSID_ALWAYS_INLINE inline Lanes<Number, kWidth> smaller(const Lanes<Number, kWidth>& a,
                                                         const Lanes<Number, kWidth>& b) {
  return a.native < b.native ? a.native : b.native;
}

/// The larger, b where one is NaN: as a > b ? a : b.
template <class Number, int kWidth>
EHSID_ALWAYS_INLINE inline Lanes<Number, kWidth> larger(const Lanes<Number, kWidth>& a,
                                                        const Lanes<Number, kWidth>& b) {
  return a.native > b.native ? a.native : b.native;
}

/// As std::sqrt in each lane. Compiled without errno (-fno-math-errno) one instruction does it.
template <class Scalar, int kWidth>
EHSID_ALWAYS_INLINE inline Lanes<Scalar, kWidth> sqrt(const Lanes<Scalar, kWidth>& values) {
  Lanes<Scalar, kWidth> roots;
  EHSID_UNROLL
  for (int i = 0; i < kWidth; ++i) {
    if constexpr (sizeof(Scalar) == sizeof(float)) {
      roots.native[i] = __builtin_sqrtf(values.native[i]);
    } else {
      roots.native[i] = __builtin_sqrt(values.native[i]);
    }
  }
  return roots;
}

/// Decides on the bits of many numbers by one comparison: keeps the largest value of the bits without the sign, where
/// `kLeast` has been taken off. What is smaller wraps round and becomes larger than all.
template <class Scalar, int kWidth>
class Extreme {
 public:
  using Word = typename Bits<Scalar>::Word;
  using Numbers = Lanes<Scalar, kWidth>;

  /// Sees the size of the number.
  EHSID_ALWAYS_INLINE void size_of(const Numbers& value) {
    take(reinterpret_cast<Native>(value.native) & (~Word(0) >> 1U));
  }
  /// Sees the number itself, for all_normal_positive().
  EHSID_ALWAYS_INLINE void value_of(const Numbers& value) {
    take(reinterpret_cast<Native>(value.native) - Bits<Scalar>::kLeastNormal);
  }

  /// Each of those seen by size_of() finite, or squarable?
  EHSID_ALWAYS_INLINE typename Numbers::Truth all_finite() const {
    return below(Bits<Scalar>::kExponent);
  }
  EHSID_ALWAYS_INLINE typename Numbers::Truth all_squarable() const {
    return below(Bits<Scalar>::kSquareOverflows);
  }
  /// Each of those seen by value_of() finite, positive and normal?
  EHSID_ALWAYS_INLINE typename Numbers::Truth all_normal_positive() const {
    return below(Bits<Scalar>::kExponent - Bits<Scalar>::kLeastNormal);
  }

 private:
  typedef Word Native __attribute__((vector_size(kWidth * sizeof(Word))));
  using Signed = Lanes<Whole<Scalar>, kWidth>;

  EHSID_ALWAYS_INLINE void take(const Native& seen) { most_ = seen > most_ ? seen : most_; }
  /// Every limit is below half of the range, where the highest bit of what is larger says so.
  EHSID_ALWAYS_INLINE typename Numbers::Truth below(Word limit) const {
    const Signed most(reinterpret_cast<typename Signed::Native>(most_));
    return (most < Signed(static_cast<Whole<Scalar>>(limit))) & (most >= Signed(0));
  }

  Native most_{};
};

/// Of each lane: see types.hpp.
template <class Scalar, int kWidth>
EHSID_ALWAYS_INLINE inline auto is_finite(const Lanes<Scalar, kWidth>& value) {
  Extreme<Scalar, kWidth> extreme;
  extreme.size_of(value);
  return extreme.all_finite();
}
template <class Scalar, int kWidth>
EHSID_ALWAYS_INLINE inline auto is_squarable(const Lanes<Scalar, kWidth>& value) {
  Extreme<Scalar, kWidth> extreme;
  extreme.size_of(value);
  return extreme.all_squarable();
}

}  // namespace ehsid::bank
