// SPDX-License-Identifier: MIT
// An effect that only the tests have, as somebody would write one: all that is known of it stands here.
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// A spring that hardens: its force grows with the cube of the distance from mid-stroke.
template <class Scalar>
struct HardSpring : Effect<Scalar> {
  static constexpr EffectInfo kInfo{"hard_spring",
                                    Subsystem::mechanics,
                                    "F = stiffness (y - stroke / 2)^3",
                                    "Duffing, Erzwungene Schwingungen, Vieweg 1918",
                                    "positions over much of the stroke",
                                    "both pressures",
                                    "a force of 1 % at the end of the stroke"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"stiffness_n_m3", "N/m^3", 0.0, 1e10, 2e7, "force over the cube of the distance"}}};
  std::array<Scalar, 1> parameters{};

  static constexpr std::array kNeeds{Need::wide_travel};
  static std::array<Sizes<1>, 2> starts(const MachineScale& machine) {
    const double reach = 0.5 * machine.stroke_m;
    const double full = machine.force_n / (reach * reach * reach);
    return {{{0.1 * full}, {0.4 * full}}};
  }
  static bool matters(const Sizes<1>& size, const MachineScale& machine) {
    const double reach = 0.5 * machine.stroke_m;
    return size[0] * reach * reach * reach >= 0.01 * machine.force_n;
  }

  Scalar load(const Scalar& from_middle) const {
    return parameters[0] * from_middle * from_middle * from_middle;
  }
};

}  // namespace ehsid::plant
