// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// Laminar flow past the piston.
template <class Scalar>
struct InternalLeakage : Effect<Scalar> {
  static constexpr EffectInfo kInfo{"internal_leakage",
                                    Subsystem::hydraulics,
                                    "q = coefficient (p_a - p_b), from A to B",
                                    "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 6",
                                    "load of both signs, slow motion; both pressures",
                                    "both pressures",
                                    "a spool at null leaks a per cent of the flow of the valve"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"coefficient_m3_s_pa", "m^3/(s Pa)", 0.0, 5e-10, 2e-11, "flow over pressure difference"}}};
  std::array<Scalar, 1> parameters{};

  static std::array<Sizes<1>, 2> starts(const MachineScale& machine) {
    const auto coefficient = [&](double share) {
      return Sizes<1>{share * machine.rated_flow_m3_s / machine.pressure_pa};
    };
    return {{coefficient(0.01), coefficient(0.1)}};
  }
  static bool matters(const Sizes<1>& size, const MachineScale& machine) {
    return size[0] * machine.pressure_pa >= 0.01 * machine.full_flow_m3_s;
  }

  Leakage<Scalar> leakage(const Scalar& p_a, const Scalar& p_b, const Scalar& /*p_tank*/) const {
    const Scalar flow = parameters[0] * (p_a - p_b);
    return {flow, -flow};
  }
};

}  // namespace ehsid::plant
