// SPDX-License-Identifier: MIT
// The line of the firmware: bytes as they come, and requests in whole frames with the right CRC, so that what stands
// behind the CRC is reached too. Whatever comes, each answer is one sound frame, and the valve is closed unless the
// target runs.
#include "data.hpp"

#include <ehsid/types.hpp>
#include <servo/servo.hpp>

#include <algorithm>
#include <array>
#include <vector>

namespace {

constexpr std::size_t kMostBytes = servo::kMaxPacket + 8;  // a little more than the reader takes

void check_answer(servo::Bytes answer) {
  if (answer.count == 0) {
    return;
  }
  servo::FrameReader reader;
  int packets = 0;
  for (std::size_t i = 0; i < answer.count; ++i) {
    packets += reader.take(answer.data[i]) ? 1 : 0;
  }
  fuzz::check(packets == 1 && reader.bad_frames.value() == 0, "an answer is one sound frame");
  fuzz::check(reader.packet().count + servo::kCrcBytes <= servo::kMaxAnswer,
              "an answer is no longer than the longest one of the protocol");
}

class Line {
 public:
  Line() {
    check_answer(target_.power_up("fuzz", [] { return 0U; }));
  }

  void wait(std::uint32_t ms) {
    now_ms_ += ms;
    check_answer(target_.tick(now_ms_));
    check_valve();
  }

  void send(const std::uint8_t* bytes, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      check_answer(target_.receive(bytes[i], now_ms_));
    }
    check_valve();
  }

  /// A request in a frame of its own, with the next sequence number or the one before again.
  void request(std::uint8_t kind, bool again, const std::vector<std::uint8_t>& body) {
    sequence_ = static_cast<std::uint16_t>(sequence_ + (again ? 0 : 1));
    std::vector<std::uint8_t> packet{kind, static_cast<std::uint8_t>(sequence_),
                                     static_cast<std::uint8_t>(sequence_ >> 8U)};
    packet.insert(packet.end(), body.begin(), body.end());
    const std::uint16_t crc = servo::crc16({packet.data(), packet.size()});
    packet.push_back(static_cast<std::uint8_t>(crc));
    packet.push_back(static_cast<std::uint8_t>(crc >> 8U));
    std::vector<std::uint8_t> frame(servo::cobs_bytes(packet.size()) + 1);
    frame.resize(servo::cobs_encode({packet.data(), packet.size()}, frame.data()));
    frame.push_back(0);
    send(frame.data(), frame.size());
  }

 private:
  void check_valve() const {
    const float volts = target_.valve_command_v();
    fuzz::check(ehsid::is_finite(volts), "the command of the valve is finite");
    fuzz::check(target_.state() == servo::State::running || volts == 0.0F,
                "the valve is closed unless the target runs");
  }

  servo::Servo target_;
  std::uint32_t now_ms_ = 0;
  std::uint16_t sequence_ = 0;
};

std::vector<std::uint8_t> taken(fuzz::Data& data, std::size_t count) {
  count = std::min(count, data.left());
  std::vector<std::uint8_t> bytes(data.bytes(), data.bytes() + count);
  data.skip(count);
  return bytes;
}

class Body {
 public:
  Body& byte(std::uint8_t value) {
    bytes_.push_back(value);
    return *this;
  }
  Body& word(std::uint32_t value) {
    for (unsigned i = 0; i < 4; ++i) {
      byte(static_cast<std::uint8_t>(value >> (8U * i)));
    }
    return *this;
  }
  Body& real(float value) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    return word(bits);
  }
  std::vector<std::uint8_t> bytes() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// A configuration that is accepted (docs/hil_protocol.md), with numbers of the input in place of some of its own.
std::vector<std::uint8_t> configuration(fuzz::Data& data) {
  const int policy = data.up_to(7);
  Body body;
  body.byte(static_cast<std::uint8_t>(policy)).byte(3).byte(3).byte(1);
  const int flags = data.up_to(31) & ~servo::kSeed;
  body.byte(static_cast<std::uint8_t>(flags));
  const std::array<float, 4> scaling{5.0F, 0.25F, 0.0F, 0.0F};
  const std::array<float, 8> forgetting{0.995F, 0.98F, 0.9F, 60.0F, 0.8F, 1e-4F, 2.0F, 1.5F};
  const std::array<float, 6> guards{-1.0F, 1e6F, 5.0F, 60.0F, 8.0F, 1.5F};
  for (const float value : scaling) {
    body.real(value);
  }
  for (const float value : forgetting) {
    body.real(value);
  }
  for (const float value : guards) {
    body.real(value);
  }
  body.word(20).real(1e-5F).real(0.05F).real(0.1F).word(20).real(1e6F).real(1e4F);
  for (const float value : {0.01F, 40.0F, 2.0F, 6.0F, 2.0F, 10.0F, 200.0F, 0.05F}) {
    body.real(value);
  }
  body.word(100);
  std::vector<std::uint8_t> made = body.bytes();
  for (int changes = data.up_to(3); changes > 0; --changes) {
    const float value = data.real();
    const std::size_t place = 5 + 4 * static_cast<std::size_t>(data.up_to(33));
    std::memcpy(made.data() + place, &value, sizeof value);
  }
  return made;
}

/// The same of a ServoEstimator.
std::vector<std::uint8_t> servo_configuration(fuzz::Data& data) {
  Body body;
  body.byte(static_cast<std::uint8_t>(data.up_to(21)));
  body.byte(static_cast<std::uint8_t>(data.up_to(31) & servo::kServoFlags));
  for (const float value : {0.02F, 0.1F, 0.01F, 40.0F, 2.0F, 6.0F, 2.0F, 10.0F, 200.0F, 0.05F}) {
    body.real(data.up_to(15) == 0 ? data.real() : value);
  }
  return body.word(100).bytes();
}

std::vector<std::uint8_t> sample(fuzz::Data& data, std::uint32_t number) {
  return Body()
      .word(number)
      .real(data.real())
      .real(data.real())
      .real(data.real())
      .real(data.real())
      .bytes();
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  fuzz::Data data(bytes, count);
  Line line;
  std::uint32_t number = 0;
  while (!data.empty()) {
    switch (data.up_to(7)) {
      case 0: {  // as it comes
        const auto raw = taken(data, data.next<std::uint16_t>() % kMostBytes);
        line.send(raw.data(), raw.size());
        break;
      }
      case 1: {  // any request
        const auto kind = data.next<std::uint8_t>();
        const bool again = data.coin();
        line.request(kind, again, taken(data, data.next<std::uint16_t>() % kMostBytes));
        break;
      }
      case 2:
        line.request(0x01, false, {1, 0});  // hello
        break;
      case 3:
        if (data.coin()) {
          line.request(0x02, false, configuration(data));
        } else {
          line.request(0x07, false, servo_configuration(data));
        }
        break;
      case 4:
        number = data.coin() ? data.next<std::uint32_t>() : 0;
        line.request(0x03, false, Body().word(number).bytes());  // start
        break;
      case 5:
        line.request(0x04, data.up_to(7) == 0, sample(data, number++));
        break;
      case 6:
        line.request(data.coin() ? 0x05 : 0x06, false, {});  // resume, stop
        break;
      default:
        line.wait(data.next<std::uint16_t>());
        break;
    }
  }
  return 0;
}
