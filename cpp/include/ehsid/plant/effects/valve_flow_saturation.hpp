// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect.hpp>

#include <array>
#include <cmath>

namespace ehsid::plant {

/// The flow stops growing with the opening.
template <class Scalar>
struct ValveFlowSaturation : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "valve_flow_saturation", Subsystem::valve, "opening <- limit tanh(opening / limit)",
      "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 5", "large commands"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"limit", "1", 0.05, 2.0, 0.6, "largest opening"}}};
  std::array<Scalar, 1> parameters{};

  Scalar opening(const Scalar& x) const {
    using std::tanh;
    const Scalar& limit = parameters[0];
    return value_of(limit) > 0.0 ? limit * tanh(x / limit) : x;
  }
};

}  // namespace ehsid::plant
