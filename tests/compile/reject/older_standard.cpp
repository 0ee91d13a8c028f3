// SPDX-License-Identifier: MIT
// expected: ehsid needs C++17: compile with -std=c++17 or newer
// standard: c++14
#include <ehsid/ehsid.hpp>
