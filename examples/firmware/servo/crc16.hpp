// SPDX-License-Identifier: MIT
// CRC-16/IBM-3740: polynomial x^16 + x^12 + x^5 + 1, start 0xFFFF, most significant bit first.
#pragma once

#include "bytes.hpp"

namespace servo {

constexpr std::uint16_t kCrcStart = 0xFFFFU;

/// One more byte. Bit by bit: a table would cost more flash than these few hundred steps a frame cost time.
inline std::uint16_t crc16_next(std::uint16_t crc, std::uint8_t byte) {
  std::uint32_t value = crc ^ static_cast<std::uint32_t>(byte) << 8U;
  for (int bit = 0; bit < 8; ++bit) {
    value = (value & 0x8000U) != 0 ? value << 1U ^ 0x1021U : value << 1U;
  }
  return static_cast<std::uint16_t>(value);
}

inline std::uint16_t crc16(Bytes bytes) {
  std::uint16_t crc = kCrcStart;
  for (std::size_t i = 0; i < bytes.count; ++i) {
    crc = crc16_next(crc, bytes.data[i]);
  }
  return crc;
}

}  // namespace servo
