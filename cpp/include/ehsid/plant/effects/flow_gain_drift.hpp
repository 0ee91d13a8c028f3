// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect.hpp>

#include <array>
#include <cmath>

namespace ehsid::plant {

/// The flow through all edges changes in the course of a record, as the oil warms.
template <class Scalar>
struct FlowGainDrift : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "flow_gain_drift",
      Subsystem::valve,
      "q(t) = max(0.05, 1 + rate t) q, t from the start of the record; of the linear plant K_q x_v",
      "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 2 and 3",
      "the same motion early and late in a long record",
      "the position or the velocity",
      "oil that warms by half a kelvin per second changes the flow by 0.05 % per second"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"rate_1_s", "1/s", -0.05, 0.05, 0.01, "relative change of the flow in a second"}}};
  std::array<Scalar, 1> parameters{};

  static constexpr std::array kNeeds{Need::long_record};
  static constexpr std::array<Sizes<1>, 2> starts(const MachineScale& /*machine*/) {
    return {{{0.003}, {-0.003}}};
  }
  static bool matters(const Sizes<1>& size, const MachineScale& /*machine*/) {
    return std::abs(size[0]) >= 5e-4;
  }

  Scalar flow_share(double time) const {
    constexpr double kLeast = 0.05;
    const Scalar share = 1.0 + parameters[0] * time;
    return value_of(share) < kLeast ? Scalar(kLeast) : share;
  }
};

}  // namespace ehsid::plant
