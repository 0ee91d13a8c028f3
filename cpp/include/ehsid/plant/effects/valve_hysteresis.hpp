// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>
#include <ehsid/plant/play.hpp>

#include <array>

namespace ehsid::plant {

/// Play between command and spool.
template <class Scalar>
struct ValveHysteresis : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "valve_hysteresis",
      Subsystem::valve,
      "w = min(max(w, u - half_width), u + half_width)",
      "Brokate, Sprekels, Hysteresis and Phase Transitions, Springer 1996",
      "reversals of the command away from null",
      "the spool position; without it the position, where the command turns often",
      "lap and threshold of a new servo valve are within 0.4 % of full opening"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"half_width", "1", 0.0, 0.2, 0.02, "half the width of the loop", 1.0, "", kRatedCommand}}};
  std::array<Scalar, 1> parameters{};

  static constexpr std::array kNeeds{Need::command_reversals};
  static constexpr Reach kReach = Reach::within;
  static constexpr LogPlace kLogPlace = LogPlace::command;
  static constexpr std::array<Sizes<1>, 2> starts(const MachineScale& /*machine*/) {
    return {{{0.01}, {0.04}}};
  }
  static constexpr bool matters(const Sizes<1>& size, const MachineScale& /*machine*/) {
    return size[0] >= 0.004;
  }

  Scalar command(const Scalar& u, double /*dt*/) {
    held_ = play(held_, u, parameters[0]);
    return held_;
  }

 private:
  Scalar held_{};
};

}  // namespace ehsid::plant
