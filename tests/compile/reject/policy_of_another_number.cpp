// SPDX-License-Identifier: MIT
// expected: the forgetting policy computes in another number than the estimator
#include <ehsid/ehsid.hpp>

#ifdef CORRECTED
ehsid::ArxEstimator<float, 3, 3, 1, ehsid::FRatio<float>> estimator;
#else
ehsid::ArxEstimator<float, 3, 3, 1, ehsid::FRatio<double>> estimator;
#endif
