// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect.hpp>

#include <array>
#include <cmath>

namespace ehsid::plant {

/// The record stores whole steps. Sensitivities are those of the reading before it is rounded: the rounding has
/// none, and its mean slope is one.
template <class Scalar>
struct SensorQuantisation : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "sensor_quantisation",
      Subsystem::sensor,
      "m <- step round(m / step)",
      "Widrow, Kollar, Quantization Noise, Cambridge 2008",
      "slow motion",
      "the position alone",
      "its rounding noise belongs to the noise floor, unless it is most of it and larger than the "
      "noise in the rig file"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"step_m", "m", 0.0, 1e-2, 1e-5, "least step of the reading"}}};
  std::array<Scalar, 1> parameters{};

  static constexpr LogPlace kLogPlace = LogPlace::position;
  /// The record shows its steps without a fit.
  static constexpr std::array<Sizes<1>, 0> starts(const MachineScale& /*machine*/) { return {}; }
  static constexpr bool matters(const Sizes<1>& size, const MachineScale& /*machine*/) {
    return size[0] > 0.0;
  }

  Scalar store(const Scalar& reading) const {
    const double step = value_of(parameters[0]);
    if (!(step > 0.0)) {
      return reading;
    }
    const double value = value_of(reading);
    return reading + (step * std::round(value / step) - value);
  }
};

}  // namespace ehsid::plant
