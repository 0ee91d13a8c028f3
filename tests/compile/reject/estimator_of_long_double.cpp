// SPDX-License-Identifier: MIT
// expected: Rls needs float or double
#include <ehsid/ehsid.hpp>

#ifdef CORRECTED
ehsid::ArxEstimator<float, 3, 3, 1> estimator;
#else
ehsid::ArxEstimator<long double, 3, 3, 1> estimator;
#endif
