// SPDX-License-Identifier: MIT
// expected: this is no forgetting policy
#include <ehsid/ehsid.hpp>

#ifdef CORRECTED
ehsid::ArxEstimator<float, 3, 3, 1, ehsid::Constant<float>> estimator;
#else
struct Mine {
  float lambda = 0.99F;
};
ehsid::ArxEstimator<float, 3, 3, 1, Mine> estimator;
#endif
