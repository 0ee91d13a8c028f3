// SPDX-License-Identifier: MIT
#include <ehsid/ehsid.hpp>

#include "two_units.hpp"

float first_parameter_in_a() {
  ehsid::ArxEstimator<float, 3, 3, 1> estimator;
  for (int k = 0; k < 40; ++k) {
    static_cast<void>(estimator.step(k % 7 < 3 ? 1.0F : -1.0F, static_cast<float>(k % 5)));
  }
  return estimator.theta_hat()[0];
}

int main() {
  const float a = first_parameter_in_a();
  return a == first_parameter_in_b() && a < 0.0F ? 0 : 1;
}
