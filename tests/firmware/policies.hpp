// SPDX-License-Identifier: MIT
// What every program does once for each forgetting policy.
#pragma once

#include <ehsid/servo_estimator.hpp>

namespace firmware {

template <class Forgetting>
using Estimator = ehsid::ServoEstimator<float, 3, 3, 1, Forgetting>;

/// visit(policy, name), in the order of tests/golden/trace.csv.
template <class Visit>
void every_policy(Visit&& visit) {
  visit(ehsid::Constant<float>{}, "Constant");
  visit(ehsid::Exponential<float>{}, "Exponential");
  visit(ehsid::ErrorDriven<float>{}, "ErrorDriven");
  visit(ehsid::FRatio<float>{}, "FRatio");
  visit(ehsid::Directional<float>{}, "Directional");
  visit(ehsid::RandomWalk<float, 6>{}, "RandomWalk");
}

}  // namespace firmware
