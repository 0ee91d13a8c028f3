// SPDX-License-Identifier: MIT
// y(k) = 0.9 y(k-1) + 0.1 u(k-1), found from its own record.
#include <ehsid/ehsid.hpp>

#include <cmath>

int main() {
  ehsid::ArxEstimator<double, 1, 1, 1, ehsid::Constant<double>> estimator;
  double y = 0.0;
  for (int k = 0; k < 500; ++k) {
    const double u = k % 7 < 3 ? 1.0 : -1.0;
    if (ehsid::is_error(estimator.step(u, y))) {
      return 1;
    }
    y = 0.9 * y + 0.1 * u;
  }
  const bool found = std::abs(estimator.theta_hat()[0] + 0.9) < 1e-3 &&
                     std::abs(estimator.theta_hat()[1] - 0.1) < 1e-3;
  return found ? 0 : 2;
}
