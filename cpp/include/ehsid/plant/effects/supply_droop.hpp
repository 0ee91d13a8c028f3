// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// The supply pressure falls with the flow drawn; an accumulator delays it.
template <class Scalar>
struct SupplyDroop : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "supply_droop",
      Subsystem::hydraulics,
      "accumulator_capacitance dp_s/dt = (p_source - p_s) / source_resistance - q_supply",
      "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 11",
      "large flows; the measured supply pressure",
      "the supply pressure; without it both pressures",
      "the gauge of the supply is not better than 1 %"};
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"source_resistance_pa_s_m3", "Pa s/m^3", 0.0, 1e11, 3e9, "pressure lost over flow drawn"},
       {"accumulator_capacitance_m3_pa", "m^3/Pa", 1e-13, 1e-9, 1e-11,
        "volume stored over pressure", 0.0}}};
  std::array<Scalar, 2> parameters{};

  static constexpr std::array kNeeds{Need::large_commands};
  /// Resistance and capacitance have a time constant of 20 ms.
  static std::array<Sizes<2>, 2> starts(const MachineScale& machine) {
    const auto droop = [&](double share) {
      return Sizes<2>{share * machine.pressure_pa / machine.rated_flow_m3_s,
                      0.02 * machine.rated_flow_m3_s / (share * machine.pressure_pa)};
    };
    return {{droop(0.05), droop(0.2)}};
  }
  static bool matters(const Sizes<2>& size, const MachineScale& machine) {
    return size[0] * machine.full_flow_m3_s >= 0.01 * machine.pressure_pa;
  }

  SupplyLine<Scalar> supply_line() const { return {parameters[0], parameters[1]}; }
};

}  // namespace ehsid::plant
