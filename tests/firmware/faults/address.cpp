// SPDX-License-Identifier: MIT
// Reads where there is no memory: the start-up code must say so and end the program.
#include "port.hpp"

int main() {
  port::start();
  return static_cast<int>(*reinterpret_cast<volatile std::uint32_t*>(0x9FFFFFF0U) & 1U);
}
