// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// Laminar flow out of the chambers, to the tank.
template <class Scalar>
struct ExternalLeakage : Effect<Scalar> {
  static constexpr EffectInfo kInfo{"external_leakage",
                                    Subsystem::hydraulics,
                                    "q_i = coefficient_i (p_i - p_tank), i = a, b",
                                    "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 6",
                                    "holding against a load; both pressures",
                                    "both pressures",
                                    "a spool at null leaks a per cent of the flow of the valve"};
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"coefficient_a_m3_s_pa", "m^3/(s Pa)", 0.0, 5e-10, 2e-11, "of the cap side", 1.0,
        "coefficient of the cap side (A)"},
       {"coefficient_b_m3_s_pa", "m^3/(s Pa)", 0.0, 5e-10, 2e-11, "of the rod side", 1.0,
        "coefficient of the rod side (B)"}}};
  std::array<Scalar, 2> parameters{};

  static std::array<Sizes<2>, 2> starts(const MachineScale& machine) {
    const auto coefficients = [&](double share) {
      const double size = share * machine.rated_flow_m3_s / machine.pressure_pa;
      return Sizes<2>{size, size};
    };
    return {{coefficients(0.01), coefficients(0.1)}};
  }
  static bool matters(const Sizes<2>& size, const MachineScale& machine) {
    return (size[0] + size[1]) * machine.pressure_pa >= 0.01 * machine.full_flow_m3_s;
  }

  Leakage<Scalar> leakage(const Scalar& p_a, const Scalar& p_b, const Scalar& p_tank) const {
    return {parameters[0] * (p_a - p_tank), parameters[1] * (p_b - p_tank)};
  }
};

}  // namespace ehsid::plant
