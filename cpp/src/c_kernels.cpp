// SPDX-License-Identifier: MIT
// The kernels of all policies, or only those of the policy that EHSID_POLICY names: CMake compiles one policy at a
// time, because together they are one long compilation.
#include "c_kernel.hpp"

#define EHSID_DEFINE_EXPANDED(policy) EHSID_DEFINE_KERNELS(policy)

#if defined(EHSID_POLICY)
EHSID_DEFINE_EXPANDED(EHSID_POLICY)
#else
EHSID_EACH_POLICY(EHSID_DEFINE_KERNELS)
#endif
