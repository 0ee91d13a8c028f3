// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// Bubbles of air make the oil softer where the pressure is low.
template <class Scalar>
struct EntrainedAir : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "entrained_air",
      Subsystem::hydraulics,
      "beta_e = beta (1 + alpha r) / (1 + alpha r beta / (n p)),  r "
      "= (p0 / p)^(1/n), n = 1.3, p0 = 101325 Pa",
      "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 2",
      "fast motion at low chamber pressures",
      "both pressures, low ones above all",
      "less than 0.1 % of air changes the bulk modulus at 50 bar by less than 1 %"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"volume_fraction", "1", 0.0, 0.1, 0.01, "of air at atmospheric pressure", 1.0, "",
        "volume"}}};
  std::array<Scalar, 1> parameters{};

  static constexpr std::array kNeeds{Need::varying_pressures};
  static constexpr std::array<Sizes<1>, 2> starts(const MachineScale& /*machine*/) {
    return {{{0.005}, {0.03}}};
  }
  static constexpr bool matters(const Sizes<1>& size, const MachineScale& /*machine*/) {
    return size[0] >= 1e-3;
  }

  Scalar bulk_modulus(const Scalar& beta, const Scalar& pressure) const {
    const Scalar& alpha = parameters[0];
    if (!(value_of(alpha) > 0.0)) {
      return beta;
    }
    constexpr double kPolytropic = 1.3;
    constexpr double kAtmosphere = 101325.0;
    const Scalar air = alpha * power(kAtmosphere / pressure, 1.0 / kPolytropic);
    return beta * (1.0 + air) / (1.0 + air * beta / (kPolytropic * pressure));
  }
};

}  // namespace ehsid::plant
