// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// Time from command to valve.
template <class Scalar>
struct TransportDelay : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "transport_delay",
      Subsystem::timing,
      "u(t - delay)",
      "Franklin, Powell, Workman, Digital Control of Dynamic Systems, 1998",
      "steps and fast commands",
      "the position; a measured spool position distinguishes it from a slow valve",
      "filters, bus and sampling of any rig delay by up to a millisecond"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"delay_s", "s", 0.0, 0.2, 0.004, "time lost"}}};
  std::array<Scalar, 1> parameters{};

  static constexpr std::array kNeeds{Need::fast_commands};
  static constexpr LogPlace kLogPlace = LogPlace::command;
  /// Not a multiple of an integration step: the delayed command would jump between two steps, and the sensitivity
  /// would be zero.
  static constexpr std::array<Sizes<1>, 2> starts(const MachineScale& /*machine*/) {
    return {{{0.0021}, {0.0083}}};
  }
  static constexpr bool matters(const Sizes<1>& size, const MachineScale& /*machine*/) {
    return size[0] >= 1e-3;
  }

  Scalar delay() const { return parameters[0]; }
};

}  // namespace ehsid::plant
