// SPDX-License-Identifier: MIT
#include "gradient_instances.hpp"

namespace ehsid::bindings {

template std::unique_ptr<AnyEstimator> make_gradient_estimator<float>(const EstimatorSettings&);

}  // namespace ehsid::bindings
