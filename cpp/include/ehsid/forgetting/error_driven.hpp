// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/forgetting/evidence.hpp>

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

  Scalar memory = Scalar(100);        // N0, samples, >= 1
  Scalar lambda_min = Scalar(0.5);    // (0, 1]
  Scalar noise_variance = Scalar(0);  // sigma0^2, squared units of the output as estimated; 0: own

  bool valid() const {
    return is_finite(memory) && memory >= Scalar(1) && is_forgetting_factor(lambda_min) &&
           is_finite(noise_variance) && noise_variance >= Scalar(0);
  }
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
