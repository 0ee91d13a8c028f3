// SPDX-License-Identifier: MIT
// The bodies behind make_gradient_estimator(): the recursions of output_error.hpp and armax.hpp for any order.
#pragma once

#include "estimator_instances.hpp"

#include <ehsid/armax.hpp>
#include <ehsid/output_error.hpp>

namespace ehsid::bindings {

template <class Scalar, class Policy>
std::unique_ptr<AnyEstimator> make_with_policy(const EstimatorSettings& settings,
                                               const Policy& policy) {
  constexpr int kNa = up_to(kMaxOrder);
  switch (settings.method) {
    case Method::instrumental_variables:
      return std::make_unique<
          EstimatorInstance<Scalar, Policy, InstrumentalVariables<Scalar, kNa, kSize, Policy>>>(
          settings, policy);
    case Method::output_error:
      return std::make_unique<
          EstimatorInstance<Scalar, Policy, OutputError<Scalar, kNa, kSize, Policy>>>(settings,
                                                                                      policy);
    default:
      return std::make_unique<EstimatorInstance<Scalar, Policy, Armax<Scalar, kNa, kSize, Policy>>>(
          settings, policy);
  }
}

template <class Scalar>
std::unique_ptr<AnyEstimator> make_gradient_estimator(const EstimatorSettings& settings) {
  return std::visit(
      [&](const auto& forgetting) -> std::unique_ptr<AnyEstimator> {
        const auto policy = to_policy<Scalar>(forgetting, settings.n());
        using Policy = std::decay_t<decltype(policy)>;
        if constexpr (std::is_same_v<Policy, Constant<Scalar>> ||
                      std::is_same_v<Policy, Exponential<Scalar>>) {
          return make_with_policy<Scalar>(settings, policy);
        } else {
          throw std::invalid_argument(
              "method riv, oe and armax take the policies Constant and Exponential only; pass one "
              "of them as forgetting, e.g. Exponential(lambda0=0.995, lambda_initial=0.98)");
        }
      },
      settings.forgetting);
}

}  // namespace ehsid::bindings
