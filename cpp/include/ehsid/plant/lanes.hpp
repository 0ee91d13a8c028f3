// SPDX-License-Identifier: MIT
// Numbers side by side, on all of which the processor does the same: the partial derivatives of a dual number.
#pragma once

#include <cstddef>
#include <cstring>
#include <utility>

#if defined(__GNUC__) || defined(__clang__)
#define EHSID_LANES_INLINE [[gnu::always_inline]] inline
#else
#define EHSID_LANES_INLINE inline
#endif

namespace ehsid::plant {

/// kN numbers in blocks of kWidth numbers, each block in one register: 2 with SSE2 or NEON, 4 with AVX2, 8 with AVX-512.
///
/// Every number is computed by itself, so that the width changes no bit of a result. Code that is compiled for another
/// instruction set uses another width and so has types of its own: the linker cannot take one for the other.
template <int kN, int kWidth = kN % 2 == 0 ? 2 : 1>
class Lanes {
  static_assert(kN >= 1 && kWidth >= 1 && kN % kWidth == 0, "lanes must fill whole blocks");

 public:
  /// Numbers in a block.
  static constexpr int kBlockWidth = kWidth;

  /// All zero.
  Lanes() = default;

  EHSID_LANES_INLINE double operator[](std::size_t i) const {
    double number = 0.0;
    std::memcpy(&number, reinterpret_cast<const char*>(blocks_) + i * sizeof(double),
                sizeof(double));
    return number;
  }
  EHSID_LANES_INLINE void set(std::size_t i, double number) {
    std::memcpy(reinterpret_cast<char*>(blocks_) + i * sizeof(double), &number, sizeof(double));
  }
  /// Writes the numbers to kN places from `out` on.
  EHSID_LANES_INLINE void store(double* out) const {
    std::memcpy(out, blocks_, kN * sizeof(double));
  }

  EHSID_LANES_INLINE bool all_zero() const {
    bool zero = true;
    for (std::size_t i = 0; i < static_cast<std::size_t>(kN); ++i) {
      zero = zero && (*this)[i] == 0.0;
    }
    return zero;
  }

  EHSID_LANES_INLINE Lanes& operator+=(const Lanes& other) {
    add(other, Places{});
    return *this;
  }
  EHSID_LANES_INLINE Lanes& operator-=(const Lanes& other) {
    subtract(other, Places{});
    return *this;
  }
  EHSID_LANES_INLINE Lanes& operator*=(double factor) {
    scale(factor, Places{});
    return *this;
  }
  EHSID_LANES_INLINE Lanes operator-() const {
    Lanes result;
    result.negate(*this, Places{});
    return result;
  }
  EHSID_LANES_INLINE friend Lanes operator+(Lanes a, const Lanes& b) { return a += b; }
  EHSID_LANES_INLINE friend Lanes operator-(Lanes a, const Lanes& b) { return a -= b; }
  EHSID_LANES_INLINE friend Lanes operator*(Lanes a, double b) { return a *= b; }
  EHSID_LANES_INLINE friend Lanes operator*(double a, Lanes b) { return b *= a; }

 private:
#if defined(__GNUC__) || defined(__clang__)
  using Block [[gnu::vector_size(kWidth * sizeof(double))]] = double;
  static constexpr std::size_t kBlocks = kN / kWidth;
#else
  using Block = double;
  static constexpr std::size_t kBlocks = kN;
#endif

  // Written out block by block: where a loop remains until late, gcc keeps three blocks and more in memory, which takes
  // three times as long.
  using Places = std::make_index_sequence<kBlocks>;
  template <std::size_t... kPlace>
  EHSID_LANES_INLINE void add(const Lanes& other, std::index_sequence<kPlace...> /*all*/) {
    ((blocks_[kPlace] += other.blocks_[kPlace]), ...);
  }
  template <std::size_t... kPlace>
  EHSID_LANES_INLINE void subtract(const Lanes& other, std::index_sequence<kPlace...> /*all*/) {
    ((blocks_[kPlace] -= other.blocks_[kPlace]), ...);
  }
  template <std::size_t... kPlace>
  EHSID_LANES_INLINE void scale(double factor, std::index_sequence<kPlace...> /*all*/) {
    ((blocks_[kPlace] *= factor), ...);
  }
  template <std::size_t... kPlace>
  EHSID_LANES_INLINE void negate(const Lanes& other, std::index_sequence<kPlace...> /*all*/) {
    ((blocks_[kPlace] = -other.blocks_[kPlace]), ...);
  }

  Block blocks_[kBlocks] = {};
};

}  // namespace ehsid::plant
