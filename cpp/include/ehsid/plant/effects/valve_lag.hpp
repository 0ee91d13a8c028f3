// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// The spool follows its command as a second-order system.
template <class Scalar>
struct ValveLag : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "valve_lag",
      Subsystem::valve,
      "x'' + 2 damping w x' + w^2 x = w^2 u,  w = 2 pi bandwidth_hz",
      "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 7",
      "commands with content past the corner of the valve",
      "the spool position; without it the position and both pressures",
      "a valve with a corner above 120 Hz is fast: nuisance.spool_bandwidth_hz describes "
      "it"};
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"bandwidth_hz", "Hz", 3.0, 500.0, 60.0, "natural frequency", -1.0},
       {"damping", "1", 0.2, 2.0, 0.8, "damping ratio", 0.0}}};
  std::array<Scalar, 2> parameters{};

  static constexpr std::array kNeeds{Need::fast_commands};
  static constexpr LogPlace kLogPlace = LogPlace::command;
  static constexpr std::array kDoesNotCommute{"valve_hysteresis"};
  static constexpr std::array<Sizes<2>, 2> starts(const MachineScale& /*machine*/) {
    return {{{30.0, 0.8}, {100.0, 0.8}}};
  }
  static constexpr bool matters(const Sizes<2>& size, const MachineScale& /*machine*/) {
    return size[0] <= 120.0;
  }

  SpoolLag<Scalar> spool_lag() const { return {parameters[0], parameters[1]}; }
};

}  // namespace ehsid::plant
