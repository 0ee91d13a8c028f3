// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>
#include <ehsid/plant/play.hpp>

#include <array>

namespace ehsid::plant {

/// Play between rod and sensor.
template <class Scalar>
struct SensorBacklash : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "sensor_backlash", Subsystem::sensor, "m = min(max(m, y - half_width), y + half_width)",
      "Brokate, Sprekels, Hysteresis and Phase Transitions, Springer 1996",
      "reversals of the motion"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"half_width_m", "m", 0.0, 5e-3, 1e-4, "half the play"}}};
  std::array<Scalar, 1> parameters{};

  void start_sensor(const Scalar& position) { held_ = position; }
  Scalar sense(const Scalar& position, double /*h*/) {
    held_ = play(held_, position, parameters[0]);
    return held_;
  }
  void shift_sensor(const Scalar& change) { held_ += change; }

 private:
  Scalar held_{};
};

}  // namespace ehsid::plant
