// SPDX-License-Identifier: MIT
#include "servo.hpp"

namespace servo {

namespace {

/// A request of this protocol, of the right length?
bool known(Request request, Bytes body) {
  switch (request) {
    case Request::hello:
      return body.count == kHelloBytes;
    case Request::configure:
      return configure_length_right(body);
    case Request::configure_servo:
      return body.count == kConfigureServoBytes;
    case Request::start:
      return body.count == kStartBytes;
    case Request::sample:
      return body.count == kSampleBytes;
    case Request::resume:
    case Request::stop:
      return body.count == 0;
    case Request::none:
      break;
  }
  return false;
}

}  // namespace

Bytes Servo::power_up(const char* board, CycleCounter cycles) {
  board_ = board;
  cycles_ = cycles;
  return identity(0, notice_);
}

Bytes Servo::receive(std::uint8_t byte, std::uint32_t now_ms) {
  return reader_.take(byte) ? answer(reader_.packet(), now_ms) : Bytes{};
}

Bytes Servo::tick(std::uint32_t now_ms) {
  if (state_ == State::running && watchdog_.expired(now_ms)) {
    close_valve(State::safe);
    trips_.increment();
    return safe_notice(now_ms);
  }
  const bool again = state_ == State::safe && now_ms - noticed_ms_ >= kSafeAgainMs;
  return again ? safe_notice(now_ms) : Bytes{};
}

Bytes Servo::answer(Bytes packet, std::uint32_t now_ms) {
  Reader in(packet);
  const std::uint8_t kind = in.u8();
  const std::uint16_t sequence = in.u16();
  const Bytes body = in.rest();
  const auto request = static_cast<Request>(kind);
  const bool understood = known(request, body);
  const bool hello = understood && request == Request::hello;
  // An answer is not even refused: on a line that echoes, the refusal would be refused, for ever.
  if ((kind & kAnswerBit) != 0 || (late(sequence) && !hello)) {
    reader_.bad_frames.increment();
    return {};
  }
  if (understood) {
    watchdog_.feed(now_ms);
  }
  if (answered_ && !hello && request == last_request_ && sequence == last_sequence_) {
    repeated_.increment();
    return answer_.frame();
  }
  answered_ = true;
  last_request_ = request;
  last_sequence_ = sequence;
  if (hello) {
    close_valve(State::idle);
    return identity(sequence, answer_);
  }
  const Refusal refusal =
      understood ? carry_out(request, body) : Refusal{Reason::unknown, EHSID_OK};
  if (refusal.reason != Reason::none) {
    return refused(sequence, refusal);
  }
  return request == Request::sample ? result(sequence) : done(sequence);
}

/// Behind the last request, by less than half of all sequence numbers: held up on the way and overtaken.
bool Servo::late(std::uint16_t sequence) const {
  const auto ahead = static_cast<std::uint16_t>(sequence - last_sequence_);
  return answered_ && ahead >= 0x8000U;
}

Servo::Refusal Servo::carry_out(Request request, Bytes body) {
  const Refusal carried_out{Reason::none, EHSID_OK};
  const Refusal not_now{Reason::state, EHSID_OK};
  switch (request) {
    case Request::configure:
    case Request::configure_servo:
      return state_ == State::idle || state_ == State::ready ? configure(request, body) : not_now;
    case Request::start:
      if (state_ != State::ready) {
        return not_now;
      }
      expected_ = Reader(body).u32();
      loop_.start();
      state_ = State::running;
      return carried_out;
    case Request::sample:
      return state_ == State::running ? take_sample(body) : not_now;
    case Request::resume:
      if (state_ != State::safe) {
        return not_now;
      }
      state_ = State::running;
      return carried_out;
    case Request::stop:
      if (state_ == State::idle) {
        return not_now;
      }
      close_valve(State::ready);
      return carried_out;
    case Request::hello:  // answered before
    case Request::none:
      break;
  }
  return {Reason::unknown, EHSID_OK};
}

Servo::Refusal Servo::configure(Request request, Bytes body) {
  Configuration wanted{};
  const Reason reason = request == Request::configure_servo ? read_servo_configuration(body, wanted)
                                                            : read_configuration(body, wanted);
  if (reason != Reason::none) {
    return {reason, reason == Reason::configuration ? EHSID_INVALID_ARGUMENT : EHSID_OK};
  }
  const ehsid_status status = loop_.configure(wanted);
  if (status != EHSID_OK) {
    return {Reason::configuration, status};
  }
  watchdog_.set_limit(wanted.watchdog_ms);
  state_ = State::ready;
  return {Reason::none, EHSID_OK};
}

Servo::Refusal Servo::take_sample(Bytes body) {
  Reader in(body);
  const std::uint32_t number = in.u32();
  const std::uint32_t lost = number - expected_;  // modulo 2^32: a number from behind is far ahead
  if (lost > kMostLost) {
    return {Reason::order, EHSID_OK};
  }
  Sample now{};
  for (float* value :
       {&now.position_m, &now.reference_m, &now.reference_velocity_m_s, &now.direct_v}) {
    *value = in.f32();
  }
  if (lost > 0) {
    loop_.forget_samples();
  }
  const std::uint32_t before = cycles_();
  result_ = loop_.sample(now);
  step_cycles_ = cycles_() - before;
  valve_command_v_ = result_.command.volts;
  expected_ = number + 1;
  return {Reason::none, EHSID_OK};
}

void Servo::close_valve(State next) {
  valve_command_v_ = 0.0F;
  loop_.fall_back();
  state_ = next;
}

Bytes Servo::identity(std::uint16_t sequence, FrameWriter& frame) {
  Writer out = frame.begin(Answer::identity, sequence);
  write_identity(out, board_);
  return frame.finish(out);
}

Bytes Servo::done(std::uint16_t sequence) {
  Writer out = answer_.begin(Answer::done, sequence);
  out.u8(static_cast<std::uint8_t>(state_));
  return answer_.finish(out);
}

Bytes Servo::result(std::uint16_t sequence) {
  const Counts counts{step_cycles_, reader_.bad_frames.value(), repeated_.value(), trips_.value()};
  const bool tracks = loop_.tracks_servo();
  Writer out = answer_.begin(tracks ? Answer::servo_result : Answer::result, sequence);
  (tracks ? write_servo_result : write_result)(out, expected_ - 1, result_, counts);
  return answer_.finish(out);
}

Bytes Servo::refused(std::uint16_t sequence, const Refusal& refusal) {
  Writer out = answer_.begin(Answer::refused, sequence);
  out.u8(static_cast<std::uint8_t>(refusal.reason));
  out.u8(static_cast<std::uint8_t>(state_));
  out.u8(static_cast<std::uint8_t>(refusal.status));
  out.u32(expected_);
  return answer_.finish(out);
}

Bytes Servo::safe_notice(std::uint32_t now_ms) {
  noticed_ms_ = now_ms;
  Writer out = notice_.begin(Answer::safe, 0);
  out.u16(trips_.value());
  out.u32(expected_);
  out.f32(valve_command_v_);
  return notice_.finish(out);
}

}  // namespace servo
