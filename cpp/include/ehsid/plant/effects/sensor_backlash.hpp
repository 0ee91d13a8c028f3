// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>
#include <ehsid/plant/play.hpp>

#include <array>
#include <cmath>

namespace ehsid::plant {

/// Play between rod and sensor.
template <class Scalar>
struct SensorBacklash : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "sensor_backlash",
      Subsystem::sensor,
      "m = min(max(m, y - half_width), y + half_width)",
      "Brokate, Sprekels, Hysteresis and Phase Transitions, Springer 1996",
      "reversals of the motion",
      "the position, against pressures or a second sensor",
      "any transducer has a play of some micrometres, or of 0.005 % of its stroke"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"half_width_m", "m", 0.0, 5e-3, 1e-4, "half the play"}}};
  std::array<Scalar, 1> parameters{};

  static constexpr std::array kNeeds{Need::motion_reversals};
  static constexpr Reach kReach = Reach::sensor_noise;
  static constexpr LogPlace kLogPlace = LogPlace::position;
  static constexpr std::array kDoesNotCommute{"sensor_nonlinearity", "sensor_lag",
                                              "sensor_quantisation"};
  static constexpr std::array<Sizes<1>, 2> starts(const MachineScale& /*machine*/) {
    return {{{5e-5}, {2e-4}}};
  }
  static bool matters(const Sizes<1>& size, const MachineScale& machine) {
    // The play of a transducer of unknown stroke: fmax passes over NaN.
    return size[0] >= std::fmax(5e-6, 5e-5 * machine.stroke_m);
  }

  Scalar start_sensor(const Scalar& position) { return held_ = position; }
  Scalar sense(const Scalar& position, double /*h*/) {
    held_ = play(held_, position, parameters[0]);
    return held_;
  }
  Scalar shift_sensor(const Scalar& change) {
    held_ += change;
    return change;
  }
  SensorError<Scalar> sensor_error() const { return {Scalar(0.0), parameters[0]}; }

 private:
  Scalar held_{};
};

}  // namespace ehsid::plant
