// SPDX-License-Identifier: MIT
// Those kernels of ehsid::c that the servo names, for its host program: the others would cost a minute of compilation.
#include "../../cpp/src/c_kernel.hpp"

#define DEFINE_BOTH(policy)      \
  EHSID_DEFINE_KERNEL(policy, 6) \
  EHSID_DEFINE_KERNEL(policy, 7)

EHSID_EACH_POLICY(DEFINE_BOTH)
