// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// The supply pressure falls with the flow drawn; an accumulator delays it.
template <class Scalar>
struct SupplyDroop : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "supply_droop", Subsystem::hydraulics,
      "accumulator_capacitance dp_s/dt = (p_source - p_s) / source_resistance - q_supply",
      "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 11",
      "large flows; the measured supply pressure"};
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"source_resistance_pa_s_m3", "Pa s/m^3", 0.0, 1e11, 3e9, "pressure lost over flow drawn"},
       {"accumulator_capacitance_m3_pa", "m^3/Pa", 1e-13, 1e-9, 1e-11,
        "volume stored over pressure"}}};
  std::array<Scalar, 2> parameters{};

  SupplyLine<Scalar> supply_line() const { return {parameters[0], parameters[1]}; }
};

}  // namespace ehsid::plant
