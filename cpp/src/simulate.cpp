// SPDX-License-Identifier: MIT
#include <ehsid/plant/simulate.hpp>

#include "sensitivities.hpp"

#include <algorithm>
#include <cmath>
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

std::size_t parts(const Simulation& run) {
  const std::size_t most = kernels_here().back().lanes;
  return std::max<std::size_t>(1, (run.varied.size() + most - 1) / most);
}

void simulate_part(const Simulation& run, std::size_t part, const double* command,
                   const double* aligned, std::size_t samples, double* outputs,
                   double* sensitivities) {
  const detail::Logged logged{command, aligned, samples};
  if (run.varied.empty()) {
    detail::run_with<double>(run, run.values, logged, [&](std::size_t k, const auto& output) {
      std::copy(output.begin(), output.end(), outputs + k * kOutputs);
    });
    return;
  }
  const Kernels& kernels = kernels_here();
  const std::size_t first = part * kernels.back().lanes;
  const detail::Part here{first, std::min(run.varied.size() - first, kernels.back().lanes)};
  const auto kernel = std::find_if(kernels.begin(), kernels.end(),
                                   [&](const auto& each) { return each.lanes >= here.count; });
  kernel->run(run, here, logged, part == 0 ? outputs : nullptr, sensitivities);
}

void simulate(const Simulation& run, const double* command, const double* aligned,
              std::size_t samples, double* outputs, double* sensitivities) {
  for (std::size_t part = 0; part < parts(run); ++part) {
    simulate_part(run, part, command, aligned, samples, outputs, sensitivities);
  }
}

int recommended_substeps(PlantKind kind, const std::vector<double>& values, double dt) {
  const ServoPlant<double> plant(kind, values, dt, 1, 0);
  constexpr int kLeast = 2;
  constexpr int kMost = 1000;
  const double steps = std::ceil(plant.fastest_rate() * dt / kRadiansPerStep);
  return std::clamp(steps < kMost ? static_cast<int>(steps) : kMost, kLeast, kMost);
}

}  // namespace ehsid::plant
