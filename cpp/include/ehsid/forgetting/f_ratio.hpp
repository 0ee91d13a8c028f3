// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/forgetting/evidence.hpp>
#include <ehsid/forgetting/settings.hpp>
#include <ehsid/sliding_sum.hpp>

#include <cmath>

namespace ehsid {

/// Variable-rate forgetting by the F-ratio of prediction errors in a short and a long window.
///
/// Source: N. Mohseni, D. S. Bernstein, "Recursive least squares with variable-rate forgetting based on
/// the F-test", American Control Conference 2022, pp. 3937-3942; with critical_ratio = 1 it is the RMS-ratio
/// form of A. L. Bruce, A. Goel, D. S. Bernstein, "Convergence and consistency of recursive least
/// squares with variable-rate forgetting", Automatica 119, 2020, 109052.
/// Equation: g = sqrt(F / F_crit) - 1, F = mean(epsilon^2, last kShort) / mean(epsilon^2, last kLong);
/// lambda(k) = 1 / (1 + eta g) where g > 0, else 1.
/// Guarantee: F <= kLong / kShort, so lambda >= 1 / (1 + eta (sqrt(kLong / (kShort F_crit)) - 1)); as long as
/// the errors stay alike nothing is forgotten, so nothing winds up either.
/// Cost: two additions each window, a division, a square root; memory kShort + kLong numbers.
/// Default: windows 10 and 100; F_crit = 3.30, the 0.1 % point of F(10, 100); eta = 2.
template <class Scalar, int kShort = 10, int kLong = 100>
struct FRatio {
  static_assert(kShort < kLong, "the short window must be shorter than the long one");
  static constexpr std::uint32_t kId = 4;
  static constexpr bool kFollowsErrors = true;
  static constexpr PolicyInfo kInfo{
      "f_ratio", "FRatio",
      "forgets where recent errors (10 samples) significantly exceed older ones (100 samples)",
      "Mohseni, Bernstein 2022; Bruce, Goel, Bernstein 2020"};

  Scalar eta = Scalar(2);
  Scalar critical_ratio = Scalar(3.3);  // F_crit
  SlidingSum<Scalar, kShort> short_window{};
  SlidingSum<Scalar, kLong> long_window{};
  std::int32_t seen = 0;  // samples since the restart, up to kLong

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&FRatio::short_window);
    visit(&FRatio::long_window);
    visit(&FRatio::seen);
  }

  template <class Visit>
  static constexpr void settings(Visit visit) {
    visit(SettingInfo{"eta", Range::at_least(0.0), "1", "aggressiveness: lambda = 1 / (1 + eta g)",
                      6},
          [](auto& owner) -> auto& { return owner.eta; });
    visit(SettingInfo{"critical_ratio", Range::at_least(1.0), "1",
                      "F_crit, ratio of mean squared errors above which something has changed", 7},
          [](auto& owner) -> auto& { return owner.critical_ratio; });
  }

  bool valid() const {
    return settings_valid(*this) && seen >= 0 && seen <= kLong && short_window.usable() &&
           long_window.usable();
  }
  /// While the errors stay alike nothing is forgotten: nothing to protect.
  Scalar loss() const { return Scalar(0); }
  void restart() {
    short_window = {};
    long_window = {};
    seen = 0;
  }
  ForgettingFactors<Scalar> peek(const Evidence<Scalar>& evidence) const {
    if (seen + 1 < kLong) {
      return {Scalar(1), Scalar(1)};  // the long window has no meaning yet
    }
    const Scalar square = square_of(evidence);
    const Scalar short_mean = short_window.peek(square) / Scalar(kShort);
    const Scalar long_mean = long_window.peek(square) / Scalar(kLong);
    if (!(short_mean > critical_ratio * long_mean)) {
      return {Scalar(1), Scalar(1)};
    }
    const Scalar g = std::sqrt(short_mean / (critical_ratio * long_mean)) - Scalar(1);
    return {Scalar(1) / (Scalar(1) + eta * g), Scalar(1)};
  }
  void accept(const Evidence<Scalar>& evidence) {
    const Scalar square = square_of(evidence);
    short_window.push(square);
    long_window.push(square);
    seen = seen < kLong ? seen + 1 : kLong;
  }

 private:
  /// epsilon^2, at most what both windows can sum up.
  static Scalar square_of(const Evidence<Scalar>& evidence) {
    constexpr Scalar kMost = SlidingSum<Scalar, kLong>::kMost;
    const Scalar square = evidence.innovation * evidence.innovation;
    return square < kMost ? square : kMost;
  }
};

}  // namespace ehsid
