// SPDX-License-Identifier: MIT
// Compiled for processors with AVX-512; simulate.cpp calls it only there.
#include "sensitivities.hpp"

namespace ehsid::plant::detail {

Kernels avx512_kernels() { return kernels<8, 8, 16, 32, 40>(); }

}  // namespace ehsid::plant::detail
