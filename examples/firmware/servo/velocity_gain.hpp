// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>

namespace servo {

/// Steady velocity per volt of the estimated model, m/(s V); 0 where theta gives none.
///
/// theta = (a1 .. a_na, b1 .. b_nb [, c]) of A(x) y = B(x) u, with x the delay by one sample,
/// A(x) = 1 + a1 x + .. and B(x) = x^nk (b1 + b2 x + ..). The plant integrates: A(1) = 0, so A(x) = (1 - x) C(x).
/// (1 - x) y / T is the velocity, hence velocity = B(x) / (T C(x)) u, and for a steady u it is B(1) / (T C(1)).
/// Differentiating A at 1 gives C(1) = -A'(1) = -(a1 + 2 a2 + 3 a3 + ..). No division of polynomials, and an
/// estimate whose A(1) is not quite 0 changes the result little. A constant c is a drift, not a gain.
inline float velocity_gain(const float* theta, std::size_t na, std::size_t nb,
                           float sample_time_s) {
  float steady = 0.0F;  // C(1)
  float b_sum = 0.0F;   // B(1)
  for (std::size_t i = 0; i < na; ++i) {
    steady -= static_cast<float>(i + 1) * theta[i];
  }
  for (std::size_t i = 0; i < nb; ++i) {
    b_sum += theta[na + i];
  }
  const float gain = b_sum / (sample_time_s * steady);
  return std::isfinite(gain) && gain > 0.0F ? gain : 0.0F;
}

}  // namespace servo
