// SPDX-License-Identifier: MIT
#include <ehsid/plant/simulate.hpp>

#include <algorithm>
#include <cmath>

namespace ehsid::plant {
namespace {

template <class Scalar, class Use>
void run_with(const Simulation& run, const std::vector<Scalar>& values, const double* command,
              const double* aligned, std::size_t samples, Use use) {
  ServoPlant<Scalar> plant(run.kind, values, run.dt, run.substeps, samples);
  for (std::size_t k = 0; k < samples; ++k) {
    if (aligned != nullptr) {
      std::array<double, kStates> state;
      std::copy_n(aligned + k * kStates, kStates, state.begin());
      plant.align(state);
    }
    use(k, in_order(plant.read()));
    plant.advance(command[k]);
  }
}

/// Sensitivities of up to kN parameters, varied[first] onwards.
template <int kN>
void run_batch(const Simulation& run, std::size_t first, const double* command,
               const double* aligned, std::size_t samples, double* outputs, double* sensitivities) {
  const std::size_t all = run.varied.size();
  const std::size_t here = std::min(all - first, static_cast<std::size_t>(kN));
  std::vector<Dual<kN>> values(run.values.begin(), run.values.end());
  for (std::size_t i = 0; i < here; ++i) {
    values[run.varied[first + i]].partial[static_cast<Eigen::Index>(i)] = 1.0;
  }
  run_with<Dual<kN>>(run, values, command, aligned, samples,
                     [&](std::size_t k, const auto& output) {
                       for (std::size_t j = 0; j < kOutputs; ++j) {
                         outputs[k * kOutputs + j] = output[j].value;
                         for (std::size_t i = 0; i < here; ++i) {
                           sensitivities[(k * all + first + i) * kOutputs + j] =
                               output[j].partial[static_cast<Eigen::Index>(i)];
                         }
                       }
                     });
}

}  // namespace

void simulate(const Simulation& run, const double* command, const double* aligned,
              std::size_t samples, double* outputs, double* sensitivities) {
  if (sensitivities == nullptr || run.varied.empty()) {
    run_with<double>(run, run.values, command, aligned, samples,
                     [&](std::size_t k, const auto& output) {
                       std::copy(output.begin(), output.end(), outputs + k * kOutputs);
                     });
    return;
  }
  std::size_t first = 0;
  while (first < run.varied.size()) {
    const std::size_t left = run.varied.size() - first;
    if (left > 4) {
      run_batch<8>(run, first, command, aligned, samples, outputs, sensitivities);
      first += 8;
    } else {
      run_batch<4>(run, first, command, aligned, samples, outputs, sensitivities);
      first += 4;
    }
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
