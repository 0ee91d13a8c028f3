// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>

namespace ehsid::plant {

/// Play operator: the output w rests until the input u comes within half_width of it, and is then
/// pushed along. Returns the next w = min(max(w, u - half_width), u + half_width).
/// Brokate, Sprekels, Hysteresis and Phase Transitions, Springer 1996.
template <class Scalar>
Scalar play(const Scalar& w, const Scalar& u, const Scalar& half_width) {
  return clamp<Scalar>(w, u - half_width, u + half_width);
}

}  // namespace ehsid::plant
