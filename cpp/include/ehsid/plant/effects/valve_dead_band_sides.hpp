// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>
#include <cmath>

namespace ehsid::plant {

/// Overlap of another size on each side of null. A null bias beside an overlap that is the same on both sides moves the
/// rod in the same way, as long as it is smaller than that.
template <class Scalar>
struct ValveDeadBandSides : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "valve_dead_band_sides",
      Subsystem::valve,
      "opening = x - overlap_a where x > overlap_a, x + overlap_b where x < -overlap_b, else 0",
      "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 5",
      "small commands about null, in both directions",
      "the position; both pressures and the spool position distinguish it from hysteresis; nothing "
      "distinguishes it from equal overlaps with a null bias",
      "the null of a new servo valve is within 0.4 % of full opening, and its bias is half the "
      "difference of the overlaps"};
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"overlap_a", "1", 0.0, 0.3, 0.04, "of the edges that extend the rod", 1.0,
        "overlap of the edges that extend the rod", kRatedCommand},
       {"overlap_b", "1", 0.0, 0.3, 0.02, "of the edges that retract it", 1.0,
        "overlap of the edges that retract the rod", kRatedCommand}}};
  std::array<Scalar, 2> parameters{};

  static constexpr std::array kNeeds{Need::commands_about_null, Need::motion_reversals};
  static constexpr Reach kReach = Reach::within;
  static constexpr const char* kNuisance = "nuisance.null_bias nuisance.edge_overlap";
  static constexpr LogPlace kLogPlace = LogPlace::command;
  static constexpr std::array kDoesNotCommute{"valve_hysteresis", "valve_lag", "valve_null_bias",
                                              "valve_flow_saturation"};
  static constexpr std::array<Sizes<2>, 2> starts(const MachineScale& /*machine*/) {
    return {{{0.04, 0.01}, {0.01, 0.04}}};
  }
  /// With overlaps that are the same the effect is the same as the dead band.
  static bool matters(const Sizes<2>& size, const MachineScale& /*machine*/) {
    return 0.5 * std::abs(size[0] - size[1]) >= 0.004;
  }
  static constexpr const char* kContains = "valve_dead_band";
  static constexpr const char* kTogetherWith = "valve_null_bias";
  static constexpr Sizes<1> simplified(const Sizes<2>& size) { return {0.5 * (size[0] + size[1])}; }
  static constexpr Sizes<2> same(const Sizes<1>& simple) { return {simple[0], simple[0]}; }
  static constexpr std::array<Sizes<2>, 2> grown(const Sizes<1>& simple,
                                                 const MachineScale& /*machine*/) {
    return {{{1.4 * simple[0], 0.6 * simple[0]}, {0.6 * simple[0], 1.4 * simple[0]}}};
  }

  Overlap<Scalar> overlap() const { return {parameters[0], parameters[1]}; }
};

}  // namespace ehsid::plant
