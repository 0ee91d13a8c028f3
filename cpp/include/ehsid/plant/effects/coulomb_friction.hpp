// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// Friction of one size at every speed.
template <class Scalar>
struct CoulombFriction : Effect<Scalar> {
  static constexpr EffectInfo kInfo{"coulomb_friction", Subsystem::mechanics, "F = force sgn(v)",
                                    "Armstrong-Helouvry et al., Automatica 30(7), 1994",
                                    "slow reversals"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"force_n", "N", 0.0, 2e4, 400.0, "friction force"}}};
  std::array<Scalar, 1> parameters{};

  Scalar friction(const Scalar& /*speed*/) const { return parameters[0]; }
};

}  // namespace ehsid::plant
