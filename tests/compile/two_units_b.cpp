// SPDX-License-Identifier: MIT
#include <ehsid/ehsid.hpp>

#include "two_units.hpp"

float first_parameter_in_b() {
  ehsid::ArxEstimator<float, 3, 3, 1> estimator;
  for (int k = 0; k < 40; ++k) {
    static_cast<void>(estimator.step(k % 7 < 3 ? 1.0F : -1.0F, static_cast<float>(k % 5)));
  }
  return estimator.theta_hat()[0];
}
