// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/forgetting/evidence.hpp>
#include <ehsid/forgetting/select.hpp>
#include <ehsid/forgetting/settings.hpp>

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
template <class T, int kShort = 10, int kLong = 100>
struct FRatio {
  using Scalar = ScalarOf<T>;
  using Count = CountOf<T>;
  template <class Lanes>
  using Over = FRatio<Lanes, kShort, kLong>;
  static_assert(kShort < kLong, "the short window must be shorter than the long one");
  static constexpr std::uint32_t kId = 4;
  static constexpr bool kFollowsErrors = true;
  static constexpr PolicyInfo kInfo{
      "f_ratio", "FRatio",
      "forgets where recent errors (10 samples) significantly exceed older ones (100 samples)",
      "Mohseni, Bernstein 2022; Bruce, Goel, Bernstein 2020"};

  T eta = T(2);
  T critical_ratio = T(Scalar(3.3));  // F_crit
  SumOf<T, kShort> short_window{};
  SumOf<T, kLong> long_window{};
  Count seen = Count(0);  // samples since the restart, up to kLong

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
  EHSID_ALWAYS_INLINE T loss() const { return T(0); }
  EHSID_ALWAYS_INLINE void restart(const TruthOf<T>& where = TruthOf<T>(true)) {
    short_window.restart(where);
    long_window.restart(where);
    seen = select(where, Count(0), seen);
  }
  EHSID_ALWAYS_INLINE ForgettingFactors<T> peek(const Evidence<T>& evidence) const {
    T lambda(1);
    // Before it is full the long window has no meaning.
    const TruthOf<T> full = seen + Count(1) >= Count(kLong);
    if (any(full)) {
      const T square = square_of(evidence);
      const T short_mean = short_window.peek(square) / T(kShort);
      const T usual = critical_ratio * (long_window.peek(square) / T(kLong));
      const TruthOf<T> changed = both(full, short_mean > usual);
      if (any(changed)) {
        using std::sqrt;
        const T g = sqrt(short_mean / usual) - T(1);
        lambda = select(changed, T(1) / (T(1) + eta * g), lambda);
      }
    }
    return {lambda, T(1)};
  }
  EHSID_ALWAYS_INLINE void accept(const Evidence<T>& evidence,
                                  const TruthOf<T>& where = TruthOf<T>(true)) {
    const T square = square_of(evidence);
    short_window.push(square, where);
    long_window.push(square, where);
    seen = select(both(where, seen < Count(kLong)), seen + Count(1), seen);
  }

 private:
  /// epsilon^2, at most what both windows can sum up.
  EHSID_ALWAYS_INLINE static T square_of(const Evidence<T>& evidence) {
    return smaller(evidence.innovation * evidence.innovation, T(SlidingSum<Scalar, kLong>::kMost));
  }
};

}  // namespace ehsid
