// SPDX-License-Identifier: MIT
// The recursion of instrumental_variables.hpp for any order.
#include "estimator_instances.hpp"

#include <ehsid/instrumental_variables.hpp>

namespace ehsid::bindings {

template <class Scalar>
std::unique_ptr<AnyEstimator> make_instrumental_estimator(const EstimatorSettings& settings) {
  return std::visit(
      [&](const auto& forgetting) -> std::unique_ptr<AnyEstimator> {
        const auto policy = to_policy<Scalar>(forgetting);
        using Policy = std::decay_t<decltype(policy)>;
        if constexpr (std::is_same_v<Policy, Constant<Scalar>> ||
                      std::is_same_v<Policy, Exponential<Scalar>>) {
          using Recursion = InstrumentalVariables<Scalar, up_to(kMaxOrder), kSize, Policy>;
          if (settings.integrator) {
            using Model = Integrating<AnyArx<Scalar, kSize>>;
            return std::make_unique<EstimatorInstance<Scalar, Policy, Recursion, Model>>(settings,
                                                                                         policy);
          }
          return std::make_unique<EstimatorInstance<Scalar, Policy, Recursion>>(settings, policy);
        } else {
          throw std::invalid_argument(
              "method riv takes the policies Constant and Exponential only; pass one of them as "
              "forgetting, e.g. Exponential(lambda0=0.995, lambda_initial=0.98)");
        }
      },
      settings.forgetting);
}

template std::unique_ptr<AnyEstimator> make_instrumental_estimator<float>(const EstimatorSettings&);
template std::unique_ptr<AnyEstimator> make_instrumental_estimator<double>(
    const EstimatorSettings&);

}  // namespace ehsid::bindings
