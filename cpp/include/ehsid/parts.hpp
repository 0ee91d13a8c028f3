// SPDX-License-Identifier: MIT
// Parts that an estimator may do without. What is left out costs no flash, no RAM and no time (docs/budgets.md).
#pragma once

namespace ehsid {

/// All parts, the default. What stays in every estimator: each step is checked before it is kept, P has a ceiling, a sample
/// of zeros is left out, and one with NaN or Inf is refused.
struct AllParts {
  /// Forgetting waits, and samples are left out, while some parameter is not excited (information_account.hpp). Without it
  /// forgetting winds P up in a hold, as far as its ceiling.
  static constexpr bool kInformation = true;
  /// theta is a compensated sum. Without it steps below the last digit of theta are lost, which matters in float32 for
  /// lambda above 0.999 or so.
  static constexpr bool kCompensation = true;
  /// The start values are kept: reset() and reset_all() go back to them. Needed by kReset.
  static constexpr bool kStart = true;
  /// A change of the plant is detected, and the recursion begins anew (reset.hpp).
  static constexpr bool kReset = true;
  /// settled() and excitation() (monitor.hpp).
  static constexpr bool kConvergence = true;
  /// Whether the residuals are white, and converged(), which needs kConvergence, too (whiteness.hpp). Without it nothing
  /// tells that noise on the position sensor biases theta.
  static constexpr bool kWhiteness = true;
};

/// None of them. Derive from it to have some: struct Mine : NoParts { static constexpr bool kReset = true; ... };
struct NoParts {
  static constexpr bool kInformation = false;
  static constexpr bool kCompensation = false;
  static constexpr bool kStart = false;
  static constexpr bool kReset = false;
  static constexpr bool kConvergence = false;
  static constexpr bool kWhiteness = false;
};

/// Stands where a part is left out.
struct Nothing {
  template <class Visit>
  static constexpr void fields(Visit /*visit*/) {}
};

/// The same for a monitor, which then sees every sample and says nothing.
struct NoMonitor {
  using State = Nothing;

  static constexpr void restart() {}
  template <class... Sample>
  static constexpr void updated(const Sample&... /*sample*/) {}
  template <class... Sample>
  static constexpr void skipped(const Sample&... /*sample*/) {}
  static constexpr void interrupted() {}
  static constexpr State state() { return {}; }
  static constexpr void restore(const State& /*saved*/) {}
  static constexpr bool usable(const State& /*saved*/) { return true; }
};

}  // namespace ehsid
