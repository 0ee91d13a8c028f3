// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// Time from command to valve.
template <class Scalar>
struct TransportDelay : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "transport_delay", Subsystem::timing, "u(t - delay)",
      "Franklin, Powell, Workman, Digital Control of Dynamic Systems, 1998",
      "steps and fast commands"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"delay_s", "s", 0.0, 0.2, 0.004, "time lost"}}};
  std::array<Scalar, 1> parameters{};

  Scalar delay() const { return parameters[0]; }
};

}  // namespace ehsid::plant
