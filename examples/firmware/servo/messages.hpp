// SPDX-License-Identifier: MIT
// Kinds, numbers and sizes of docs/hil_protocol.md, version 3.
#pragma once

#include "bytes.hpp"

namespace servo {

constexpr std::uint16_t kProtocolVersion = 3;

enum class Request : std::uint8_t {
  none = 0x00,  // never sent: there was no request yet
  hello = 0x01,
  configure = 0x02,
  start = 0x03,
  sample = 0x04,
  resume = 0x05,
  stop = 0x06,
  configure_servo = 0x07,
};

enum class Answer : std::uint8_t {
  identity = 0x81,
  done = 0x82,
  result = 0x84,
  refused = 0x85,
  safe = 0x86,
  servo_result = 0x87,
};
/// Set in the kind of every answer and of no request.
constexpr std::uint8_t kAnswerBit = 0x80;

enum class State : std::uint8_t { idle = 0, ready = 1, running = 2, safe = 3 };

enum class Reason : std::uint8_t {
  none = 0,  // carried out
  state = 1,
  order = 2,
  unknown = 3,
  configuration = 4,
  not_in_firmware = 5,
};

// Flags of `configure`
constexpr std::uint8_t kOffset = 1U << 0U;
constexpr std::uint8_t kReset = 1U << 1U;
constexpr std::uint8_t kPositionControl = 1U << 2U;
constexpr std::uint8_t kSeed = 1U << 3U;
constexpr std::uint8_t kFollowEstimate = 1U << 4U;
constexpr std::uint8_t kKnownFlags = 0x1FU;
/// Those of `configure_servo`
constexpr std::uint8_t kServoFlags = kPositionControl | kFollowEstimate;

// Flags of `result`; of `servo_result` the second and the third
constexpr std::uint8_t kConverged = 1U << 0U;
constexpr std::uint8_t kGainFromEstimate = 1U << 1U;
constexpr std::uint8_t kAtLimit = 1U << 2U;
constexpr std::uint8_t kResidualsNotWhite = 1U << 3U;  // the residuals are not white

// Bodies of requests, bytes
constexpr std::size_t kHelloBytes = 2;
constexpr std::size_t kConfigureBytes = 141;  // more with a seed
constexpr std::size_t kConfigureServoBytes = 46;
constexpr std::size_t kStartBytes = 4;
constexpr std::size_t kSampleBytes = 20;

/// A number of a sample that jumps ahead by up to so many tells of so many cycles without a sample.
constexpr std::uint32_t kMostLost = 1000;

constexpr std::size_t kBoardBytes = 12;
constexpr std::size_t kMaxParameters = 7;
/// The largest answer, a `result` of kMaxParameters, with kind, sequence and CRC; a `servo_result` is shorter.
constexpr std::size_t kMaxAnswer = 3 + 51 + 4 * kMaxParameters + 2;

}  // namespace servo
