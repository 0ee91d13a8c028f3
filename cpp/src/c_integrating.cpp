// SPDX-License-Identifier: MIT
// The kernels of a servo whose integrator is known, for C: two poles beside it, with and without a constant term.
#include "c_kernel.hpp"

#include <ehsid/integrating.hpp>

namespace {
using Policy = ehsid::Exponential<float>;
template <int kN>
constexpr ehsid_kernel kernel() {
  using Model = ehsid::Integrating<ehsid::AnyArx<float, kN>>;
  return ehsid::c::kernel<Policy, kN, ehsid::Rls<float, kN, Policy>, 0, Model>();
}
}  // namespace

extern "C" const ehsid_kernel ehsid_kernel_integrating_5 = kernel<5>();
extern "C" const ehsid_kernel ehsid_kernel_integrating_6 = kernel<6>();
