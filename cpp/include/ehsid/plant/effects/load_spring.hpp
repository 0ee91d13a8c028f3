// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>
#include <cmath>

namespace ehsid::plant {

/// A force that grows with the position, or falls with it, as gravity on a boom does.
template <class Scalar>
struct LoadSpring : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "load_spring",
      Subsystem::mechanics,
      "F = stiffness (y - stroke / 2) + force_at_mid_stroke",
      "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 6",
      "positions over much of the stroke",
      "both pressures; on an axis the position",
      "zero errors of pressure sensors and the atmosphere on the rod look like forces of "
      "a per cent"};
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"stiffness_n_m", "N/m", -1e8, 1e8, 2e4,
        "positive opposes displacement, negative adds to it"},
       {"force_at_mid_stroke_n", "N", -5e6, 5e6, 0.0, "positive opposes extension"}}};
  std::array<Scalar, 2> parameters{};

  static constexpr std::array kNeeds{Need::wide_travel};
  static constexpr double kUnknownStroke = 0.3;  // m
  /// The force is linear in both: the sign of a start does not matter to a fit.
  static std::array<Sizes<2>, 2> starts(const MachineScale& machine) {
    const double usual = 0.08 * machine.force_n / stroke_or(machine, kUnknownStroke);
    return {{{usual, 0.0}, {-usual, 0.0}}};
  }
  static bool matters(const Sizes<2>& size, const MachineScale& machine) {
    return std::abs(size[0]) * stroke_or(machine, 1.0) >= 0.01 * machine.force_n;
  }
  static constexpr const char* kContains = "load_force";
  static constexpr Sizes<1> simplified(const Sizes<2>& size) { return {size[1]}; }
  static constexpr Sizes<2> same(const Sizes<1>& simple) { return {0.0, simple[0]}; }
  static std::array<Sizes<2>, 2> grown(const Sizes<1>& simple, const MachineScale& machine) {
    const double usual = 0.3 * std::abs(simple[0]) / stroke_or(machine, kUnknownStroke);
    return {{{usual, simple[0]}, {-usual, simple[0]}}};
  }

  Scalar load(const Scalar& from_middle) const {
    return parameters[0] * from_middle + parameters[1];
  }
};

}  // namespace ehsid::plant
