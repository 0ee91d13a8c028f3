// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// Hydraulic null away from electric null.
template <class Scalar>
struct ValveNullBias : Effect<Scalar> {
  static constexpr EffectInfo kInfo{"valve_null_bias", Subsystem::valve, "opening = x + offset",
                                    "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 5",
                                    "load of both signs; drift at zero command"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"offset", "1", -0.2, 0.2, 0.02, "opening at zero command"}}};
  std::array<Scalar, 1> parameters{};

  Scalar opening(const Scalar& x) const { return x + parameters[0]; }
};

}  // namespace ehsid::plant
