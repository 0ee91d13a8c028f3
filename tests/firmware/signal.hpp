// SPDX-License-Identifier: MIT
// Command and position of model (16) of Ghazali et al. (2011), rounded to 1/1024 and made in integers, so that
// every machine makes the same samples.
#pragma once

#include <cstdint>

namespace firmware {

struct Sample {
  float command;
  float position;
};

class Signal {
 public:
  /// Random commands of -1 or 1, and the positions they make.
  Sample next() {
    advance();
    const std::int32_t model =
        2293 * y_[0] - 1825 * y_[1] + 556 * y_[2] + 394 * u_[0] - 595 * u_[1] + 302 * u_[2];
    // Rounded down, whatever the sign.
    const std::int32_t rounded = model >= 0 ? model / 1024 : -((1023 - model) / 1024);
    for (int i = 2; i > 0; --i) {
      y_[i] = y_[i - 1];
      u_[i] = u_[i - 1];
    }
    y_[0] = rounded + static_cast<std::int32_t>((word_ >> 8U) % 33U) - 16;
    u_[0] = (word_ & 1U) != 0U ? 1024 : -1024;
    return {static_cast<float>(u_[0]) / 1024.0F, static_cast<float>(y_[0]) / 1024.0F};
  }

  /// The position rests where it was, and flickers by one step of the sensor; the command is 0.5.
  Sample hold() {
    advance();
    const std::int32_t seen = y_[0] + static_cast<std::int32_t>((word_ >> 8U) % 3U) - 1;
    return {0.5F, static_cast<float>(seen) / 1024.0F};
  }

 private:
  void advance() {
    word_ ^= word_ << 13U;  // Marsaglia's xorshift32
    word_ ^= word_ >> 17U;
    word_ ^= word_ << 5U;
  }

  std::uint32_t word_ = 2463534242U;
  std::int32_t u_[3] = {};
  std::int32_t y_[3] = {};
};

}  // namespace firmware
