// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect.hpp>

#include <array>
#include <cmath>
#include <cstddef>

namespace ehsid::plant {

/// Friction that is larger at rest and falls as a film of oil builds up.
template <class Scalar>
struct StribeckFriction : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "stribeck_friction",
      Subsystem::mechanics,
      "F = (coulomb + (static - coulomb) exp(-(v / stribeck_velocity)^2)) sgn(v)",
      "Armstrong-Helouvry et al., Automatica 30(7), 1994",
      "very slow motion and reversals",
      "both pressures; on an axis the position",
      "seals have friction of up to 0.3 % of the largest force; static friction of up to a tenth "
      "above sliding friction is normal scatter, and of more than three times it does not occur"};
  static constexpr std::array<ParameterInfo, 3> kParameters{
      {{"coulomb_n", "N", 0.0, 1e6, 300.0, "at high speed", 1.0, "force at high speed"},
       {"static_n", "N", 0.0, 1.5e6, 600.0, "at rest", 1.0, "force at rest"},
       {"stribeck_velocity_m_s", "m/s", 1e-4, 0.5, 0.02, "where most of the rise is gone", 0.0}}};
  std::array<Scalar, 3> parameters{};

  static constexpr std::array kNeeds{Need::motion_reversals, Need::slow_motion};
  static constexpr std::array<std::array<std::size_t, 2>, 1> kNotBelow{{{1, 0}}};
  static constexpr double kTypicalVelocity = 0.02;  // m/s
  static std::array<Sizes<3>, 2> starts(const MachineScale& machine) {
    const auto friction = [&](double share) {
      const double size = share * machine.force_n;
      return Sizes<3>{size, 1.7 * size, kTypicalVelocity};
    };
    return {{friction(0.01), friction(0.04)}};
  }
  /// Without a rise of the force towards rest the effect is the same as Coulomb friction.
  static bool matters(const Sizes<3>& size, const MachineScale& machine) {
    return 1.1 * size[0] <= size[1] && size[1] <= 3.0 * size[0] &&
           size[1] >= 0.003 * machine.force_n;
  }
  static constexpr const char* kContains = "coulomb_friction";
  static constexpr Sizes<1> simplified(const Sizes<3>& size) { return {0.5 * (size[0] + size[1])}; }
  static constexpr Sizes<3> same(const Sizes<1>& simple) {
    return {simple[0], simple[0], kTypicalVelocity};
  }
  /// The fit of a constant friction lies between friction at rest and at speed, and nearer to the one that the motion
  /// shows more of.
  static constexpr std::array<Sizes<3>, 4> grown(const Sizes<1>& simple,
                                                 const MachineScale& /*machine*/) {
    const double force = simple[0];
    return {{{force, 1.2 * force, kTypicalVelocity},
             {0.7 * force, 1.2 * force, kTypicalVelocity},
             {0.7 * force, 1.2 * force, 4.0 * kTypicalVelocity},
             {force, 1.5 * force, 0.25 * kTypicalVelocity}}};
  }

  Scalar friction(const Sliding<Scalar>& now) const {
    using std::exp;
    const Scalar& velocity = parameters[2];
    if (!(value_of(velocity) > 0.0)) {
      return parameters[0];
    }
    const Scalar ratio = now.speed / velocity;
    return parameters[0] + (parameters[1] - parameters[0]) * exp(-(ratio * ratio));
  }
};

}  // namespace ehsid::plant
