// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// A part of the load's mass hangs on the rod by a spring and a damper.
template <class Scalar>
struct FlexibleLoad : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "flexible_load",
      Subsystem::mechanics,
      "m_2 (y'' + z'') = -m_2 (w^2 z + 2 damping w z'), w = 2 pi frequency_hz, m_2 = mass_share m; "
      "the reaction acts on the rod, whose mass is m - m_2",
      "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 6",
      "fast commands: the load swings on after each change of speed",
      "both pressures; on an axis the position",
      "the mass is not known better than to a twentieth; above 150 Hz a load is practically rigid; "
      "with a damping above 0.7 it does not swing"};
  static constexpr std::array<ParameterInfo, 3> kParameters{
      {{"mass_share", "1", 0.0, 0.9, 0.3, "of the whole moved mass, that hangs on the rod", 1.0, "",
        "moved mass"},
       {"frequency_hz", "Hz", 0.5, 300.0, 30.0, "of that mass, with the rod fixed", 0.0},
       {"damping", "1", 1e-3, 2.0, 0.05, "damping ratio of the same", 0.0}}};
  std::array<Scalar, 3> parameters{};

  static constexpr std::array kNeeds{Need::fast_commands};
  static constexpr std::array<Sizes<3>, 3> starts(const MachineScale& /*machine*/) {
    return {{{0.3, 8.0, 0.05}, {0.3, 25.0, 0.05}, {0.3, 70.0, 0.05}}};
  }
  static constexpr bool matters(const Sizes<3>& size, const MachineScale& /*machine*/) {
    return size[0] >= 0.05 && size[1] <= 150.0 && size[2] <= 0.7;
  }

  HangingLoad<Scalar> hanging_load() const { return {parameters[0], parameters[1], parameters[2]}; }
};

}  // namespace ehsid::plant
