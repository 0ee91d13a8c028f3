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
      "valve_hysteresis", Subsystem::valve, "w = min(max(w, u - half_width), u + half_width)",
      "Brokate, Sprekels, Hysteresis and Phase Transitions, Springer 1996",
      "reversals of the command away from null"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"half_width", "1", 0.0, 0.2, 0.02, "half the width of the loop"}}};
  std::array<Scalar, 1> parameters{};

  Scalar command(const Scalar& u) {
    held_ = play(held_, u, parameters[0]);
    return held_;
  }

 private:
  Scalar held_{};
};

}  // namespace ehsid::plant
