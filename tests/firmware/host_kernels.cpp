// SPDX-License-Identifier: MIT
// Those kernels of ehsid::c that the servo names, for its host program: the others would cost a minute of compilation.
#include "../../cpp/src/c_kernel.hpp"

#define CONSTANT(n) ehsid::Constant<float>
#define EXPONENTIAL(n) ehsid::Exponential<float>
#define ERROR_DRIVEN(n) ehsid::ErrorDriven<float>
#define F_RATIO(n) ehsid::FRatio<float>
#define DIRECTIONAL(n) ehsid::Directional<float>
#define RANDOM_WALK(n) ehsid::RandomWalk<float, n>

#define DEFINE_BOTH(name, POLICY)      \
  EHSID_DEFINE_KERNEL(name, POLICY, 6) \
  EHSID_DEFINE_KERNEL(name, POLICY, 7)

DEFINE_BOTH(constant, CONSTANT)
DEFINE_BOTH(exponential, EXPONENTIAL)
DEFINE_BOTH(error_driven, ERROR_DRIVEN)
DEFINE_BOTH(f_ratio, F_RATIO)
DEFINE_BOTH(directional, DIRECTIONAL)
DEFINE_BOTH(random_walk, RANDOM_WALK)
