// SPDX-License-Identifier: MIT
// Text for whoever reads the serial line, and the outcome of the program's checks.
#pragma once

#include <cstdint>
#include <cstring>

#include "port.hpp"

namespace firmware {

inline void put(const char* text) { port::write(text, std::strlen(text)); }

inline void put_hexadecimal(std::uint32_t word) {
  for (int shift = 28; shift >= 0; shift -= 4) {
    port::write(&"0123456789abcdef"[word >> static_cast<unsigned>(shift) & 0xFU], 1);
  }
}

inline void put_number(std::uint32_t number) {
  char digits[10];
  int first = 10;
  do {
    digits[--first] = static_cast<char>('0' + number % 10);
    number /= 10;
  } while (number != 0);
  port::write(digits + first, static_cast<std::size_t>(10 - first));
}

/// Counts checks, and says where one fails.
class Report {
 public:
  /// `where` and `sample` name the place if the check fails.
  bool check(bool good, const char* where, const char* what, std::uint32_t sample) {
    ++checks_;
    if (!good) {
      ++failures_;
      put("FAIL ");
      put(where);
      put(", sample ");
      put_number(sample);
      put(": ");
      put(what);
      put("\n");
    }
    return good;
  }

  bool failed() const { return failures_ > 0; }

  /// What main() returns. The last line says PASS only where something was checked.
  int finish() const {
    const bool good = failures_ == 0 && checks_ > 0;
    put(good ? "PASS " : "FAILED ");
    put_number(good ? checks_ : failures_);
    put(good ? " checks\n" : " of them\n");
    return good ? 0 : 1;
  }

 private:
  std::uint32_t checks_ = 0;
  std::uint32_t failures_ = 0;
};

/// 32-bit FNV-1a, to compare states of host and target in one word.
inline std::uint32_t hash(const void* bytes, std::size_t count) {
  const auto* next = static_cast<const std::uint8_t*>(bytes);
  std::uint32_t value = 0x811c9dc5U;
  for (std::size_t i = 0; i < count; ++i) {
    value = (value ^ next[i]) * 0x01000193U;
  }
  return value;
}

}  // namespace firmware
