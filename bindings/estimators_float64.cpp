// SPDX-License-Identifier: MIT
#include "estimator_instances.hpp"

namespace ehsid::bindings {

template std::unique_ptr<AnyRls> make_rls<double>(const RlsSettings&);
template std::unique_ptr<AnyEstimator> make_estimator<double>(const EstimatorSettings&);

}  // namespace ehsid::bindings
