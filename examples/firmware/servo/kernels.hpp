// SPDX-License-Identifier: MIT
// Which estimators this firmware holds: the linker takes those that kernels.cpp names. Fewer take less flash.
#pragma once

#include <ehsid/c_api.h>

#include <cstdint>

namespace servo {

#define SERVO_NUMBER(policy) k_##policy,
enum PolicyNumber : std::uint32_t { EHSID_EACH_POLICY(SERVO_NUMBER) kPolicyCount };
#undef SERVO_NUMBER
static_assert(kPolicyCount <= 8, "the identity has a bit for each of eight policies");

/// Bit i: policy i of the protocol.
constexpr std::uint8_t kPolicies = (1U << kPolicyCount) - 1U;
/// Bit n: estimators of n parameters.
constexpr std::uint16_t kParameterCounts = 1U << 6U | 1U << 7U;

/// nullptr where this firmware does not hold it.
const ehsid_kernel* find_kernel(std::uint32_t policy, std::uint32_t parameters);

}  // namespace servo
