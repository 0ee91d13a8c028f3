// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>
#include <cmath>

namespace ehsid::plant {

/// Hydraulic null away from electric null.
template <class Scalar>
struct ValveNullBias : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "valve_null_bias",
      Subsystem::valve,
      "opening = x + offset",
      "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 5",
      "load of both signs; drift at zero command",
      "both pressures and the spool position",
      "lap and threshold of a new servo valve are within 0.4 % of full opening"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"offset", "1", -0.2, 0.2, 0.02, "opening at zero command", 1.0, "", kRatedCommand}}};
  std::array<Scalar, 1> parameters{};

  static constexpr const char* kNuisance = "nuisance.null_bias";
  static constexpr LogPlace kLogPlace = LogPlace::command;
  static constexpr std::array<Sizes<1>, 2> starts(const MachineScale& /*machine*/) {
    return {{{0.01}, {-0.01}}};
  }
  static bool matters(const Sizes<1>& size, const MachineScale& /*machine*/) {
    return std::abs(size[0]) >= 0.004;
  }

  Scalar opening(const Scalar& x) const { return x + parameters[0]; }
};

}  // namespace ehsid::plant
