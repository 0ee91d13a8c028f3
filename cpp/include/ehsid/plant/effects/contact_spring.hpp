// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>
#include <cmath>

namespace ehsid::plant {

/// The rod meets something elastic on its way out: a workpiece, a buffer, the other half of a mould.
template <class Scalar>
struct ContactSpring : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "contact_spring",
      Subsystem::mechanics,
      "F = stiffness max(0, y - position), against extension",
      "Johnson, Contact Mechanics, Cambridge 1985, ch. 11",
      "motion to both sides of the position where it begins",
      "both pressures; on an axis the position",
      "zero errors of pressure sensors and the atmosphere on the rod look like forces of "
      "a per cent"};
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"position_m", "m", -20.0, 20.0, 0.152, "position of the rod where it begins", 0.0},
       {"stiffness_n_m", "N/m", 0.0, 3e7, 2e5, "rise of the force beyond that"}}};
  std::array<Scalar, 2> parameters{};

  static constexpr std::array kNeeds{Need::wide_travel};
  static constexpr Reach kReach = Reach::positions;
  static constexpr double kUnknownStroke = 0.3;  // m
  /// Near the middle: the cost has a slope over the position only where the rod crosses it.
  static std::array<Sizes<2>, 2> starts(const MachineScale& machine) {
    const double stroke = stroke_or(machine, kUnknownStroke);
    const double middle = std::isnan(machine.stroke_m) ? 0.0 : 0.5 * stroke;
    const double stiffness = 0.5 * machine.force_n / stroke;
    return {{{middle - 0.1 * stroke, stiffness}, {middle + 0.1 * stroke, stiffness}}};
  }
  static bool matters(const Sizes<2>& size, const MachineScale& machine) {
    const double beyond =
        std::isnan(machine.stroke_m) ? kUnknownStroke : machine.stroke_m - size[0];
    return size[1] * beyond >= 0.01 * machine.force_n;
  }

  Contact<Scalar> contact() const { return {parameters[0], parameters[1]}; }
};

}  // namespace ehsid::plant
