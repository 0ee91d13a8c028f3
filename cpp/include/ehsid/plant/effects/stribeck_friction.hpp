// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect.hpp>

#include <array>
#include <cmath>

namespace ehsid::plant {

/// Friction that is larger at rest and falls as a film of oil builds up.
template <class Scalar>
struct StribeckFriction : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "stribeck_friction", Subsystem::mechanics,
      "F = (coulomb + (static - coulomb) exp(-(v / stribeck_velocity)^2)) sgn(v)",
      "Armstrong-Helouvry et al., Automatica 30(7), 1994", "very slow motion and reversals"};
  static constexpr std::array<ParameterInfo, 3> kParameters{
      {{"coulomb_n", "N", 0.0, 2e4, 300.0, "at high speed"},
       {"static_n", "N", 0.0, 3e4, 600.0, "at rest"},
       {"stribeck_velocity_m_s", "m/s", 1e-4, 0.5, 0.02, "where most of the rise is gone"}}};
  std::array<Scalar, 3> parameters{};

  Scalar friction(const Scalar& speed) const {
    using std::exp;
    const Scalar& velocity = parameters[2];
    if (!(value_of(velocity) > 0.0)) {
      return parameters[0];
    }
    const Scalar ratio = speed / velocity;
    return parameters[0] + (parameters[1] - parameters[0]) * exp(-(ratio * ratio));
  }
};

}  // namespace ehsid::plant
