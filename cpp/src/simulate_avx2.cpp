// SPDX-License-Identifier: MIT
// Compiled for processors with AVX2; simulate.cpp calls it only there.
#include "sensitivities.hpp"

namespace ehsid::plant::detail {

Kernels avx2_kernels() { return kernels<4, 8, 16, 20>(); }

}  // namespace ehsid::plant::detail
