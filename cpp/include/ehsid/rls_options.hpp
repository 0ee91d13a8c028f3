// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/types.hpp>

#include <limits>

namespace ehsid {

/// Guards against wind-up. Both are dimensionless: they never depend on the units of phi and y.
template <class Scalar>
struct RlsOptions {
  /// Where the samples of the last memory told too little about some parameter, forgetting waits, for two and a half
  /// memories at most. After that a sample is skipped where phi' P phi, the information it adds, is below
  /// `information_margin` times what the policy forgets in one direction (1 - lambda), unless the recent errors say that
  /// the model no longer fits. A lone held direction settles at 1, full excitation at n. 0 switches the rule off, also
  /// for phi = 0; negative (default): sqrt(n), the geometric middle; off for n = 1, where one direction is all there is.
  Scalar information_margin = Scalar(-1);
  /// Backstop: the mean of P_ii / P0_ii never exceeds this. 1: never less certain than at the start.
  Scalar covariance_ceiling = Scalar(1);

  /// No guard: Eqs. (12)-(14) as they are printed, with the forgetting of the policy.
  static constexpr RlsOptions textbook() { return {Scalar(0), std::numeric_limits<Scalar>::max()}; }

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
