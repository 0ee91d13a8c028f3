// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/types.hpp>

namespace ehsid {

/// Guards against wind-up. Both are dimensionless: they never depend on the units of phi and y.
template <class Scalar>
struct RlsOptions {
  /// A sample is skipped where phi' P phi, the information it adds, is below `information_margin` times what
  /// the policy forgets meanwhile in one direction (1 - lambda), unless the recent errors say that the model
  /// no longer fits. A lone held direction settles at 1, full excitation at n. 0 switches the rule off;
  /// negative (default): sqrt(n), the geometric middle; off for n = 1, where one direction is all there is.
  Scalar information_margin = Scalar(-1);
  /// Backstop: the mean of P_ii / P0_ii never exceeds this. 1: never less certain than at the start.
  Scalar covariance_ceiling = Scalar(1);

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&RlsOptions::information_margin);
    visit(&RlsOptions::covariance_ceiling);
  }

  bool valid() const {
    return is_finite(information_margin) && is_finite(covariance_ceiling) &&
           covariance_ceiling > Scalar(0);
  }
};

}  // namespace ehsid
