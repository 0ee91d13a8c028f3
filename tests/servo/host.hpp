// SPDX-License-Identifier: MIT
// A host that talks to a Servo in the same program, and writes its requests from docs/hil_protocol.md by itself.
#pragma once

#include <gtest/gtest.h>
#include <servo/servo.hpp>

#include <cstring>
#include <vector>

namespace test {

using Packet = std::vector<std::uint8_t>;

/// Bytes, one number behind the other. The processors these tests run on are little-endian.
class Body {
 public:
  template <class Number>
  Body& add(Number value) {
    const auto* first = reinterpret_cast<const std::uint8_t*>(&value);
    bytes.insert(bytes.end(), first, first + sizeof value);
    return *this;
  }
  Body& reals(std::initializer_list<float> values) {
    for (const float value : values) {
      add(value);
    }
    return *this;
  }
  Packet bytes;
};

inline servo::Bytes view(const Packet& packet) { return {packet.data(), packet.size()}; }

inline Packet copy(servo::Bytes bytes) { return {bytes.data, bytes.data + bytes.count}; }

/// The frame of a packet, CRC included.
inline Packet framed(Packet packet) {
  const std::uint16_t crc = servo::crc16(view(packet));
  packet.push_back(static_cast<std::uint8_t>(crc));
  packet.push_back(static_cast<std::uint8_t>(crc >> 8U));
  Packet frame(servo::cobs_bytes(packet.size()) + 1);
  frame.resize(servo::cobs_encode(view(packet), frame.data()));
  frame.push_back(0);
  return frame;
}

/// A number at a place of an answer's body.
template <class Number>
Number at(const Packet& body, std::size_t place) {
  Number value{};
  EXPECT_LE(place + sizeof value, body.size());
  if (place + sizeof value <= body.size()) {
    std::memcpy(&value, body.data() + place, sizeof value);
  }
  return value;
}

/// The one packet in the bytes of a line; kind 0 where there is none.
struct Heard {
  std::uint8_t kind = 0;
  std::uint16_t sequence = 0;
  Packet body;
};

inline Heard hear(const Packet& line) {
  servo::FrameReader reader;
  Heard heard;
  for (const std::uint8_t byte : line) {
    if (reader.take(byte)) {
      const Packet packet = copy(reader.packet());
      EXPECT_EQ(heard.kind, 0) << "two packets in one answer";
      heard = {packet[0], at<std::uint16_t>(packet, 1), {packet.begin() + 3, packet.end()}};
    }
  }
  EXPECT_EQ(reader.bad_frames.value(), 0);
  return heard;
}

/// What a configuration says; the defaults are those of the estimators in the tests.
struct Settings {
  std::uint8_t policy = 3, na = 3, nb = 3, nk = 1;
  std::uint8_t flags = servo::kPositionControl | servo::kFollowEstimate;
  std::vector<float> scaling{5.0F, 0.25F, 0.0F, 0.0F};
  std::vector<float> forgetting{0.995F, 0.98F, 0.9F, 60.0F, 0.8F, 1e-4F, 2.0F, 1.5F};
  std::vector<float> guards{-1.0F, 1e6F};
  std::vector<float> reset{5.0F, 60.0F, 8.0F, 1.5F};
  std::int32_t cool_down = 20;
  float reset_floor = 1e-5F;
  std::vector<float> convergence{0.05F, 0.1F};
  std::int32_t hold = 20;
  std::vector<float> start{1e6F, 1e4F};
  std::vector<float> controller{0.01F, 40.0F, 2.0F, 6.0F, 2.0F, 10.0F, 200.0F, 0.05F};
  std::uint32_t watchdog_ms = 100;
  std::vector<float> seed;

  Packet bytes() const {
    Body body;
    body.add(policy).add(na).add(nb).add(nk).add(flags);
    for (const auto* values : {&scaling, &forgetting, &guards, &reset}) {
      add(body, *values);
    }
    body.add(cool_down).add(reset_floor);
    add(body, convergence);
    body.add(hold);
    add(body, start);
    add(body, controller);
    body.add(watchdog_ms);
    add(body, seed);
    return body.bytes;
  }

 private:
  static void add(Body& body, const std::vector<float>& values) {
    for (const float value : values) {
      body.add(value);
    }
  }
};

/// What a configuration of a ServoEstimator says; the controller and the sampling time are those of Settings.
struct ServoSettings {
  std::uint8_t delay = 1;
  std::uint8_t flags = servo::kPositionControl | servo::kFollowEstimate;
  float drift = 0.02F;
  float tolerance = 0.1F;
  std::vector<float> controller = Settings{}.controller;
  std::uint32_t watchdog_ms = 100;

  Packet bytes() const {
    Body body;
    body.add(delay).add(flags).add(drift).add(tolerance);
    for (const float value : controller) {
      body.add(value);
    }
    return body.add(watchdog_ms).bytes;
  }
};

class Host {
 public:
  Host() {
    const Heard identity = hear(copy(target.power_up("test", [] { return 0U; })));
    EXPECT_EQ(identity.kind, 0x81);
    EXPECT_EQ(identity.sequence, 0);
  }

  /// Everything that comes back for these bytes.
  Packet send(const Packet& bytes) {
    Packet back;
    for (const std::uint8_t byte : bytes) {
      const servo::Bytes answer = target.receive(byte, now_ms);
      back.insert(back.end(), answer.data, answer.data + answer.count);
    }
    return back;
  }

  /// The next request.
  Heard ask(std::uint8_t kind, const Packet& body = {}) {
    ++sequence;
    Packet packet{kind, static_cast<std::uint8_t>(sequence),
                  static_cast<std::uint8_t>(sequence >> 8U)};
    packet.insert(packet.end(), body.begin(), body.end());
    last = framed(packet);
    const Heard heard = hear(send(last));
    EXPECT_EQ(heard.sequence, sequence);
    return heard;
  }

  Heard hello() { return ask(1, {1, 0}); }
  Heard configure(const Settings& settings = {}) { return ask(2, settings.bytes()); }
  Heard configure(const ServoSettings& settings) { return ask(7, settings.bytes()); }
  Heard start(std::uint32_t first = 0) { return ask(3, Body().add(first).bytes); }
  Heard sample(std::uint32_t number, float position, float reference = 0.0F, float velocity = 0.0F,
               float direct = 0.0F) {
    return ask(4, Body().add(number).reals({position, reference, velocity, direct}).bytes);
  }
  Heard resume() { return ask(5); }
  Heard stop() { return ask(6); }

  /// As the main loop does; what it sends unasked.
  Heard wait(std::uint32_t milliseconds) {
    Packet sent;
    for (std::uint32_t i = 0; i < milliseconds; ++i) {
      ++now_ms;
      const Packet more = copy(target.tick(now_ms));
      sent.insert(sent.end(), more.begin(), more.end());
    }
    return hear(sent);
  }

  servo::Servo target;
  std::uint32_t now_ms = 0xFFFFFFF0U;  // wraps in every test
  std::uint16_t sequence = 0xFFF8U;
  Packet last;  // the frame of the last request
};

}  // namespace test
