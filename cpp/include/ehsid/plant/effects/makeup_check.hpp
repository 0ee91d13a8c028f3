// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// A check valve from tank at each working port: it fills a chamber that is drawn below the tank pressure, against
/// cavities.
template <class Scalar>
struct MakeupCheck : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "makeup_check",
      Subsystem::hydraulics,
      "q_i = flow_gain max(0, p_tank - pressure - p_i), from tank to i = a, b",
      "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 6",
      "braking of a heavy load: it draws a chamber below the tank pressure",
      "both pressures, low ones above all",
      "at one bar below the tank pressure it passes less than 1 % of the flow of the servo valve, "
      "and a spool at null leaks as much"};
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"pressure_pa", "Pa", 0.0, 1e6, 3e4, "pressure below that of the tank at which it cracks",
        0.0},
       {"flow_gain_m3_s_pa", "m^3/(s Pa)", 0.0, 1e-6, 2e-9, "flow over the pressure below it"}}};
  std::array<Scalar, 2> parameters{};

  static constexpr std::array kNeeds{Need::low_pressures};
  static constexpr double kBar = 1e5;     // Pa
  static constexpr double kSpring = 3e4;  // Pa
  static std::array<Sizes<2>, 2> starts(const MachineScale& machine) {
    const auto valve = [&](double share) {
      return Sizes<2>{kSpring, share * machine.rated_flow_m3_s / kBar};
    };
    return {{valve(0.1), valve(0.6)}};
  }
  /// A valve that opens at vacuum only is none: there a cavity fills in ways that no simulator knows.
  static bool matters(const Sizes<2>& size, const MachineScale& machine) {
    return size[1] * (kBar - size[0]) >= 0.01 * machine.full_flow_m3_s;
  }

  Leakage<Scalar> leakage(const Scalar& p_a, const Scalar& p_b, const Scalar& p_tank) const {
    const Scalar cracks_at = p_tank - parameters[0];
    return {flow(p_a - cracks_at), flow(p_b - cracks_at)};
  }
  Scalar leakage_slope(const Scalar& p, const Scalar& ahead, const Scalar& p_tank) const {
    return parameters[1] * share_beyond(-p, -ahead, parameters[0] - p_tank);
  }

 private:
  Scalar flow(const Scalar& above) const {
    return value_of(above) < 0.0 ? parameters[1] * above : Scalar(0.0);
  }
};

}  // namespace ehsid::plant
