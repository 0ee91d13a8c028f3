// SPDX-License-Identifier: MIT
// The kernels that the fuzz targets name: with sanitizers those of all sizes would take ten minutes to compile.
#include "../../cpp/src/c_kernel.hpp"

#define FUZZ_DEFINE(policy)      \
  EHSID_DEFINE_KERNEL(policy, 2) \
  EHSID_DEFINE_KERNEL(policy, 6) \
  EHSID_DEFINE_KERNEL(policy, 7) \
  EHSID_DEFINE_KERNEL(policy, 13)

EHSID_EACH_POLICY(FUZZ_DEFINE)
