// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect.hpp>

#include <array>
#include <cmath>

namespace ehsid::plant {

/// The sensor follows the position as a first-order system.
template <class Scalar>
struct SensorLag : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "sensor_lag", Subsystem::sensor, "time_constant m' = y - m",
      "Franklin, Powell, Workman, Digital Control of Dynamic Systems, 1998", "fast motion"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"time_constant_s", "s", 0.0, 0.2, 0.005, "of the filter"}}};
  std::array<Scalar, 1> parameters{};

  void start_sensor(const Scalar& position) {
    shown_ = position;
    before_ = position;
  }

  /// Exact where the position runs along a straight line during the step.
  Scalar sense(const Scalar& position, double h) {
    using std::exp;
    const Scalar& tau = parameters[0];
    if (!(value_of(tau) > 0.0)) {
      start_sensor(position);
      return position;
    }
    const Scalar decay = exp(-h / tau);
    const Scalar slope = (position - before_) / h;
    shown_ = decay * (shown_ - before_ + tau * slope) + position - tau * slope;
    before_ = position;
    return shown_;
  }
  void shift_sensor(const Scalar& change) {
    shown_ += change;
    before_ += change;
  }

 private:
  Scalar shown_{};
  Scalar before_{};
};

}  // namespace ehsid::plant
