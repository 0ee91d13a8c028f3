// SPDX-License-Identifier: MIT
// Compiled apart from the other policies: together they would be one long compilation.
#include "../c_kernel.hpp"

#define EHSID_POLICY(n) ehsid::Constant<float>
EHSID_DEFINE_KERNELS(constant, EHSID_POLICY)
