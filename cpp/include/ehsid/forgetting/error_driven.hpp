// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/forgetting/evidence.hpp>
#include <ehsid/forgetting/settings.hpp>

namespace ehsid {

/// Variable forgetting factor that keeps the information in the estimate constant: a large error
/// shortens the memory, a small one lengthens it.
///
/// Source: T. R. Fortescue, L. S. Kershenbaum, B. E. Ydstie, "Implementation of self-tuning
/// regulators with variable forgetting factors", Automatica 17(6), 1981, pp. 831-835.
/// Equation: lambda(k) = 1 - (1 - phi' K) epsilon(k)^2 / (sigma0^2 N0), with K the gain of the step and
/// P divided by lambda(k) after the measurement; never below lambda_min.
/// Guarantee: in the steady state the memory is about N0 samples, and the loss of information a
/// step is bounded by lambda_min. It does not bound P without excitation: the estimator's own
/// guards do.
/// Cost: one division, four multiplications.
/// Default: N0 = 100 samples, lambda_min = 0.5. noise_variance = 0 (default) takes an own estimate for sigma0^2, a
/// departure from the paper, which has the user give it: the mean of (1 - phi' K) epsilon^2 over about N0 samples, from
/// the 20th on, which rises by no more than a sixteenth in a step, so that the errors of a changed plant do not pass for
/// noise. The estimator's residual variance would: as the memory gets short, it follows these errors at once.
template <class Scalar>
struct ErrorDriven {
  static constexpr std::uint32_t kId = 3;
  static constexpr bool kFollowsErrors = true;
  static constexpr PolicyInfo kInfo{"error_driven", "ErrorDriven",
                                    "a large error shortens the memory",
                                    "Fortescue, Kershenbaum, Ydstie 1981"};

  Scalar memory = Scalar(100);  // N0
  Scalar lambda_min = Scalar(0.5);
  Scalar noise_variance = Scalar(0);  // sigma0^2
  Scalar mean_square = Scalar(0);     // the own estimate of it, state
  std::int32_t seen = 0;              // samples since the restart, up to kMostSeen

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&ErrorDriven::mean_square);
    visit(&ErrorDriven::seen);
  }

  template <class Visit>
  static constexpr void settings(Visit visit) {
    visit(SettingInfo{"memory", Range::at_least(1.0), "samples",
                      "N0, the memory in the steady state", 3},
          [](auto& owner) -> auto& { return owner.memory; });
    visit(SettingInfo{"lambda_min", Range::factor(), "1",
                      "the forgetting factor never goes below this", 4},
          [](auto& owner) -> auto& { return owner.lambda_min; });
    visit(SettingInfo{"noise_variance", Range::at_least(0.0), "1",
                      "sigma0^2, in squared units of the scaled output; 0 estimates it", 5},
          [](auto& owner) -> auto& { return owner.noise_variance; });
  }

  bool valid() const {
    return settings_valid(*this) && is_variance(mean_square) && seen >= 0 && seen <= kMostSeen;
  }
  /// The mean loss a step by design; not that of this step, or the choice of samples to skip would depend on
  /// their errors and bias the residual variance.
  Scalar loss() const { return Scalar(1) / memory; }
  void restart() {
    mean_square = Scalar(0);
    seen = 0;
  }
  ForgettingFactors<Scalar> peek(const Evidence<Scalar>& evidence) const {
    const bool given = noise_variance > Scalar(0);
    if (!given && seen < kFirst) {
      return {Scalar(1), Scalar(1)};
    }
    const Scalar variance = given ? noise_variance : mean_square;
    const Scalar error = posterior_square(evidence);
    const Scalar allowance = variance * memory;
    if (!(error < (Scalar(1) - lambda_min) * allowance)) {
      return {Scalar(1), allowance > Scalar(0) ? lambda_min : Scalar(1)};
    }
    return {Scalar(1), Scalar(1) - error / allowance};
  }
  void accept(const Evidence<Scalar>& evidence) {
    const auto samples = Scalar(seen + 1);
    const Scalar rate = Scalar(1) / (samples < memory ? samples : memory);
    Scalar step = rate * (posterior_square(evidence) - mean_square);
    if (seen >= kFirst && mean_square > Scalar(0)) {
      const Scalar outlier = kMostSquare * rate;
      const Scalar most = mean_square * (outlier > kMostRise ? outlier : kMostRise);
      step = step < most ? step : most;
    }
    mean_square += step;
    seen = seen < kMostSeen ? seen + 1 : kMostSeen;
  }

 private:
  template <class, class>
  friend struct bank::LanesOf;

  static constexpr std::int32_t kFirst =
      20;  // samples before the mean of their squares says something
  static constexpr std::int32_t kMostSeen = 1 << 20;  // where the count stops
  static constexpr Scalar kMostRise = Scalar(1) / Scalar(16);
  static constexpr Scalar kMostSquare = Scalar(8);  // what a square may add, in units of the mean

  static constexpr Scalar kMost = Scalar(1e18);  // its square and sums of it are finite

  /// (1 - phi' K) epsilon^2, at most kMost, with 1 - phi' K = 1 / (1 + phi' P phi): K is the gain of the step before forgetting.
  static Scalar posterior_square(const Evidence<Scalar>& evidence) {
    const Scalar s = evidence.regressor_variance;
    const Scalar square = evidence.innovation * evidence.innovation / (Scalar(1) + s);
    return square < kMost ? square : kMost;
  }
};

}  // namespace ehsid
