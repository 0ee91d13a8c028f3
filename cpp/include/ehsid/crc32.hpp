// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace ehsid {

namespace detail {

constexpr std::array<std::uint32_t, 16> crc32_table() {
  constexpr std::uint32_t kPolynomial = 0xEDB88320U;
  std::array<std::uint32_t, 16> table{};
  for (std::uint32_t nibble = 0; nibble < 16; ++nibble) {
    std::uint32_t rest = nibble;
    for (int bit = 0; bit < 4; ++bit) {
      rest = (rest >> 1U) ^ ((rest & 1U) != 0U ? kPolynomial : 0U);
    }
    table[nibble] = rest;
  }
  return table;
}

inline constexpr std::array<std::uint32_t, 16> kCrc32Table = crc32_table();

}  // namespace detail

/// CRC-32 of IEEE 802.3, the one of zlib and PNG: polynomial 0x04C11DB7, bits reflected, register preset to ones and
/// inverted at the end. Of the nine bytes "123456789" it is 0xCBF43926.
///
/// It finds every single burst of up to 32 damaged bits. Two lookups a byte in a table of 64 bytes, which fits a
/// controller better than the usual table of 1024.
class Crc32 {
 public:
  constexpr void add(std::uint8_t byte) {
    rest_ ^= byte;
    rest_ = detail::kCrc32Table[rest_ & 0xFU] ^ (rest_ >> 4U);
    rest_ = detail::kCrc32Table[rest_ & 0xFU] ^ (rest_ >> 4U);
  }

  /// The checksum of the bytes so far.
  constexpr std::uint32_t value() const { return ~rest_; }

 private:
  std::uint32_t rest_ = 0xFFFFFFFFU;
};

}  // namespace ehsid
