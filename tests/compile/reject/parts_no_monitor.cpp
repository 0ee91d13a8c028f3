// SPDX-License-Identifier: MIT
// expected: settled() needs kConvergence among the parts
#include <ehsid/ehsid.hpp>

bool settled() {
#ifdef CORRECTED
  const ehsid::ArxEstimator<float, 3, 3, 1> estimator;
#else
  const ehsid::SmallArxEstimator<float, 3, 3, 1> estimator;
#endif
  return estimator.settled();
}
