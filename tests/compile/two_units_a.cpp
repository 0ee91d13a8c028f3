// SPDX-License-Identifier: MIT
#include <ehsid/ehsid.hpp>

#include "two_units.hpp"

namespace {
/// A user's aggregate of estimators: `Axis{}` needs default constructors that are not explicit.
struct Axis {
  ehsid::ArxEstimator<float, 3, 3, 1> model;
  ehsid::Rls<float, 2, ehsid::Constant<float>> line;
  ehsid::InstrumentalArxEstimator<float, 3, 3, 1> noisy;
  ehsid::ServoEstimator<float> servo;
};
}  // namespace

float first_parameter_in_a() {
  ehsid::ArxEstimator<float, 3, 3, 1> estimator;
  for (int k = 0; k < 40; ++k) {
    static_cast<void>(estimator.step(k % 7 < 3 ? 1.0F : -1.0F, static_cast<float>(k % 5)));
  }
  return estimator.theta_hat()[0];
}

int main() {
  const float a = first_parameter_in_a();
  const Axis axis{};
  const bool fresh = axis.line.size() == 2 && axis.noisy.size() == 6 && !axis.model.settled();
  return a == first_parameter_in_b() && a < 0.0F && fresh ? 0 : 1;
}
