// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/forgetting/evidence.hpp>
#include <ehsid/forgetting/select.hpp>
#include <ehsid/forgetting/settings.hpp>

#include <limits>

namespace ehsid {

/// Forgetting factor that starts low and tends to one: the paper's "varying forgetting factor".
///
/// Source: Ghazali et al. (2011), Eq. (15).
/// Equation: lambda(k) = lambda0 lambda(k-1) + (1 - lambda0), so 1 - lambda(k) = lambda0^k (1 - lambda(0)).
/// Guarantee: total forgetting is finite, so the covariance cannot wind up for ever and the estimate
/// becomes ordinary least squares; it does not follow a plant that changes later without a reset.
/// Cost: one multiplication and one addition.
/// Default: lambda0 = 0.99, lambda(0) = 0.95 (Ljung & Soderstrom 1983, sec. 5.6); the paper names neither.
template <class T>
struct Exponential {
  using Scalar = ScalarOf<T>;
  template <class Lanes>
  using Over = Exponential<Lanes>;
  static constexpr std::uint32_t kId = 2;
  static constexpr bool kFollowsErrors = false;
  static constexpr PolicyInfo kInfo{
      "exponential", "Exponential",
      "lambda tends to one; does not follow later changes without a reset", "Eq. (15)"};

  T lambda0 = T(Scalar(0.99));
  T lambda_initial = T(Scalar(0.95));  // lambda(0)
  // 1 - lambda(k), state; 1 where lambda_initial is too small for a difference. Kept instead of lambda: a float32 lambda
  // stops short of one, at 1 - 3e-6 for lambda0 = 0.99, where its steps round to nothing.
  T deficit = T(Scalar(1) - Scalar(0.95));

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&Exponential::deficit);
  }

  template <class Visit>
  static constexpr void settings(Visit visit) {
    visit(SettingInfo{"lambda0", Range::factor(), "1",
                      "rate at which the forgetting factor goes to one", 1},
          [](auto& owner) -> auto& { return owner.lambda0; });
    visit(SettingInfo{"lambda_initial", Range::factor(), "1",
                      "forgetting factor at the start, lambda(0)", 2},
          [](auto& owner) -> auto& { return owner.lambda_initial; });
  }

  bool valid() const {
    return settings_valid(*this) && deficit >= Scalar(0) && deficit <= Scalar(1);
  }
  EHSID_ALWAYS_INLINE void restart(const TruthOf<T>& where = TruthOf<T>(true)) {
    deficit = select(where, T(1) - lambda_initial, deficit);
  }
  EHSID_ALWAYS_INLINE T loss() const { return next(); }
  EHSID_ALWAYS_INLINE ForgettingFactors<T> peek(const Evidence<T>& /*evidence*/) const {
    return {T(1) - next(), T(1)};
  }
  EHSID_ALWAYS_INLINE void accept(const Evidence<T>& /*evidence*/,
                                  const TruthOf<T>& where = TruthOf<T>(true)) {
    deficit = select(where, next(), deficit);
  }

 private:
  EHSID_ALWAYS_INLINE T next() const {
    // (15): 1 - lambda(k) = lambda0 (1 - lambda(k-1)); nothing once lambda rounds to one
    const T shrunk = lambda0 * deficit;
    return select(shrunk > T(std::numeric_limits<Scalar>::epsilon() / Scalar(4)), shrunk, T(0));
  }
};

}  // namespace ehsid
