// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect.hpp>

#include <array>
#include <cmath>

namespace ehsid::plant {

/// Friction that rises or falls along the stroke, as in a bore that is not quite straight or round.
template <class Scalar>
struct PositionFriction : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "position_friction",
      Subsystem::mechanics,
      "F = max(0, force + rise (y - stroke / 2)) sgn(v)",
      "Armstrong-Helouvry et al., Automatica 30(7), 1994",
      "slow reversals at positions over much of the stroke",
      "both pressures; on an axis the position",
      "seals have friction of up to 0.3 % of the largest force, and a change of up to a tenth from "
      "mid-stroke to either end is normal scatter"};
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"force_n", "N", 0.0, 1e6, 400.0, "friction force at mid-stroke; of an axis at zero", 1.0,
        "force at mid-stroke"},
       {"rise_n_m", "N/m", -1e7, 1e7, 1500.0, "rise of the force with the position"}}};
  std::array<Scalar, 2> parameters{};

  static constexpr std::array kNeeds{Need::motion_reversals, Need::wide_travel};
  static constexpr double kUnknownStroke = 0.3;  // m
  /// From half to one and a half of the friction at mid-stroke.
  static std::array<Sizes<2>, 2> starts(const MachineScale& machine) {
    return grown({0.02 * machine.force_n}, machine);
  }
  /// Without a rise the effect is the same as Coulomb friction.
  static bool matters(const Sizes<2>& size, const MachineScale& machine) {
    const double at_end = 0.5 * std::abs(size[1]) * stroke_or(machine, kUnknownStroke);
    return at_end >= 0.1 * size[0] && size[0] + at_end >= 0.003 * machine.force_n;
  }
  static constexpr const char* kContains = "coulomb_friction";
  static constexpr Sizes<1> simplified(const Sizes<2>& size) { return {size[0]}; }
  static constexpr Sizes<2> same(const Sizes<1>& simple) { return {simple[0], 0.0}; }
  static std::array<Sizes<2>, 2> grown(const Sizes<1>& simple, const MachineScale& machine) {
    const double rise = simple[0] / stroke_or(machine, kUnknownStroke);
    return {{{simple[0], rise}, {simple[0], -rise}}};
  }

  Scalar friction(const Sliding<Scalar>& now) const {
    const Scalar force = parameters[0] + parameters[1] * now.from_middle;
    return value_of(force) > 0.0 ? force : Scalar(0.0);
  }
};

}  // namespace ehsid::plant
