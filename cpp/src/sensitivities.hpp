// SPDX-License-Identifier: MIT
// Runs of the plant on dual numbers, compiled once for each instruction set (simulate*.cpp).
#pragma once

#include <ehsid/plant/simulate.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

namespace ehsid::plant::detail {

/// A part of a run: the sensitivities of some of the varied parameters and disturbances.
struct Part {
  std::size_t first;  // place among the varied, then the disturbances
  std::size_t count;
};

/// A record: command, null or states to align with, number of samples.
struct Logged {
  const double* command;
  const double* aligned;
  std::size_t samples;
};

/// Runs the plant. Writes the outputs unless `outputs` is null, and the sensitivities of the part.
using RunPart = void (*)(const Simulation& run, const Part& part, const Logged& logged,
                         double* outputs, double* sensitivities);

/// Runs for different numbers of sensitivities, fewest first. A run takes as long for a few as for as many as it has
/// lanes.
struct Kernel {
  std::size_t lanes;
  RunPart run;
};
using Kernels = std::vector<Kernel>;

Kernels portable_kernels();
#if defined(EHSID_PLANT_X86)
Kernels avx2_kernels();
Kernels avx512_kernels();
#endif

template <class Scalar, class Use>
void run_with(const Simulation& run, const std::vector<Scalar>& values,
              Disturbances<Scalar> disturbances, const Logged& logged, Use use) {
  ServoPlant<Scalar> plant(run.kind, values, run.dt, run.substeps, logged.samples, run.tables,
                           std::move(disturbances));
  for (std::size_t k = 0; k < logged.samples; ++k) {
    if (logged.aligned != nullptr) {
      std::array<double, kStates> state;
      std::copy_n(logged.aligned + k * kStates, kStates, state.begin());
      plant.align(state);
    }
    use(k, in_order(plant.read()));
    if (k == 0) {
      plant.foresee(logged.command[0]);
    }
    if (k + 1 < logged.samples) {
      plant.foresee(logged.command[k + 1]);
    }
    plant.advance(logged.command[k]);
  }
}

template <class Partials>
void run_part(const Simulation& run, const Part& part, const Logged& logged, double* outputs,
              double* sensitivities) {
  std::vector<Dual<Partials>> values(run.values.begin(), run.values.end());
  const std::size_t end = part.first + part.count;
  const std::size_t of_values = run.varied.size();
  for (std::size_t i = part.first; i < (std::min)(end, of_values); ++i) {
    values[run.varied[i]].partial.set(i - part.first, 1.0);
  }
  const std::size_t first_signal = (std::max)(part.first, of_values);
  std::vector<Disturbance> signals;
  for (std::size_t i = first_signal; i < end; ++i) {
    signals.push_back(run.disturbances[i - of_values]);
  }
  Disturbances<Dual<Partials>> disturbances(std::move(signals), logged.samples,
                                            first_signal - part.first);
  const std::size_t row = directions(run);
  const auto write = [&](std::size_t k, const auto& output) {
    if (outputs != nullptr) {
      for (std::size_t j = 0; j < kOutputs; ++j) {
        outputs[k * kOutputs + j] = output[j].value;
      }
    }
    for (std::size_t w = 0; w < run.watched.size(); ++w) {
      double* const out = sensitivities + (w * logged.samples + k) * row + part.first;
      const Partials& partial = output[run.watched[w]].partial;
      for (std::size_t i = 0; i < part.count; ++i) {
        out[i] = partial[i];
      }
    }
  };
  run_with<Dual<Partials>>(run, values, std::move(disturbances), logged, write);
}

/// kWidth numbers in a register; the types of the dual numbers depend on it.
template <int kWidth, int... kLanes>
Kernels kernels() {
  return {{kLanes, &run_part<Lanes<kLanes, kWidth>>}...};
}

}  // namespace ehsid::plant::detail
