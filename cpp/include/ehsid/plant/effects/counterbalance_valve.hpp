// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// A counterbalance valve at each working port: returning oil passes it only where the load, helped by the pilot pressure
/// of the other port, lifts its poppet. Oil into the chamber passes a check valve beside it.
template <class Scalar>
struct CounterbalanceValve : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "counterbalance_valve",
      Subsystem::hydraulics,
      "the edge from i to tank passes a share s_i, 0.01 s_i' + s_i = (p_i + pilot_ratio p_j - "
      "pressure) "
      "/ (0.2 pressure) within 0 to 1, j the other chamber",
      "Handroos, Halme, Vilenius, 3rd Scandinavian Int. Conf. Fluid Power, Linkoping 1993",
      "a load that pulls the rod, and changes from pushing to pulling",
      "both pressures",
      "one that stands wide open with half of the supply pressure in both chambers does not "
      "throttle"};
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"pressure_pa", "Pa", 1e5, 1e8, 2.4e7, "at which it opens without its pilot"},
       {"pilot_ratio", "1", 0.2, 20.0, 3.0, "of the area of the pilot to that of the poppet",
        0.0}}};
  std::array<Scalar, 2> parameters{};

  static constexpr std::array kNeeds{Need::chamber_pressures};
  static constexpr std::array<Sizes<2>, 2> starts(const MachineScale& machine) {
    return {{{1.3 * machine.pressure_pa, 3.0}, {2.2 * machine.pressure_pa, 4.0}}};
  }
  static constexpr bool matters(const Sizes<2>& size, const MachineScale& machine) {
    return 0.5 * machine.pressure_pa * (1.0 + size[1]) < 1.2 * size[0];
  }

  Counterbalance<Scalar> counterbalance() const { return {parameters[0], parameters[1]}; }
};

}  // namespace ehsid::plant
