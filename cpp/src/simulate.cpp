// SPDX-License-Identifier: MIT
#include <ehsid/plant/simulate.hpp>

#include "sensitivities.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace ehsid::plant {
namespace detail {

Kernels portable_kernels() { return kernels<2, 4, 8>(); }

}  // namespace detail

namespace {

using detail::Kernels;

/// The fastest that this processor has. All give the same numbers, bit for bit.
const Kernels& kernels_here() {
  static const Kernels kernels = [] {
#if defined(EHSID_PLANT_X86)
    if (__builtin_cpu_supports("avx512f")) {
      return detail::avx512_kernels();
    }
    if (__builtin_cpu_supports("avx2")) {
      return detail::avx2_kernels();
    }
#endif
    return detail::portable_kernels();
  }();
  return kernels;
}

}  // namespace

std::size_t parts(const Simulation& run, std::size_t threads) {
  // Fewer sensitivities than this take as long as this many.
  constexpr std::size_t kWorthAPart = 8;
  const std::size_t count = directions(run);
  const std::size_t most = kernels_here().back().lanes;
  const std::size_t needed = std::max<std::size_t>(1, (count + most - 1) / most);
  return std::max(needed, std::min(threads, count / kWorthAPart));
}

void simulate_part(const Simulation& run, std::size_t part, std::size_t of_parts,
                   const double* command, const double* aligned, std::size_t samples,
                   double* outputs, double* sensitivities) {
  const detail::Logged logged{command, aligned, samples};
  const std::size_t count = directions(run);
  if (count == 0) {
    detail::run_with<double>(run, run.values, {}, logged, [&](std::size_t k, const auto& output) {
      std::copy(output.begin(), output.end(), outputs + k * kOutputs);
    });
    return;
  }
  const std::size_t first = count * part / of_parts;
  const std::size_t end = count * (part + 1) / of_parts;
  const Kernels& kernels = kernels_here();
  const auto kernel = std::find_if(kernels.begin(), kernels.end(),
                                   [&](const auto& each) { return each.lanes >= end - first; });
  kernel->run(run, {first, end - first}, logged, part == 0 ? outputs : nullptr, sensitivities);
}

void simulate(const Simulation& run, const double* command, const double* aligned,
              std::size_t samples, double* outputs, double* sensitivities) {
  const std::size_t count = parts(run);
  for (std::size_t part = 0; part < count; ++part) {
    simulate_part(run, part, count, command, aligned, samples, outputs, sensitivities);
  }
}

}  // namespace ehsid::plant
