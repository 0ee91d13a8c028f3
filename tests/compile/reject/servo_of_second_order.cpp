// SPDX-License-Identifier: MIT
// expected: servo() reads a model of third order
#include <ehsid/ehsid.hpp>

#ifdef CORRECTED
ehsid::ServoReading<float> servo(const ehsid::ArxEstimator<float, 3, 3, 1>& estimator) {
#else
ehsid::ServoReading<float> servo(const ehsid::ArxEstimator<float, 2, 2, 1>& estimator) {
#endif
  return estimator.servo(0.001F);
}
