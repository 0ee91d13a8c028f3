// SPDX-License-Identifier: MIT
// Which estimators this firmware holds: the linker takes those that kernels.cpp names. Fewer take less flash.
#pragma once

#include <ehsid/c_api.h>

#include <cstdint>

namespace servo {

/// Bit i: policy i of the protocol.
constexpr std::uint8_t kPolicies = 0x3F;
/// Bit n: estimators of n parameters.
constexpr std::uint16_t kParameterCounts = 1U << 6U | 1U << 7U;

/// nullptr where this firmware does not hold it.
const ehsid_kernel* find_kernel(std::uint32_t policy, std::uint32_t parameters);

}  // namespace servo
