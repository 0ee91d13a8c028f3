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
      "valve_flow_saturation",
      Subsystem::valve,
      "opening <- limit tanh(opening / limit)",
      "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 5",
      "large commands",
      "the position or the velocity",
      "a limit of 1.9 times full opening bends the flow at full opening by less than a "
      "tenth"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"limit", "1", 0.05, 2.0, 0.6, "largest opening", -0.5, "", kRatedCommand}}};
  std::array<Scalar, 1> parameters{};

  static constexpr std::array kNeeds{Need::large_commands};
  static constexpr Reach kReach = Reach::begins_at;
  static constexpr std::array<Sizes<1>, 2> starts(const MachineScale& /*machine*/) {
    return {{{0.2}, {0.6}}};
  }
  static constexpr bool matters(const Sizes<1>& size, const MachineScale& /*machine*/) {
    return size[0] < 1.9;
  }

  Scalar opening(const Scalar& x) const {
    using std::tanh;
    const Scalar& limit = parameters[0];
    return value_of(limit) > 0.0 ? limit * tanh(x / limit) : x;
  }
};

}  // namespace ehsid::plant
