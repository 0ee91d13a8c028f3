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
/// Default: N0 = 100 samples, lambda_min = 0.5. noise_variance = 0 (default) takes the estimator's own
/// residual variance for sigma0^2, a departure from the paper, which has the user give it.
template <class Scalar>
struct ErrorDriven {
  static constexpr std::uint32_t kId = 3;
  static constexpr bool kSpreads = false;
  static constexpr bool kFilters = false;
  static constexpr PolicyInfo kInfo{"error_driven", "ErrorDriven",
                                    "a large error shortens the memory",
                                    "Fortescue, Kershenbaum, Ydstie 1981"};

  Scalar memory = Scalar(100);  // N0
  Scalar lambda_min = Scalar(0.5);
  Scalar noise_variance = Scalar(0);  // sigma0^2

  template <class Visit>
  static constexpr void settings(Visit visit) {
    visit(SettingInfo{"memory", Range::at_least(1.0), "samples",
                      "N0, the memory in the steady state", 3},
          [](auto& owner) -> auto& { return owner.memory; });
    visit(SettingInfo{"lambda_min", Range::factor(), "1",
                      "the forgetting factor never goes below this", 4},
          [](auto& owner) -> auto& { return owner.lambda_min; });
    visit(SettingInfo{"noise_variance", Range::at_least(0.0), "1",
                      "sigma0^2, in squared units of the scaled output; 0 takes the estimator's "
                      "own residual variance",
                      5},
          [](auto& owner) -> auto& { return owner.noise_variance; });
  }

  bool valid() const { return settings_valid(*this); }
  /// The mean loss a step by design; not that of this step, or the choice of samples to skip would depend on
  /// their errors and bias the residual variance.
  template <class Factors>
  Scalar loss(const Factors& /*factors*/) const {
    return Scalar(1) / memory;
  }
  void restart() {}
  ForgettingFactors<Scalar> peek(const Evidence<Scalar>& evidence) const {
    const Scalar variance =
        noise_variance > Scalar(0) ? noise_variance : evidence.residual_variance;
    // 1 - phi' K = 1 / (1 + phi' P phi): K is the gain of the step before forgetting
    const Scalar error =
        evidence.innovation * evidence.innovation / (Scalar(1) + evidence.regressor_variance);
    const Scalar allowance = variance * memory;
    if (!(error < (Scalar(1) - lambda_min) * allowance)) {
      return {Scalar(1), allowance > Scalar(0) ? lambda_min : Scalar(1)};
    }
    return {Scalar(1), Scalar(1) - error / allowance};
  }
  void accept(const Evidence<Scalar>& /*evidence*/) {}
};

}  // namespace ehsid
