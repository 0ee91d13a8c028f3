// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace ehsid::plant {

/// The position is read late: by a bus, by the counting time of a transducer, or by a logger that reads it after the rest.
template <class Scalar>
struct PositionSensorDelay : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "position_sensor_delay",
      Subsystem::sensor,
      "m = y(t - delay)",
      "Franklin, Powell, Workman, Digital Control of Dynamic Systems, 1998",
      "fast motion",
      "the position and a pressure; without that a late position looks as a late command does",
      "bus and sampling of any rig delay by up to a millisecond"};
  static constexpr std::array<ParameterInfo, 1> kParameters{
      {{"delay_s", "s", 0.0, 0.2, 0.005, "time by which the reading is old"}}};
  std::array<Scalar, 1> parameters{};

  static constexpr std::array kNeeds{Need::fast_commands, Need::another_output};
  static constexpr LogPlace kLogPlace = LogPlace::position;
  static constexpr std::array kDoesNotCommute{"sensor_quantisation"};
  static constexpr std::array<Sizes<1>, 2> starts(const MachineScale& /*machine*/) {
    return {{{0.0021}, {0.0083}}};
  }
  static constexpr bool matters(const Sizes<1>& size, const MachineScale& /*machine*/) {
    return size[0] >= 1e-3;
  }

  Scalar start_sensor(const Scalar& position) {
    positions_.assign(1, position);
    newest_ = 0;
    return position;
  }

  /// The position runs along a straight line during a step.
  Scalar sense(const Scalar& position, double h) {
    const Scalar steps = parameters[0] / h;
    const double whole = std::floor(value_of(steps));
    const auto back = static_cast<std::size_t>(whole);
    if (positions_.size() < back + 2) {  // it has rested
      const Scalar rested = positions_[newest_];
      positions_.assign(back + 2, rested);
    }
    newest_ = (newest_ + 1) % positions_.size();
    positions_[newest_] = position;
    const Scalar share = steps - whole;
    const Scalar& later = before(back);
    return later + share * (before(back + 1) - later);
  }
  Scalar shift_sensor(const Scalar& change) {
    for (Scalar& position : positions_) {
      position += change;
    }
    return change;
  }

 private:
  /// The position this many steps ago.
  const Scalar& before(std::size_t steps) const {
    return positions_[(newest_ + positions_.size() - steps) % positions_.size()];
  }

  std::vector<Scalar> positions_;  // those of the last steps, in a ring
  std::size_t newest_ = 0;
};

}  // namespace ehsid::plant
