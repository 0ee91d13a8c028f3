// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>
#include <ehsid/plant/first_order.hpp>

#include <array>

namespace ehsid::plant {

/// The readings of both chamber pressures follow late: by the filter of an amplifier, or behind thin lines.
template <class Scalar>
struct PressureSensorLag : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "pressure_sensor_lag",
      Subsystem::sensor,
      "time_constant m_i' = p_i - m_i, i = a, b",
      "Franklin, Powell, Workman, Digital Control of Dynamic Systems, 1998",
      "fast changes of the pressures",
      "both pressures, against the position",
      "ordinary transducers and their amplifiers lag by a millisecond, and loggers by another"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"time_constant_s", "s", 0.0, 0.2, 0.005, "of the filters of both readings"}}};
  std::array<Scalar, 1> parameters{};

  static constexpr std::array kNeeds{Need::chamber_pressures, Need::fast_commands};
  static constexpr LogPlace kLogPlace = LogPlace::pressures;
  static constexpr std::array<Sizes<1>, 1> starts(const MachineScale& /*machine*/) {
    return {{{0.005}}};
  }
  static constexpr bool matters(const Sizes<1>& size, const MachineScale& /*machine*/) {
    return size[0] >= 2e-3;
  }

  ChamberPressures<Scalar> start_pressure_sensors(const ChamberPressures<Scalar>& p) {
    return {lag_a_.start(p.a), lag_b_.start(p.b)};
  }
  ChamberPressures<Scalar> sense_pressures(const ChamberPressures<Scalar>& p, double h) {
    return {lag_a_.follow(p.a, parameters[0], h), lag_b_.follow(p.b, parameters[0], h)};
  }
  ChamberPressures<Scalar> shift_pressure_sensors(const ChamberPressures<Scalar>& change) {
    lag_a_.shift(change.a);
    lag_b_.shift(change.b);
    return change;
  }

 private:
  FirstOrder<Scalar> lag_a_, lag_b_;
};

}  // namespace ehsid::plant
