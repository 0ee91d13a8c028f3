// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/forgetting/evidence.hpp>
#include <ehsid/forgetting/select.hpp>
#include <ehsid/forgetting/settings.hpp>

#include <limits>

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
template <class T>
struct ErrorDriven {
  using Scalar = ScalarOf<T>;
  using Count = CountOf<T>;
  template <class Lanes>
  using Over = ErrorDriven<Lanes>;
  static constexpr std::uint32_t kId = 3;
  static constexpr bool kFollowsErrors = true;
  static constexpr PolicyInfo kInfo{"error_driven", "ErrorDriven",
                                    "a large error shortens the memory",
                                    "Fortescue, Kershenbaum, Ydstie 1981"};

  T memory = T(100);  // N0
  T lambda_min = T(Scalar(0.5));
  T noise_variance = T(0);  // sigma0^2
  T mean_square = T(0);     // the own estimate of it, state
  Count seen = Count(0);    // samples since the restart, up to kMostSeen

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
  EHSID_ALWAYS_INLINE T loss() const { return T(1) / memory; }
  EHSID_ALWAYS_INLINE void restart(const TruthOf<T>& where = TruthOf<T>(true)) {
    mean_square = select(where, T(0), mean_square);
    seen = select(where, Count(0), seen);
  }
  EHSID_ALWAYS_INLINE ForgettingFactors<T> peek(const Evidence<T>& evidence) const {
    const TruthOf<T> given = noise_variance > T(0);
    const TruthOf<T> known = either(given, seen >= Count(kFirst));
    T after(1);
    if (any(known)) {
      const T allowance = select(given, noise_variance, mean_square) * memory;
      const T error = posterior_square(evidence);
      const TruthOf<T> small = error < (T(1) - lambda_min) * allowance;
      after = select(allowance > T(0), lambda_min, after);
      if (any(small)) {
        after = select(small, T(1) - error / allowance, after);
      }
      after = select(known, after, T(1));
    }
    return {T(1), after};
  }
  EHSID_ALWAYS_INLINE void accept(const Evidence<T>& evidence,
                                  const TruthOf<T>& where = TruthOf<T>(true)) {
    const T samples = static_cast<T>(seen + Count(1));
    const T rate = T(1) / smaller(samples, memory);
    const T most = mean_square * larger(T(kMostSquare) * rate, T(kMostRise));
    const T unlimited(std::numeric_limits<Scalar>::infinity());
    const TruthOf<T> limited = both(seen >= Count(kFirst), mean_square > T(0));
    const T step = smaller(rate * (posterior_square(evidence) - mean_square),
                           select(limited, most, unlimited));
    mean_square = select(where, mean_square + step, mean_square);
    seen = select(both(where, seen < Count(kMostSeen)), seen + Count(1), seen);
  }

 private:
  static constexpr int kFirst = 20;  // samples before the mean of their squares says something
  static constexpr int kMostSeen = 1 << 20;  // where the count stops
  static constexpr Scalar kMostRise = Scalar(1) / Scalar(16);
  static constexpr Scalar kMostSquare = Scalar(8);  // what a square may add, in units of the mean

  static constexpr Scalar kMost = Scalar(1e18);  // its square and sums of it are finite

  /// (1 - phi' K) epsilon^2, at most kMost, with 1 - phi' K = 1 / (1 + phi' P phi): K is the gain of the step before
  /// forgetting.
  EHSID_ALWAYS_INLINE static T posterior_square(const Evidence<T>& evidence) {
    const T square =
        evidence.innovation * evidence.innovation / (T(1) + evidence.regressor_variance);
    return smaller(square, T(kMost));
  }
};

}  // namespace ehsid
