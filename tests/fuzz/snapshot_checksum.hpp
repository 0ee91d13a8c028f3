// SPDX-License-Identifier: MIT
// The checksum at the end of a snapshot, made right for bytes that were changed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace fuzz {

/// CRC-32 of Ethernet and zlib: polynomial 0xEDB88320 with its bits reversed.
inline std::uint32_t crc32(const std::uint8_t* bytes, std::size_t count) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (std::size_t i = 0; i < count; ++i) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit) {
      crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
    }
  }
  return ~crc;
}

/// The last four bytes become the checksum of those before, lowest byte first.
inline void repair_checksum(std::vector<std::uint8_t>& snapshot) {
  if (snapshot.size() < 4) {
    return;
  }
  const std::size_t end = snapshot.size() - 4;
  const std::uint32_t crc = crc32(snapshot.data(), end);
  for (std::size_t i = 0; i < 4; ++i) {
    snapshot[end + i] = static_cast<std::uint8_t>(crc >> (8U * i));
  }
}

}  // namespace fuzz
