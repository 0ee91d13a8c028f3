// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// A relief valve to tank at each working port. Above the pressure at which it cracks, its flow rises with the pressure.
template <class Scalar>
struct ReliefValve : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "relief_valve",
      Subsystem::hydraulics,
      "q_i = flow_gain max(0, p_i - pressure), from i = a, b to tank",
      "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 5",
      "braking of a heavy load and forces that drive a chamber above the pressure of the valve",
      "both pressures",
      "at a tenth of the supply pressure above its cracking pressure it passes less than 1 % of "
      "the flow of the servo valve, and a spool at null leaks as much; one that cracks below half "
      "of the supply pressure is a leakage at all times"};
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"pressure_pa", "Pa", 1e5, 1e8, 7.5e6, "absolute pressure at which it cracks", 0.0},
       {"flow_gain_m3_s_pa", "m^3/(s Pa)", 0.0, 1e-7, 2e-10, "flow over the pressure above it"}}};
  std::array<Scalar, 2> parameters{};

  static constexpr std::array kNeeds{Need::high_pressures};
  static constexpr Reach kReach = Reach::high_pressures;
  /// Most chambers are at about half of the supply pressure. A valve that cracks there acts at all times; one that
  /// cracks above the supply pressure acts in peaks only, where it must be steeper to show.
  static std::array<Sizes<2>, 2> starts(const MachineScale& machine) {
    const auto valve = [&](double share, double gain) {
      return Sizes<2>{share * machine.pressure_pa,
                      gain * machine.rated_flow_m3_s / machine.pressure_pa};
    };
    return {{valve(0.6, 0.5), valve(0.9, 3.0)}};
  }
  static bool matters(const Sizes<2>& size, const MachineScale& machine) {
    return size[0] >= 0.5 * machine.pressure_pa &&
           size[1] * 0.1 * machine.pressure_pa >= 0.01 * machine.full_flow_m3_s;
  }

  Leakage<Scalar> leakage(const Scalar& p_a, const Scalar& p_b, const Scalar& /*p_tank*/) const {
    return {flow(p_a), flow(p_b)};
  }
  Scalar leakage_slope(const Scalar& p, const Scalar& ahead, const Scalar& /*p_tank*/) const {
    return parameters[1] * share_beyond(p, ahead, parameters[0]);
  }

 private:
  Scalar flow(const Scalar& p) const {
    const Scalar above = p - parameters[0];
    return value_of(above) > 0.0 ? parameters[1] * above : Scalar(0.0);
  }
};

}  // namespace ehsid::plant
