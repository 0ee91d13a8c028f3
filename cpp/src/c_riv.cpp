// SPDX-License-Identifier: MIT
// The kernel of instrumental variables for the servo of third order, for C.
#include "c_kernel.hpp"

namespace {
using Policy = ehsid::Exponential<float>;
using Recursion = ehsid::InstrumentalVariables<float, 3, 6, Policy>;
}  // namespace

extern "C" const ehsid_kernel ehsid_kernel_riv_6 = ehsid::c::kernel<Policy, 6, Recursion, 3>();
