// SPDX-License-Identifier: MIT
// The same programs on the host: the serial line is standard input and output.
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "port.hpp"

namespace port {

void start() {}

bool read(std::uint8_t& byte) {
  const int character = std::getchar();
  if (character == EOF) {
    stop(71);  // the programs wait for bytes; none will come
  }
  byte = static_cast<std::uint8_t>(character);
  return true;
}

void write(const void* bytes, std::size_t count) {
  static_cast<void>(std::fwrite(bytes, 1, count, stdout));
}

std::uint32_t milliseconds() {
  using std::chrono::steady_clock;
  const auto since = steady_clock::now().time_since_epoch();
  return static_cast<std::uint32_t>(
      std::chrono::duration_cast<std::chrono::milliseconds>(since).count());
}

std::uint32_t cycles() { return milliseconds(); }

void wait_for_interrupt() {}

void stop(int code) { std::exit(code); }

}  // namespace port
