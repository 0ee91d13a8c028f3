// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// A force that grows with the position.
template <class Scalar>
struct LoadSpring : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "load_spring", Subsystem::mechanics, "F = stiffness (y - stroke / 2) + force_at_mid_stroke",
      "Merritt, Hydraulic Control Systems, Wiley 1967, ch. 6", "positions over much of the stroke"};
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"stiffness_n_m", "N/m", 0.0, 1e6, 2e4, "positive opposes displacement"},
       {"force_at_mid_stroke_n", "N", -2e4, 2e4, 0.0, "positive opposes extension"}}};
  std::array<Scalar, 2> parameters{};

  Scalar load(const Scalar& from_middle) const {
    return parameters[0] * from_middle + parameters[1];
  }
};

}  // namespace ehsid::plant
