// SPDX-License-Identifier: MIT
// The target of docs/hil_protocol.md: bytes and milliseconds in, bytes out. Knows no board.
#pragma once

#include "answers.hpp"
#include "frame_reader.hpp"
#include "frame_writer.hpp"
#include "watchdog.hpp"

namespace servo {

constexpr std::uint32_t kSafeAgainMs = 1000;

class Servo {
 public:
  using CycleCounter = std::uint32_t (*)();

  /// Once, before anything else. What is returned by this and the next two is to be sent; it stays until the next
  /// call of any of them. `board`: up to 12 characters, kept.
  Bytes power_up(const char* board, CycleCounter cycles);

  /// A byte of the line.
  Bytes receive(std::uint8_t byte, std::uint32_t now_ms);

  /// Each tick, before the bytes that came meanwhile: what came too late finds the valve closed.
  Bytes tick(std::uint32_t now_ms);

  /// For the valve, at any time.
  float valve_command_v() const { return valve_command_v_; }
  State state() const { return state_; }

 private:
  /// Why a request is refused; Reason::none where it is not.
  struct Refusal {
    Reason reason;
    ehsid_status status;
  };

  Bytes answer(Bytes packet, std::uint32_t now_ms);
  bool late(std::uint16_t sequence) const;
  Refusal carry_out(Request request, Bytes body);
  Refusal configure(Request request, Bytes body);
  Refusal take_sample(Bytes body);
  Bytes identity(std::uint16_t sequence, FrameWriter& frame);
  Bytes done(std::uint16_t sequence);
  Bytes result(std::uint16_t sequence);
  Bytes refused(std::uint16_t sequence, const Refusal& refusal);
  Bytes safe_notice(std::uint32_t now_ms);
  void close_valve(State next);

  State state_ = State::idle;
  float valve_command_v_ = 0.0F;
  std::uint32_t expected_ = 0;  // number of the next sample

  FrameReader reader_;
  FrameWriter answer_;  // the last one, for who asks again
  FrameWriter notice_;  // what goes out unasked
  bool answered_ = false;
  Request last_request_ = Request::none;
  std::uint16_t last_sequence_ = 0;

  Watchdog watchdog_;
  std::uint32_t noticed_ms_ = 0;
  Counter16 repeated_;
  Counter16 trips_;

  ControlLoop loop_;
  Result result_{};
  std::uint32_t step_cycles_ = 0;

  // Zero like everything before: a Servo in static storage then takes no room among the constants.
  const char* board_ = nullptr;
  CycleCounter cycles_ = nullptr;
};

}  // namespace servo
