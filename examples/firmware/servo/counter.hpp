// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace servo {

/// Counts and stops at its largest value: one that wraps would say "few" after many.
class Counter16 {
 public:
  void increment() { value_ = static_cast<std::uint16_t>(value_ == 0xFFFFU ? value_ : value_ + 1); }
  std::uint16_t value() const { return value_; }

 private:
  std::uint16_t value_ = 0;
};

}  // namespace servo
