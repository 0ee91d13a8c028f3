// SPDX-License-Identifier: MIT
// From a packet to the bytes of the line (docs/hil_protocol.md, "Frame").
#pragma once

#include "frame_reader.hpp"
#include "messages.hpp"

namespace servo {

/// Holds one frame until the next is begun, so that it can be sent again.
class FrameWriter {
 public:
  /// Begins a packet. Its body is written through the Writer that this returns.
  Writer begin(Answer kind, std::uint16_t sequence) {
    Writer packet(packet_, kMaxAnswer);
    packet.u8(static_cast<std::uint8_t>(kind));
    packet.u16(sequence);
    return packet;
  }

  /// The frame of the packet. A zero in front ends whatever stood on the line before, e.g. half a frame at a reset.
  Bytes finish(Writer packet) {
    packet.u16(crc16({packet_, packet.count()}));
    frame_[0] = 0;
    const std::size_t coded = cobs_encode({packet_, packet.count()}, frame_ + 1);
    frame_[coded + 1] = 0;
    count_ = coded + 2;
    return frame();
  }

  Bytes frame() const { return {frame_, count_}; }

 private:
  std::uint8_t packet_[kMaxAnswer] = {};
  std::uint8_t frame_[cobs_bytes(kMaxAnswer) + 2] = {};
  std::size_t count_ = 0;
};

}  // namespace servo
