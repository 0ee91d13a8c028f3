// SPDX-License-Identifier: MIT
// Four numbers side by side: the metering edges of a valve.
#pragma once

#include <ehsid/plant/lanes.hpp>

#include <array>
#include <cstddef>
#include <cstring>

namespace ehsid::plant {

/// Four numbers in blocks of at most kWidth, see Lanes. Every number is computed by itself, so that the width changes no
/// bit of a result.
template <int kWidth>
class Four {
  static_assert(kWidth == 1 || kWidth == 2 || kWidth % 4 == 0,
                "four numbers must fill whole blocks");
#if defined(__GNUC__) || defined(__clang__)
  static constexpr int kInBlock = kWidth < 4 ? kWidth : 4;
  using Block [[gnu::vector_size(kInBlock * sizeof(double))]] = double;
#else
  static constexpr int kInBlock = 1;
  using Block = double;
#endif
  static constexpr int kBlocks = 4 / kInBlock;

 public:
  EHSID_LANES_INLINE explicit Four(const std::array<double, 4>& numbers) {
    std::memcpy(blocks_, numbers.data(), sizeof blocks_);
  }

  EHSID_LANES_INLINE double operator[](std::size_t i) const {
    double number = 0.0;
    std::memcpy(&number, reinterpret_cast<const char*>(blocks_) + i * sizeof(double),
                sizeof(double));
    return number;
  }

  EHSID_LANES_INLINE friend Four operator+(Four a, const Four& b) {
    for (int i = 0; i < kBlocks; ++i) {
      a.blocks_[i] += b.blocks_[i];
    }
    return a;
  }
  EHSID_LANES_INLINE friend Four operator*(Four a, const Four& b) {
    for (int i = 0; i < kBlocks; ++i) {
      a.blocks_[i] *= b.blocks_[i];
    }
    return a;
  }
  EHSID_LANES_INLINE friend Four operator+(Four a, double b) {
    for (int i = 0; i < kBlocks; ++i) {
      a.blocks_[i] += b;
    }
    return a;
  }
  EHSID_LANES_INLINE friend Four operator*(Four a, double b) {
    for (int i = 0; i < kBlocks; ++i) {
      a.blocks_[i] *= b;
    }
    return a;
  }
  EHSID_LANES_INLINE friend Four operator/(double a, Four b) {
    for (int i = 0; i < kBlocks; ++i) {
      b.blocks_[i] = a / b.blocks_[i];
    }
    return b;
  }

 private:
  Block blocks_[kBlocks];
};

}  // namespace ehsid::plant
