// SPDX-License-Identifier: MIT
// Good samples for the fuzz targets: a stable servo of second order, driven by random steps.
#pragma once

#include <cstdint>

namespace fuzz {

/// y(k) = 1.6 y(k-1) - 0.68 y(k-2) + 0.05 u(k-1) + 0.01 e(k), with u and e uniform in [-1, 1).
struct Plant {
  std::uint32_t random = 7;
  float command = 0.0F;
  float position = 0.0F;
  float before = 0.0F;

  void advance() {
    const float next = 1.6F * position - 0.68F * before + 0.05F * command + 0.01F * draw();
    before = position;
    position = next;
    command = draw();
  }

 private:
  /// Numerical Recipes' linear congruential generator.
  float draw() {
    random = random * 1664525U + 1013904223U;
    return static_cast<float>(random >> 8U) / 8388608.0F - 1.0F;
  }
};

}  // namespace fuzz
