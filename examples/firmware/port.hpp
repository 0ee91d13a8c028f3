// SPDX-License-Identifier: MIT
// What firmware asks of a board, and all it asks. One folder in port/ answers for each kind of board;
// docs/porting.md says what an answer has to keep to. No heap, no exceptions, no static constructors.
#pragma once

#include <cstddef>
#include <cstdint>

namespace port {

/// Ticks of milliseconds() a second.
constexpr std::uint32_t kTicksPerSecond = 1000;

/// Name of the board, up to 12 characters of ASCII.
const char* board_name();

/// Serial line and loop timer on. Once, before anything else here; the floating-point unit is on already.
void start();

/// The next byte received, if there is one. Never waits. Bytes that come meanwhile are kept, at least 256 of them.
bool read(std::uint8_t& byte);

/// Sends `count` bytes; waits while the line is busy.
void write(const void* bytes, std::size_t count);

/// Time since start(), from the loop timer. Wraps after 49 days: compare differences.
std::uint32_t milliseconds();

/// Processor clock since start(). Wraps at 2^32. Right with interrupts masked too, for up to one tick.
std::uint32_t cycles();

/// Sleeps until a byte is received, at the latest until the next tick. Returns at once while one can be read.
void wait_for_interrupt();

/// Ends the program: 0 for success. An emulator exits with `code`; a board stays where it is.
[[noreturn]] void stop(int code);

}  // namespace port
