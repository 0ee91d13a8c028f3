// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// A constant force, such as gravity.
template <class Scalar>
struct LoadForce : Effect<Scalar> {
  static constexpr EffectInfo kInfo{"load_force", Subsystem::mechanics, "F = force", "Newton",
                                    "motion in both directions; both pressures"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"force_n", "N", -2e4, 2e4, 800.0, "positive opposes extension"}}};
  std::array<Scalar, 1> parameters{};

  Scalar load(const Scalar& /*from_middle*/) const { return parameters[0]; }
};

}  // namespace ehsid::plant
