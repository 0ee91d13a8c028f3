// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>
#include <cmath>

namespace ehsid::plant {

/// The transducers of the chamber pressures have a wrong zero.
template <class Scalar>
struct PressureSensorOffset : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "pressure_sensor_offset",
      Subsystem::sensor,
      "m_i = p_i + offset_i, i = a, b",
      "Fraden, Handbook of Modern Sensors, 4th ed., Springer 2010, ch. 2",
      "any; large commands in both directions tell it from a load",
      "both pressures; the supply pressure tells equal offsets from another supply",
      "transducers with an error of 0.5 % of twice the supply pressure are sound, and pressures "
      "above the atmosphere are one bar below absolute ones"};
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"offset_a_pa", "Pa", -5e6, 5e6, 6e5, "reading less pressure at the cap side"},
       {"offset_b_pa", "Pa", -5e6, 5e6, -4e5, "reading less pressure at the rod side"}}};
  std::array<Scalar, 2> parameters{};

  static constexpr std::array kNeeds{Need::chamber_pressures};
  static constexpr LogPlace kLogPlace = LogPlace::pressures;
  /// The readings are linear in the offsets: any start will do.
  static constexpr std::array<Sizes<2>, 1> starts(const MachineScale& machine) {
    return {{{0.02 * machine.pressure_pa, 0.02 * machine.pressure_pa}}};
  }
  static bool matters(const Sizes<2>& size, const MachineScale& machine) {
    constexpr double kAtmosphere = 1.2e5;  // Pa, with what a zero may drift besides
    return std::fmax(std::abs(size[0]), std::abs(size[1])) >=
           std::fmax(kAtmosphere, 0.01 * machine.pressure_pa);
  }

  ChamberPressures<Scalar> start_pressure_sensors(const ChamberPressures<Scalar>& p) {
    return {p.a + parameters[0], p.b + parameters[1]};
  }
  ChamberPressures<Scalar> sense_pressures(const ChamberPressures<Scalar>& p, double /*h*/) {
    return start_pressure_sensors(p);
  }
};

}  // namespace ehsid::plant
