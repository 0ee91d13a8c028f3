// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect.hpp>

#include <array>
#include <cmath>
#include <cstddef>

namespace ehsid::plant {

/// The transducers of the chamber pressures have a wrong gain: a wrong range is set, or the span has drifted.
template <class Scalar>
struct PressureSensorGain : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "pressure_sensor_gain",
      Subsystem::sensor,
      "m_i = gain_i p_i, i = a, b; a gain of 1 is exact",
      "Fraden, Handbook of Modern Sensors, 4th ed., Springer 2010, ch. 2",
      "chamber pressures that vary",
      "both pressures; the supply pressure tells a wrong gain of both from another supply",
      "transducers with an error of 0.5 % of their range, which is up to four times the pressure "
      "that they measure, are sound"};
  static constexpr double kExact = 1.0;
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"gain_a",
        "1",
        0.5,
        2.0,
        1.05,
        "reading over pressure at the cap side; 1 is exact",
        1.0,
        "",
        "",
        {},
        kExact},
       {"gain_b",
        "1",
        0.5,
        2.0,
        0.96,
        "reading over pressure at the rod side; 1 is exact",
        1.0,
        "",
        "",
        {},
        kExact}}};
  std::array<Scalar, 2> parameters{};

  static constexpr std::array kNeeds{Need::chamber_pressures};
  static constexpr LogPlace kLogPlace = LogPlace::pressures;
  /// The readings are linear in the gains: any start will do.
  static constexpr std::array<Sizes<2>, 1> starts(const MachineScale& /*machine*/) {
    return {{{1.03, 1.03}}};
  }
  static bool matters(const Sizes<2>& size, const MachineScale& /*machine*/) {
    const auto wrong = [](double gain) { return gain > 0.0 && std::abs(gain - kExact) >= 0.02; };
    return wrong(size[0]) || wrong(size[1]);
  }

  ChamberPressures<Scalar> start_pressure_sensors(const ChamberPressures<Scalar>& p) {
    return {p.a * gain(0), p.b * gain(1)};
  }
  ChamberPressures<Scalar> sense_pressures(const ChamberPressures<Scalar>& p, double /*h*/) {
    return start_pressure_sensors(p);
  }
  ChamberPressures<Scalar> shift_pressure_sensors(const ChamberPressures<Scalar>& change) {
    return {change.a / gain(0), change.b / gain(1)};
  }

 private:
  Scalar gain(std::size_t i) const {
    return value_of(parameters[i]) > 0.0 ? parameters[i] : Scalar(kExact);
  }
};

}  // namespace ehsid::plant
