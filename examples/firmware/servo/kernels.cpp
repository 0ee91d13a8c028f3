// SPDX-License-Identifier: MIT
#include "kernels.hpp"

namespace servo {

namespace {

constexpr std::uint32_t kFirst = 6;  // parameters: na + nb = 6, and 7 with a constant term
constexpr std::uint32_t kSizes = 2;

#define SERVO_KERNELS(policy) {EHSID_KERNEL(policy, 6), EHSID_KERNEL(policy, 7)},
const ehsid_kernel* const kKernels[][kSizes] = {EHSID_EACH_POLICY(SERVO_KERNELS)};
#undef SERVO_KERNELS

}  // namespace

const ehsid_kernel* find_kernel(std::uint32_t policy, std::uint32_t parameters) {
  const bool held = policy < sizeof kKernels / sizeof kKernels[0] && parameters >= kFirst &&
                    parameters < kFirst + kSizes;
  return held ? kKernels[policy][parameters - kFirst] : nullptr;
}

}  // namespace servo
