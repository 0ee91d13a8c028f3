// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// Overlap of the metering edges: the spool moves that far from null before an edge opens.
template <class Scalar>
struct ValveDeadBand : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "valve_dead_band",
      Subsystem::valve,
      "opening = x - overlap sgn(x) where |x| > overlap, else 0",
      "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 5",
      "small commands about null, in both directions",
      "the position; both pressures and the spool position distinguish it from hysteresis",
      "lap and threshold of a new servo valve are within 0.4 % of full opening"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"overlap", "1", 0.0, 0.3, 0.03, "overlap on each side of null", 1.0, "", kRatedCommand}}};
  std::array<Scalar, 1> parameters{};

  static constexpr std::array kNeeds{Need::commands_about_null};
  static constexpr Reach kReach = Reach::within;
  static constexpr const char* kNuisance = "nuisance.edge_overlap";
  static constexpr LogPlace kLogPlace = LogPlace::command;
  static constexpr std::array kDoesNotCommute{"valve_hysteresis", "valve_lag", "valve_null_bias",
                                              "valve_flow_saturation"};
  static constexpr std::array<Sizes<1>, 2> starts(const MachineScale& /*machine*/) {
    return {{{0.01}, {0.04}}};
  }
  static constexpr bool matters(const Sizes<1>& size, const MachineScale& /*machine*/) {
    return size[0] >= 0.004;
  }

  Overlap<Scalar> overlap() const { return {parameters[0], parameters[0]}; }
};

}  // namespace ehsid::plant
