// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <algorithm>
#include <array>

namespace ehsid::plant {

/// The oil in the pressure line swings on the volume in front of the valve: the supply pressure at the valve rings after
/// each change of the flow. With a supply that droops the line begins at its accumulator.
template <class Scalar>
struct LineResonance : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "line_resonance",
      Subsystem::hydraulics,
      "C dp_s/dt = q - q_supply, L dq/dt = p_source - p_s - R q, C = volume / beta, "
      "L = 1 / (w^2 C), R = 2 damping w L, w = 2 pi frequency_hz",
      "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 3 and 11",
      "fast changes of large flows; the measured supply pressure",
      "the supply pressure; without it both pressures",
      "with oil of 1 GPa and the full flow of the valve the supply pressure swings by less than "
      "1 %, and the gauge is not better than that; with a damping above 0.7 it droops instead"};
  static constexpr std::array<ParameterInfo, 3> kParameters{
      {{"frequency_hz", "Hz", 1.0, 500.0, 40.0, "of the oil in the line on the volume", 0.0},
       {"damping", "1", 1e-3, 2.0, 0.1, "damping ratio of the same", 0.0},
       {"volume_m3", "m^3", 1e-6, 1.0, 2e-3, "of oil in front of the valve", -1.0}}};
  std::array<Scalar, 3> parameters{};

  static constexpr std::array kNeeds{Need::large_commands, Need::fast_commands};
  static constexpr double kTwoPi = 6.283185307179586;
  static constexpr double kOil = 1e9;  // Pa
  static std::array<Sizes<3>, 3> starts(const MachineScale& machine) {
    return {{line(machine, 12.0, 0.05), line(machine, 35.0, 0.05), line(machine, 100.0, 0.05)}};
  }
  /// With the volume with which the full flow swings the pressure by a share of the supply's: dp = q / (w C).
  static Sizes<3> line(const MachineScale& machine, double frequency_hz, double swing) {
    const double turn = kTwoPi * frequency_hz;
    return {frequency_hz, 0.1,
            kOil * machine.full_flow_m3_s / (turn * swing * machine.pressure_pa)};
  }
  /// A line that does not ring is the same as a supply that droops.
  static bool matters(const Sizes<3>& size, const MachineScale& machine) {
    return size[1] <= kRings && size[0] * size[2] > 0.0 &&
           kOil * machine.full_flow_m3_s >= 0.01 * machine.pressure_pa * kTwoPi * size[0] * size[2];
  }
  static constexpr const char* kContains = "supply_droop";
  static constexpr Sizes<2> simplified(const Sizes<3>& size) {
    const double softness = size[2] / kOil;
    return {2.0 * size[1] / (kTwoPi * size[0] * softness), softness};
  }
  /// Nearly: oil so light that it hardly swings has a time constant that is a fourteenth of that of the droop.
  static Sizes<3> same(const Sizes<2>& simple) { return of_droop(simple, 2.0); }
  static std::array<Sizes<3>, 2> grown(const Sizes<2>& simple, const MachineScale& /*machine*/) {
    return {{of_droop(simple, 0.4), of_droop(simple, 0.1)}};
  }

  PressureLine<Scalar> pressure_line() const {
    return {parameters[0], parameters[1], parameters[2]};
  }

 private:
  static constexpr double kRings = 0.7;  // damping ratio above which a step is not overshot much

  /// With the resistance and the softness of a supply that droops: R = 2 damping / (w C), within the ranges.
  static Sizes<3> of_droop(const Sizes<2>& droop, double damping) {
    const double frequency_hz = std::clamp(2.0 * damping / (kTwoPi * droop[0] * droop[1]),
                                           kParameters[0].minimum, kParameters[0].maximum);
    const double volume = kOil * 2.0 * damping / (kTwoPi * frequency_hz * droop[0]);
    return {frequency_hz, damping,
            std::clamp(volume, kParameters[2].minimum, kParameters[2].maximum)};
  }
};

}  // namespace ehsid::plant
