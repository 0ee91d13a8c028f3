// SPDX-License-Identifier: MIT
// A heap in a firmware image: check_image.cmake must find it.
#include <cstdlib>

#include "port.hpp"

static char room[1024];
static std::size_t used = 0;

extern "C" void* _sbrk(std::ptrdiff_t more) {
  used += static_cast<std::size_t>(more);
  return room + used - static_cast<std::size_t>(more);
}

extern "C" int* __errno() {
  static int number = 0;
  return &number;
}

int main() {
  port::start();
  return std::malloc(port::milliseconds() + 8) == nullptr ? 1 : 0;
}
