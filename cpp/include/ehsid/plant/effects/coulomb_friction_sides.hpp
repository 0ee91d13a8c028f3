// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace ehsid::plant {

/// Friction of one size at every speed, but of another size in each direction.
template <class Scalar>
struct CoulombFrictionSides : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "coulomb_friction_sides",
      Subsystem::mechanics,
      "F = force_extending where v > 0, -force_retracting where v < 0",
      "Armstrong-Helouvry et al., Automatica 30(7), 1994",
      "slow reversals",
      "both pressures; on an axis the position; only the behaviour at rest distinguishes it from "
      "equal friction in both directions with a constant force",
      "seals have friction of up to 0.3 % of the largest force, and a difference of the directions "
      "of up to a tenth of their mean is normal scatter"};
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"force_extending_n", "N", 0.0, 1e6, 600.0, "friction force while the rod extends"},
       {"force_retracting_n", "N", 0.0, 1e6, 300.0, "friction force while it retracts"}}};
  std::array<Scalar, 2> parameters{};

  static constexpr std::array kNeeds{Need::motion_reversals};
  static std::array<Sizes<2>, 2> starts(const MachineScale& machine) {
    const double large = 0.03 * machine.force_n;
    const double small = 0.01 * machine.force_n;
    return {{{large, small}, {small, large}}};
  }
  /// With directions that are alike the effect is the same as Coulomb friction.
  static bool matters(const Sizes<2>& size, const MachineScale& machine) {
    return std::abs(size[0] - size[1]) >= 0.1 * 0.5 * (size[0] + size[1]) &&
           (std::max)(size[0], size[1]) >= 0.003 * machine.force_n;
  }
  static constexpr const char* kContains = "coulomb_friction";
  static constexpr const char* kTogetherWith = "load_force";
  static constexpr Sizes<1> simplified(const Sizes<2>& size) { return {0.5 * (size[0] + size[1])}; }
  static constexpr Sizes<2> same(const Sizes<1>& simple) { return {simple[0], simple[0]}; }
  static constexpr std::array<Sizes<2>, 2> grown(const Sizes<1>& simple,
                                                 const MachineScale& /*machine*/) {
    return {{{1.4 * simple[0], 0.6 * simple[0]}, {0.6 * simple[0], 1.4 * simple[0]}}};
  }

  Scalar friction(const Sliding<Scalar>& now) const {
    return now.extends ? parameters[0] : parameters[1];
  }
};

}  // namespace ehsid::plant
