// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/forgetting/evidence.hpp>
#include <ehsid/forgetting/select.hpp>
#include <ehsid/forgetting/settings.hpp>

namespace ehsid {

/// Constant forgetting factor.
///
/// Source: Eq. (13) with a fixed lambda; Ljung & Soderstrom, Theory and Practice of Recursive
/// Identification, MIT Press 1983, sec. 2.6.
/// Equation: lambda(k) = lambda.
/// Guarantee: the estimate minimises sum lambda^(k-i) e(i)^2 over the samples used, plus the prior.
/// Cost: none. Memory: 1 / (1 - lambda) samples.
/// Default: 0.99, the paper's comparison case. lambda = 1 is ordinary least squares.
template <class T>
struct Constant {
  using Scalar = ScalarOf<T>;
  template <class Lanes>
  using Over = Constant<Lanes>;
  static constexpr std::uint32_t kId = 1;
  static constexpr bool kFollowsErrors = false;
  static constexpr PolicyInfo kInfo{"constant", "Constant", "constant forgetting factor",
                                    "Eq. (13)"};

  T lambda = T(Scalar(0.99));

  template <class Visit>
  static constexpr void settings(Visit visit) {
    visit(SettingInfo{"lambda", Range::factor(), "1",
                      "forgetting factor, for a memory of 1 / (1 - lambda) samples; 1 is "
                      "ordinary least squares",
                      0},
          [](auto& owner) -> auto& { return owner.lambda; });
  }

  bool valid() const { return settings_valid(*this); }
  EHSID_ALWAYS_INLINE T loss() const { return T(1) - lambda; }
  EHSID_ALWAYS_INLINE void restart(const TruthOf<T>& /*where*/ = TruthOf<T>(true)) {}
  EHSID_ALWAYS_INLINE ForgettingFactors<T> peek(const Evidence<T>& /*evidence*/) const {
    return {lambda, T(1)};
  }
  EHSID_ALWAYS_INLINE void accept(const Evidence<T>& /*evidence*/,
                                  const TruthOf<T>& /*where*/ = TruthOf<T>(true)) {}
};

}  // namespace ehsid
