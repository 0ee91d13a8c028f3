// SPDX-License-Identifier: MIT
// Compiled apart from the other policies: together they would be one long compilation.
#include "../c_kernel.hpp"

#define EHSID_POLICY(n) ehsid::Directional<float>
EHSID_DEFINE_KERNELS(directional, EHSID_POLICY)
