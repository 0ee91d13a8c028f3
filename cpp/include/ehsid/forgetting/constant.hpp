// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/forgetting/evidence.hpp>
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
template <class Scalar>
struct Constant {
  static constexpr std::uint32_t kId = 1;
  static constexpr bool kFollowsErrors = false;
  static constexpr PolicyInfo kInfo{"constant", "Constant", "constant forgetting factor",
                                    "Eq. (13)"};

  Scalar lambda = Scalar(0.99);

  template <class Visit>
  static constexpr void settings(Visit visit) {
    visit(SettingInfo{"lambda", Range::factor(), "1",
                      "forgetting factor, for a memory of 1 / (1 - lambda) samples; 1 is "
                      "ordinary least squares",
                      0},
          [](auto& owner) -> auto& { return owner.lambda; });
  }

  bool valid() const { return settings_valid(*this); }
  Scalar loss() const { return Scalar(1) - lambda; }
  void restart() {}
  ForgettingFactors<Scalar> peek(const Evidence<Scalar>& /*evidence*/) const {
    return {lambda, Scalar(1)};
  }
  void accept(const Evidence<Scalar>& /*evidence*/) {}
};

}  // namespace ehsid
