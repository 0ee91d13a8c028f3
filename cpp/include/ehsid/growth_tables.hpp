// SPDX-License-Identifier: MIT
// What a GrowthMonitor knows of its machine, made offline: growth_monitor.hpp says how it is used.
#pragma once

#include <ehsid/types.hpp>

#include <array>
#include <cmath>

namespace ehsid {

/// Cells of the command, and of the acceleration that the model has on the commands alone.
inline constexpr int kGrowthCommands = 8;
inline constexpr int kGrowthAccelerations = 5;
inline constexpr int kGrowthCells = kGrowthCommands * kGrowthAccelerations;
/// Longest delay in samples.
inline constexpr int kGrowthMostDelay = 8;
/// Signatures that are eliminated.
inline constexpr int kGrowthOthers = 2;

/// Cells of which a step of the work behind a block takes the sums.
inline constexpr int kGrowthGroup = 4;
static_assert(kGrowthCells % kGrowthGroup == 0, "groups are whole");

/// Steps of the work behind a block, one a sample: for each signature the groups of cells, and for each test what is eliminated
/// and the signatures.
constexpr int growth_steps(int signatures, int tests) {
  return (kGrowthOthers + signatures) * (kGrowthCells / kGrowthGroup) + tests * (signatures + 1);
}

/// What is known of the innovations in a cell.
template <class Scalar, int kSignatures>
struct GrowthCell {
  Scalar mean;                           // of the quiet machine, in units of the position
  Scalar weight;                         // 1 / deviation; 0 in a cell that is not used
  Array<Scalar, kGrowthOthers> other;    // change of the mean by what is eliminated, in deviations
  Array<Scalar, kSignatures> signature;  // by an effect of a size, in deviations
};

/// Does an effect grow? By the signature of its unit size.
template <class Scalar>
struct GrowthTest {
  std::int32_t signature;
  Scalar trust;   // 1 / phi, > 0
  Scalar margin;  // m, 0 <= m < 1
};

/// All that is made offline. Constant: a monitor keeps its address only. Each effect has a test, and may have more signatures.
template <class Scalar, int kSignatures, int kTests>
struct GrowthTables {
  std::int32_t signatures;
  std::int32_t tests;
  std::int32_t
      delay;  // samples from a command to the first position that shows it, 1 .. kGrowthMostDelay
  std::int32_t settle;  // samples that the observer needs behind a start or a refused sample
  std::int32_t block;   // samples of a block, >= growth_steps()
  // The servo over one period (servo_transition.hpp), in units of the position and of one period, and its observer.
  Scalar gain;  // K dt
  Scalar s, w, e, i, decay, pull;
  std::array<Scalar, 3> correction;  // of position, velocity, acceleration, for an innovation of 1
  std::array<Scalar, kGrowthCommands - 1> command_edges;  // rising; units of the command
  std::array<Scalar, kGrowthAccelerations - 1> acceleration_edges;
  std::array<GrowthCell<Scalar, kSignatures>, kGrowthCells> cells;
  Array<std::int32_t, kSignatures> effect;  // of each signature: the test of its effect
  Array<GrowthTest<Scalar>, kTests> asked;
  Scalar prior;  // precision of what is eliminated, > 0
  Scalar limit;  // > 0

  /// May a monitor use them?
  bool valid() const {
    bool good = Extent<kSignatures>::accepts(signatures) && Extent<kTests>::accepts(tests) &&
                delay >= 1 && delay <= kGrowthMostDelay && settle >= 0 &&
                block >= growth_steps(signatures, tests) && is_squarable(limit) &&
                limit > Scalar(0) && is_normal_positive(prior) && is_squarable(prior) &&
                all_squarable(7, std::array<Scalar, 7>{gain, s, w, e, i, decay, pull}) &&
                all_squarable(3, correction) && rises(command_edges) && rises(acceleration_edges);
    for (std::size_t n = 0; good && n < static_cast<std::size_t>(tests); ++n) {
      const GrowthTest<Scalar>& test = asked[n];
      good = test.signature >= 0 && test.signature < signatures && is_normal_positive(test.trust) &&
             is_squarable(test.trust) && test.margin >= Scalar(0) && test.margin < Scalar(1);
    }
    for (std::size_t n = 0; good && n < static_cast<std::size_t>(signatures); ++n) {
      good = effect[n] >= 0 && effect[n] < tests;
    }
    for (const auto& cell : cells) {
      good = good && is_squarable(cell.mean) && is_squarable(cell.weight) &&
             cell.weight >= Scalar(0) && modest(kGrowthOthers, cell.other) &&
             modest(signatures, cell.signature);
    }
    return good;
  }

 private:
  /// A signature beyond so many deviations belongs to a size that is too large.
  static constexpr Scalar kMostSignature = Scalar(1000);

  template <class Values>
  static bool modest(int count, const Values& values) {
    bool good = true;
    for (int n = 0; good && n < count; ++n) {
      good = std::abs(entry(values, n)) <= kMostSignature;
    }
    return good;
  }
  template <class Edges>
  static bool rises(const Edges& edges) {
    bool good = is_finite(edges[0]);
    for (std::size_t n = 1; n < edges.size(); ++n) {
      good = good && is_finite(edges[n]) && edges[n] > edges[n - 1];
    }
    return good;
  }
};

}  // namespace ehsid
