// SPDX-License-Identifier: MIT
// Bodies of the answers, in the order of docs/hil_protocol.md.
#pragma once

#include "control_loop.hpp"

namespace servo {

/// What a `result` or `servo_result` says beside the sample.
struct Counts {
  std::uint32_t step_cycles;
  std::uint16_t bad_frames;
  std::uint16_t repeated;
  std::uint16_t trips;
};

void write_identity(Writer& out, const char* board);
void write_result(Writer& out, std::uint32_t number, const Result& result, const Counts& counts);
void write_servo_result(Writer& out, std::uint32_t number, const Result& result,
                        const Counts& counts);

}  // namespace servo
