// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// Friction of one size at every speed.
template <class Scalar>
struct CoulombFriction : Effect<Scalar> {
  static constexpr EffectInfo kInfo{"coulomb_friction",
                                    Subsystem::mechanics,
                                    "F = force sgn(v)",
                                    "Armstrong-Helouvry et al., Automatica 30(7), 1994",
                                    "slow reversals",
                                    "both pressures; on an axis the position",
                                    "seals have friction of up to 0.3 % of the largest force"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"force_n", "N", 0.0, 1e6, 400.0, "friction force"}}};
  std::array<Scalar, 1> parameters{};

  static constexpr std::array kNeeds{Need::motion_reversals};
  static std::array<Sizes<1>, 2> starts(const MachineScale& machine) {
    return {{{0.01 * machine.force_n}, {0.04 * machine.force_n}}};
  }
  static bool matters(const Sizes<1>& size, const MachineScale& machine) {
    return size[0] >= 0.003 * machine.force_n;
  }

  Scalar friction(const Sliding<Scalar>& /*now*/) const { return parameters[0]; }
};

}  // namespace ehsid::plant
