// SPDX-License-Identifier: MIT
// Compiled apart from the other policies: together they would be one long compilation.
#include "../c_kernel.hpp"

#define EHSID_POLICY(n) ehsid::RandomWalk<float, n>
EHSID_DEFINE_KERNELS(random_walk, EHSID_POLICY)
