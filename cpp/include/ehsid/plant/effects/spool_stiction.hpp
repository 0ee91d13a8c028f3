// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// A spool that sticks where it rests. As the stickband of the two-parameter model, with a slip jump of the same size,
/// but the stickband builds up while the spool rests, as silt and dwelling contacts do.
template <class Scalar>
struct SpoolStiction : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "spool_stiction",
      Subsystem::valve,
      "x stays until |u - x| > threshold (1 - exp(-rest / rest_s)), rest the time since it moved, "
      "then x = u",
      "Choudhury, Thornhill, Shah, Control Eng. Practice 13, 2005; growth over the time at rest: "
      "Armstrong-Helouvry et al., Automatica 30(7), 1994",
      "commands that rest or change slowly",
      "the spool position; without it the position, where a slow command goes on in jumps",
      "lap and threshold of a new servo valve are within 0.4 % of full opening"};
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"threshold", "1", 0.0, 0.3, 0.03, "of the command that frees a spool after a long rest",
        1.0, "", kRatedCommand},
       {"rest_s", "s", 1e-3, 100.0, 0.05, "rest after which two thirds of it are there", 0.0}}};
  std::array<Scalar, 2> parameters{};

  static constexpr std::array kNeeds{Need::resting_commands};
  static constexpr Reach kReach = Reach::within;
  static constexpr std::array<Sizes<2>, 2> starts(const MachineScale& /*machine*/) {
    return {{{0.015, 0.05}, {0.05, 0.3}}};
  }
  static constexpr bool matters(const Sizes<2>& size, const MachineScale& /*machine*/) {
    return size[0] >= 0.004;
  }

  /// In the sample in which it comes free the spool moves by the share of the sample that is left, as if the command had
  /// run straight from the sample before: so the motion depends smoothly on both parameters.
  Scalar command(const Scalar& u, double dt) {
    rest_ += dt;
    const Scalar away = u - held_;
    const Scalar distance = absolute<Scalar>(away);
    const Scalar beyond = distance - threshold();
    if (!(value_of(beyond) > 0.0)) {
      moving_ = false;
      distance_before_ = distance;
      return held_;
    }
    held_ = moving_ ? u : held_ + away * (beyond / (distance - distance_before_));
    moving_ = true;
    rest_ = 0.0;
    distance_before_ = Scalar(0.0);
    return held_;
  }

 private:
  /// At the present time of rest.
  Scalar threshold() const {
    using std::exp;
    const Scalar& rest_s = parameters[1];
    return value_of(rest_s) > 0.0 ? parameters[0] * (1.0 - exp(-rest_ / rest_s)) : parameters[0];
  }

  static constexpr double kLong = 1e6;  // s

  double rest_ = kLong;  // s, since the spool moved; it has rested before the first command
  bool moving_ = false;  // at the command before
  Scalar held_{};
  Scalar distance_before_{};  // of the command before from the spool
};

}  // namespace ehsid::plant
