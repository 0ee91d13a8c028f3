// SPDX-License-Identifier: MIT
// What every program does once for each forgetting policy.
#pragma once

#include <ehsid/arx_estimator.hpp>
#include <ehsid/forgetting.hpp>

namespace firmware {

template <class Forgetting>
using Estimator = ehsid::ArxEstimator<float, 3, 3, 1, Forgetting>;

/// visit(policy, name), in the order of tests/golden/trace.csv.
template <class Visit>
void every_policy(Visit&& visit) {
  ehsid::for_each_policy([&](auto place) {
    using Policy = ehsid::PolicyAt<place, float>;
    visit(Policy{}, Policy::kInfo.type);
  });
}

}  // namespace firmware
