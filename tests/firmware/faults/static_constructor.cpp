// SPDX-License-Identifier: MIT
// A static object that needs a constructor before main(): the linker script must refuse it.
#include "port.hpp"

struct Late {
  Late() : since(port::milliseconds()) {}
  std::uint32_t since;
};
static const Late late;

int main() { return static_cast<int>(late.since); }
