// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>
#include <ehsid/plant/first_order.hpp>

#include <array>

namespace ehsid::plant {

/// The sensor follows the position as a first-order system.
template <class Scalar>
struct SensorLag : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "sensor_lag",
      Subsystem::sensor,
      "time_constant m' = y - m",
      "Franklin, Powell, Workman, Digital Control of Dynamic Systems, 1998",
      "fast motion",
      "the position, against pressures or a second sensor",
      "the electronics of any sensor lag by half a millisecond"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"time_constant_s", "s", 0.0, 0.2, 0.005, "of the filter"}}};
  std::array<Scalar, 1> parameters{};

  static constexpr std::array kNeeds{Need::fast_commands};
  static constexpr LogPlace kLogPlace = LogPlace::position;
  static constexpr std::array kDoesNotCommute{"sensor_quantisation"};
  static constexpr std::array<Sizes<1>, 2> starts(const MachineScale& /*machine*/) {
    return {{{0.002}, {0.01}}};
  }
  static constexpr bool matters(const Sizes<1>& size, const MachineScale& /*machine*/) {
    return size[0] >= 5e-4;
  }

  Scalar start_sensor(const Scalar& position) { return lag_.start(position); }
  Scalar sense(const Scalar& position, double h) { return lag_.follow(position, parameters[0], h); }
  Scalar shift_sensor(const Scalar& change) {
    lag_.shift(change);
    return change;
  }
  SensorError<Scalar> sensor_error() const { return {parameters[0], Scalar(0.0)}; }

 private:
  FirstOrder<Scalar> lag_;
};

}  // namespace ehsid::plant
