// SPDX-License-Identifier: MIT
// Powers with the same exponent, and logarithms, four at a time.
//
//   w = 2^k c_j (1 + t), the c_j in the middle of 32 parts of an octave, so that |t| <= 1/64
//   w^p = 2^(k p) c_j^p (1 + p t + p (p - 1) t^2 / 2 + ...),  ln w = k ln 2 + ln c_j + t - t^2 / 2 + ...
//
// Source: P. T. P. Tang, Table-driven implementation of the logarithm function, ACM Trans. Math. Softw. 16(4), 1990.
// Both series end where the next term is below 1e-17. A step of the simulator waits twice for such a power; exp(p ln w)
// by a library would take longer than all the rest of the step.
#pragma once

#include <ehsid/plant/four.hpp>
#include <ehsid/plant/lanes.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ehsid::plant {

/// Tables for one exponent and one range of numbers.
class Powers {
 public:
  Powers() = default;

  /// Of numbers between `least`, positive and normal, and 2^120 times that, with an exponent between -1 and 1. Other
  /// numbers have powers and logarithms that say nothing.
  Powers(double least, double exponent) : first_(bits_of(least) >> kMantissaBits) {
    constexpr double kLn2 = 0.6931471805599453;
    constexpr double kBias = 1023.0;
    for (std::size_t k = 0; k < kOctaves; ++k) {
      const double octave = static_cast<double>(first_ + k) - kBias;
      octaves_[k] = {std::pow(std::exp2(octave), exponent), octave * kLn2};
    }
    for (std::size_t j = 0; j < kPieces; ++j) {
      const double middle = 1.0 + (static_cast<double>(j) + 0.5) / static_cast<double>(kPieces);
      const double inverse = 1.0 / middle;
      pieces_[j] = {inverse, std::pow(inverse, -exponent), -std::log(inverse)};
    }
    double binomial = 1.0;
    for (std::size_t n = 0; n < kTerms; ++n) {
      binomial *= (exponent - static_cast<double>(n)) / static_cast<double>(n + 1);
      series_[n] = binomial;
    }
  }

  /// The parts of four numbers of which both their powers and their logarithms consist.
  template <int kWidth>
  struct Parts {
    std::array<std::size_t, 4> octave, piece;
    Four<kWidth> t;
  };
  template <int kWidth>
  EHSID_LANES_INLINE Parts<kWidth> parts(const Four<kWidth>& numbers) const {
    std::array<std::size_t, 4> octave{};
    std::array<std::size_t, 4> piece{};
    std::array<double, 4> t{};
    for (std::size_t i = 0; i < 4; ++i) {
      const std::uint64_t bits = bits_of(numbers[i]);
      octave[i] = std::min<std::size_t>((bits >> kMantissaBits) - first_, kOctaves - 1);
      piece[i] = (bits >> (kMantissaBits - kPieceBits)) % kPieces;
      const std::uint64_t mantissa = (bits & kMantissa) | kOne;
      double number = 0.0;
      std::memcpy(&number, &mantissa, sizeof number);
      t[i] = number * pieces_[piece[i]].inverse - 1.0;
    }
    return {octave, piece, Four<kWidth>(t)};
  }

  /// w^p, to 4 units in the last place.
  template <int kWidth>
  EHSID_LANES_INLINE Four<kWidth> power(const Parts<kWidth>& w) const {
    std::array<double, 4> scale{};
    for (std::size_t i = 0; i < 4; ++i) {
      scale[i] = octaves_[w.octave[i]].power * pieces_[w.piece[i]].power;
    }
    return Four<kWidth>(scale) * (w.t * series(w.t, series_) + 1.0);
  }

  /// ln w, to 2e-16 of ln w or of 1, whichever is more.
  template <int kWidth>
  EHSID_LANES_INLINE Four<kWidth> logarithm(const Parts<kWidth>& w) const {
    constexpr std::array<double, kTerms> kSeries{1.0,       -1.0 / 2.0, 1.0 / 3.0, -1.0 / 4.0,
                                                 1.0 / 5.0, -1.0 / 6.0, 1.0 / 7.0, -1.0 / 8.0};
    std::array<double, 4> whole{};
    for (std::size_t i = 0; i < 4; ++i) {
      whole[i] = octaves_[w.octave[i]].logarithm + pieces_[w.piece[i]].logarithm;
    }
    return Four<kWidth>(whole) + w.t * series(w.t, kSeries);
  }

 private:
  static constexpr int kMantissaBits = 52;
  static constexpr std::uint64_t kMantissa = 0x000fffffffffffffU;
  static constexpr std::uint64_t kOne = 0x3ff0000000000000U;
  static constexpr int kPieceBits = 5;
  static constexpr std::size_t kPieces = 1U << kPieceBits;
  static constexpr std::size_t kOctaves = 122;
  static constexpr std::size_t kTerms = 8;

  struct Octave {
    double power, logarithm;
  };
  struct Piece {
    double inverse, power, logarithm;
  };

  static std::uint64_t bits_of(double number) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    return bits;
  }

  /// a_0 + a_1 t + ... + a_7 t^7 in the order that waits least (Estrin).
  template <int kWidth>
  EHSID_LANES_INLINE static Four<kWidth> series(const Four<kWidth>& t,
                                                const std::array<double, kTerms>& a) {
    const Four<kWidth> t2 = t * t;
    const Four<kWidth> low = (t * a[1] + a[0]) + t2 * (t * a[3] + a[2]);
    const Four<kWidth> high = (t * a[5] + a[4]) + t2 * (t * a[7] + a[6]);
    return low + t2 * t2 * high;
  }

  std::uint64_t first_ = 0;  // exponent of the first octave, as the bits of a number hold it
  std::array<Octave, kOctaves> octaves_{};
  std::array<Piece, kPieces> pieces_{};
  std::array<double, kTerms> series_{};  // of (1 + t)^p, from t on
};

}  // namespace ehsid::plant
