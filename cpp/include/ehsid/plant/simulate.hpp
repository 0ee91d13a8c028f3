// SPDX-License-Identifier: MIT
// The plant on a logged command, compiled once (cpp/src/simulate.cpp).
#pragma once

#include <ehsid/plant/servo_plant.hpp>

#include <cstddef>
#include <vector>

namespace ehsid::plant {

/// Numbers in a row of outputs, see kOutputNames.
inline constexpr std::size_t kOutputs = kOutputNames.size();

/// One run.
struct Simulation {
  PlantKind kind = PlantKind::ehs;
  double dt = 1e-3;  // sampling time of the command, s
  int substeps = 2;  // steps of integration a sample
  std::vector<TableShape> tables;
  std::vector<double> values;       // as plant_parameters(), then the values of the tables
  std::vector<std::size_t> varied;  // positions in `values` of those whose sensitivities are wanted
  std::vector<Disturbance> disturbances;  // their sensitivities follow those of the varied
  std::vector<std::size_t> watched{0, 1, 2, 3, 4, 5};  // outputs whose sensitivities are wanted
};

/// Number of derivatives of each watched output.
inline std::size_t directions(const Simulation& run) {
  return run.varied.size() + run.disturbances.size();
}

/// Runs over `samples` commands, V, each held until the next.
///
/// aligned: null, or samples x kStates: what is not NaN replaces the state at that sample.
/// outputs: samples x kOutputs. sensitivities: watched x samples x directions, derivatives of each watched output by each
/// varied value and by the size of each disturbance; may be null where there are none.
void simulate(const Simulation& run, const double* command, const double* aligned,
              std::size_t samples, double* outputs, double* sensitivities);

/// A run with many sensitivities is made in parts, each with an even share of them: as many parts as there are threads,
/// as long as none becomes too small to be worth the repetition of what they have in common, or more where the
/// processor cannot compute so many at once.
std::size_t parts(const Simulation& run, std::size_t threads = 1);
/// A part, of as many. Parts may run side by side: together they write what simulate() writes, each its own share.
void simulate_part(const Simulation& run, std::size_t part, std::size_t of_parts,
                   const double* command, const double* aligned, std::size_t samples,
                   double* outputs, double* sensitivities);

}  // namespace ehsid::plant
