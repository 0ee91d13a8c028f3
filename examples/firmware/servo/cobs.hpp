// SPDX-License-Identifier: MIT
// Consistent overhead byte stuffing: S. Cheshire, M. Baker, IEEE/ACM Transactions on Networking 7(2), 1999.
//
// Bytes stand in blocks. A block begins with its code c, 1 to 255, and c - 1 bytes that are not zero follow. Behind
// each block there was a zero, except where c = 255 and behind the last one.
#pragma once

#include "bytes.hpp"

namespace servo {

/// How many bytes become of `count`, at most.
constexpr std::size_t cobs_bytes(std::size_t count) { return count + count / 254 + 1; }

/// Writes at most cobs_bytes(from.count) bytes, none of them zero, and returns how many.
inline std::size_t cobs_encode(Bytes from, std::uint8_t* to) {
  std::size_t code_at = 0;
  std::size_t count = 1;
  std::uint8_t code = 1;
  for (std::size_t i = 0; i < from.count; ++i) {
    if (code == 255) {  // full, and more comes
      to[code_at] = code;
      code_at = count++;
      code = 1;
    }
    if (from.data[i] != 0) {
      to[count++] = from.data[i];
      ++code;
    } else {
      to[code_at] = code;
      code_at = count++;
      code = 1;
    }
  }
  to[code_at] = code;
  return count;
}

/// Decodes byte by byte, as they come. Zeros end a frame and are not for it.
class CobsDecoder {
 public:
  /// Takes a byte other than zero. True: `decoded` is the next byte of the packet.
  bool take(std::uint8_t byte, std::uint8_t& decoded) {
    if (left_ > 0) {
      --left_;
      decoded = byte;
      return true;
    }
    const bool zero = zero_follows_;
    left_ = static_cast<std::uint8_t>(byte - 1);
    zero_follows_ = byte != 255;
    decoded = 0;
    return zero;
  }

  /// May the frame end here? Not inside a block.
  bool complete() const { return left_ == 0; }

  void restart() { *this = CobsDecoder{}; }

 private:
  std::uint8_t left_ = 0;      // bytes of this block that are still to come
  bool zero_follows_ = false;  // behind this block, if another one comes
};

}  // namespace servo
