// SPDX-License-Identifier: MIT
// Compiled apart from the other policies: together they would be one long compilation.
#include "../c_kernel.hpp"

#define EHSID_POLICY(n) ehsid::FRatio<float>
EHSID_DEFINE_KERNELS(f_ratio, EHSID_POLICY)
