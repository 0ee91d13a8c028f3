// SPDX-License-Identifier: MIT
// The port for a host with POSIX: the serial line is standard input and output. When the input ends, so does the
// program: the firmware waits for bytes, and none will come.
#include "../../port.hpp"

#include <poll.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>

namespace {

constexpr int kTickMs = 1;
constexpr int kInputEnded = 71;  // what the program ends with

std::uint8_t waiting[4096];
std::size_t filled = 0;
std::size_t taken = 0;

/// True at the end of the input too: there is something to find out.
bool input_within(int milliseconds) {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  return ::poll(&input, 1, milliseconds) > 0;
}

std::uint64_t nanoseconds() {
  static const auto start = std::chrono::steady_clock::now();
  return static_cast<std::uint64_t>(
      std::chrono::nanoseconds(std::chrono::steady_clock::now() - start).count());
}

}  // namespace

namespace port {

const char* board_name() { return "host"; }

void start() { static_cast<void>(nanoseconds()); }

bool read(std::uint8_t& byte) {
  if (taken == filled) {
    if (!input_within(0)) {
      return false;
    }
    const ssize_t count = ::read(STDIN_FILENO, waiting, sizeof waiting);
    if (count <= 0) {
      stop(kInputEnded);
    }
    filled = static_cast<std::size_t>(count);
    taken = 0;
  }
  byte = waiting[taken++];
  return true;
}

void write(const void* bytes, std::size_t count) {
  const auto* next = static_cast<const std::uint8_t*>(bytes);
  while (count > 0) {
    const ssize_t sent = ::write(STDOUT_FILENO, next, count);
    if (sent <= 0) {
      stop(kInputEnded);
    }
    next += sent;
    count -= static_cast<std::size_t>(sent);
  }
}

std::uint32_t milliseconds() { return static_cast<std::uint32_t>(nanoseconds() / 1'000'000U); }

/// A clock of 1 GHz.
std::uint32_t cycles() { return static_cast<std::uint32_t>(nanoseconds()); }

void wait_for_interrupt() {
  if (taken == filled) {
    static_cast<void>(input_within(kTickMs));
  }
}

void stop(int code) { std::exit(code); }

}  // namespace port
