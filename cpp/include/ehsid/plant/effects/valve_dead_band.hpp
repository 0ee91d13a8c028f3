// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// Overlap of the metering edges: the spool moves that far from null before an edge opens.
template <class Scalar>
struct ValveDeadBand : Effect<Scalar> {
  static constexpr EffectInfo kInfo{"valve_dead_band", Subsystem::valve,
                                    "opening = x - overlap sgn(x) where |x| > overlap, else 0",
                                    "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 5",
                                    "small commands about null, in both directions"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"overlap", "1", 0.0, 0.3, 0.03, "overlap on each side of null"}}};
  std::array<Scalar, 1> parameters{};

  Scalar overlap() const { return parameters[0]; }
};

}  // namespace ehsid::plant
