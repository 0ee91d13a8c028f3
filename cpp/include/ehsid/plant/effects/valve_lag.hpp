// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// The spool follows its command as a second-order system.
template <class Scalar>
struct ValveLag : Effect<Scalar> {
  static constexpr EffectInfo kInfo{"valve_lag", Subsystem::valve,
                                    "x'' + 2 damping w x' + w^2 x = w^2 u,  w = 2 pi bandwidth_hz",
                                    "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 7",
                                    "commands with content past the corner of the valve"};
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"bandwidth_hz", "Hz", 3.0, 500.0, 60.0, "natural frequency"},
       {"damping", "1", 0.2, 2.0, 0.8, "damping ratio"}}};
  std::array<Scalar, 2> parameters{};

  SpoolLag<Scalar> spool_lag() const { return {parameters[0], parameters[1]}; }
};

}  // namespace ehsid::plant
