// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace servo {

/// Expires when nobody has fed it for longer than its limit. Milliseconds may wrap: only differences count.
class Watchdog {
 public:
  void set_limit(std::uint32_t limit_ms) { limit_ms_ = limit_ms; }
  void feed(std::uint32_t now_ms) { fed_ms_ = now_ms; }

  /// Longer, not as long: fed late in one millisecond and asked early in another, it must not be short by one.
  bool expired(std::uint32_t now_ms) const { return now_ms - fed_ms_ > limit_ms_; }

 private:
  std::uint32_t limit_ms_ = 0;
  std::uint32_t fed_ms_ = 0;
};

}  // namespace servo
