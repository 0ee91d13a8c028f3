// SPDX-License-Identifier: MIT
// Which instructions a bank runs, decided when it is made.
#pragma once

#include <ehsid/bank/lanes.hpp>

namespace ehsid::bank {

/// Instruction sets with a kernel of their own. The bits are the same with each of them.
enum class Isa : std::uint8_t {
  baseline,  // 128 bits: SSE2, NEON, or whatever the compiler makes of them
  avx2,      // 256 bits
  avx512     // 512 bits: AVX-512 F, BW, DQ and VL
};

#if defined(__x86_64__) || defined(__i386__)
#define EHSID_BANK_X86 1
// No FMA: it rounds once where the scalar code rounds twice.
#define EHSID_TARGET_AVX2 [[gnu::target("avx2")]]
#define EHSID_TARGET_AVX512 [[gnu::target("avx512f,avx512bw,avx512dq,avx512vl")]]
#else
#define EHSID_TARGET_AVX2
#define EHSID_TARGET_AVX512
#endif

/// Can this machine run it?
inline bool supported(Isa isa) {
#if defined(EHSID_BANK_X86)
  if (isa == Isa::avx2) {
    return __builtin_cpu_supports("avx2") != 0;
  }
  if (isa == Isa::avx512) {
    return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512bw") != 0 &&
           __builtin_cpu_supports("avx512dq") != 0 && __builtin_cpu_supports("avx512vl") != 0;
  }
#endif
  return isa == Isa::baseline;
}

/// The widest that this machine can run.
inline Isa best_isa() {
  if (supported(Isa::avx512)) {
    return Isa::avx512;
  }
  return supported(Isa::avx2) ? Isa::avx2 : Isa::baseline;
}

/// Bytes of a register.
constexpr int register_bytes(Isa isa) {
  return isa == Isa::baseline ? 16 : isa == Isa::avx2 ? 32 : 64;
}

/// As many numbers as fit into a register.
template <class Scalar, Isa kIsa>
using LanesIn = Lanes<Scalar, register_bytes(kIsa) / static_cast<int>(sizeof(Scalar))>;

}  // namespace ehsid::bank
