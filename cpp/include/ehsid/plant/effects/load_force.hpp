// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>
#include <cmath>

namespace ehsid::plant {

/// A constant force, such as gravity.
template <class Scalar>
struct LoadForce : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "load_force",
      Subsystem::mechanics,
      "F = force",
      "Newton",
      "motion in both directions; both pressures",
      "both pressures; on an axis the position",
      "zero errors of pressure sensors and the atmosphere on the rod look like forces of "
      "a per cent; an axis has neither, so its limit is 0.3 %"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"force_n", "N", -5e6, 5e6, 800.0, "positive opposes extension"}}};
  std::array<Scalar, 1> parameters{};

  static constexpr LogPlace kLogPlace = LogPlace::command_of_axis;
  static std::array<Sizes<1>, 2> starts(const MachineScale& machine) {
    const double force = 0.04 * machine.force_n;
    return {{{force}, {-force}}};
  }
  static bool matters(const Sizes<1>& size, const MachineScale& machine) {
    return std::abs(size[0]) >= (machine.has_valve ? 0.01 : 0.003) * machine.force_n;
  }

  Scalar load(const Scalar& /*from_middle*/) const { return parameters[0]; }
};

}  // namespace ehsid::plant
