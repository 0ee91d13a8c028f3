// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/types.hpp>

namespace ehsid {

/// Units out: the estimator works on (command - command_offset) / command_scale and
/// (position - position_offset) / position_scale, so every threshold holds for any machine.
///
/// Choose scales of the order of the signals' excursions (rated command, stroke), offsets near their means.
template <class Scalar>
struct Scaling {
  Scalar command_scale = Scalar(1);    // units of the command, > 0
  Scalar position_scale = Scalar(1);   // units of the position, > 0; see valid()
  Scalar command_offset = Scalar(0);   // units of the command
  Scalar position_offset = Scalar(0);  // units of the position

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&Scaling::command_scale);
    visit(&Scaling::position_scale);
    visit(&Scaling::command_offset);
    visit(&Scaling::position_offset);
  }

  /// Offsets finite; scales normal and positive, and so the squares of position_scale and of the unit of b_i, which
  /// are units of variances: with float, position_scale and position_scale / command_scale in 1.1e-19 to 1.8e19.
  bool valid() const {
    const Scalar unit = position_scale / command_scale;
    return is_normal_positive(command_scale) && is_normal_positive(position_scale) &&
           is_normal_positive(position_scale * position_scale) && is_normal_positive(unit) &&
           is_normal_positive(unit * unit) && is_finite(command_offset) &&
           is_finite(position_offset);
  }

  Scalar scale_command(Scalar command) const { return (command - command_offset) / command_scale; }
  Scalar scale_position(Scalar position) const {
    return (position - position_offset) / position_scale;
  }
  /// Finite for a finite `scaled`.
  Scalar unscale_position(Scalar scaled) const {
    const Scalar position = scaled * position_scale + position_offset;
    return is_finite(position) ? position : bounded_product(scaled, position_scale);
  }

  /// Factor from a scaled parameter to one in the units of the signals: 1 for a_i, position_scale /
  /// command_scale for b_i, position_scale for the constant term.
  Scalar parameter_unit(int index, int na, int nb) const {
    if (index < na) {
      return Scalar(1);
    }
    return index < na + nb ? position_scale / command_scale : position_scale;
  }
};

}  // namespace ehsid
