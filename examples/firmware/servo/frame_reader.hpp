// SPDX-License-Identifier: MIT
// From the bytes of the line to packets (docs/hil_protocol.md, "Frame").
#pragma once

#include "cobs.hpp"
#include "counter.hpp"
#include "crc16.hpp"

namespace servo {

constexpr std::size_t kMaxPacket = 512;
constexpr std::size_t kHeadBytes = 3;  // kind, sequence
constexpr std::size_t kCrcBytes = 2;

/// Gives a packet for each whole frame with the right CRC; counts and drops everything else.
class FrameReader {
 public:
  /// True: packet() is a new one. It stays until the next call.
  bool take(std::uint8_t byte) {
    if (byte == 0) {
      return end_of_frame();
    }
    if (!inside_) {
      restart();
      inside_ = true;
    }
    std::uint8_t decoded = 0;
    if (decoder_.take(byte, decoded)) {
      if (count_ < kMaxPacket) {
        packet_[count_++] = decoded;
      } else {
        too_long_ = true;
      }
    }
    return false;
  }

  /// Kind, sequence and body, without the CRC.
  Bytes packet() const { return {packet_, count_ - kCrcBytes}; }

  Counter16 bad_frames;

 private:
  bool end_of_frame() {
    if (!inside_) {
      return false;  // two zeros in a row
    }
    inside_ = false;
    const bool good = decoder_.complete() && !too_long_ && count_ >= kHeadBytes + kCrcBytes &&
                      crc16({packet_, count_ - kCrcBytes}) == received_crc();
    if (!good) {
      bad_frames.increment();
    }
    return good;
  }

  std::uint16_t received_crc() const {
    return Reader({packet_ + count_ - kCrcBytes, kCrcBytes}).u16();
  }

  void restart() {
    decoder_.restart();
    count_ = 0;
    too_long_ = false;
  }

  CobsDecoder decoder_;
  std::uint8_t packet_[kMaxPacket] = {};
  std::size_t count_ = 0;
  bool inside_ = false;  // something came since the last zero
  bool too_long_ = false;
};

}  // namespace servo
