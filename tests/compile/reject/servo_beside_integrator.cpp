// SPDX-License-Identifier: MIT
// expected: na = 3 (2 beside a known integrator)
#include <ehsid/ehsid.hpp>

#ifdef CORRECTED
using Estimator = ehsid::IntegratingRlsEstimator<float, 2, 3, 1>;
#else
using Estimator = ehsid::IntegratingRlsEstimator<float, 3, 3, 1>;
#endif
ehsid::ServoReading<float> servo(const Estimator& estimator) { return estimator.servo(0.001F); }
