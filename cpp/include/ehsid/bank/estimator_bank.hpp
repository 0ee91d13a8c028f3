// SPDX-License-Identifier: MIT
// Many online estimators at once, each bit for bit the OnlineEstimator of arx_estimator.hpp. For hosts: memory comes from
// the heap.
#pragma once

#include <ehsid/bank/estimators.hpp>
#include <ehsid/bank/tiles.hpp>

namespace ehsid {

/// Where a run of a bank writes: all of it, or nothing where `theta` is null. A row has a number for each estimator, theta and deviation n of
/// them for each. Rows are those of every `every`-th sample: the `every`-th, the 2 `every`-th and so on.
template <class Scalar>
struct BankTrajectory {
  Scalar* theta = nullptr;
  Scalar* deviation = nullptr;
  Scalar* innovation = nullptr;
  Scalar* forgetting_factor = nullptr;
  Scalar* residual_variance = nullptr;
  bool* converged = nullptr;
  std::uint8_t* status = nullptr;
  std::size_t every = 1;
};

/// `count` estimators of the type One, an OnlineEstimator with an Rls, across SIMD lanes.
///
/// They start as copies of one estimator, and any of them can be replaced by another of the same orders with its own
/// settings, start values and state. Compile with -ffp-contract=off (the target ehsid::reproducible), or bits differ from
/// those of OnlineEstimator.
template <class One_>
class OnlineEstimatorBank {
 public:
  using One = One_;
  using Scalar = typename One::Scalar;

  /// isa: one that this machine supports, see bank::supported().
  explicit OnlineEstimatorBank(std::size_t count, bank::Isa isa = bank::best_isa())
      : OnlineEstimatorBank(count, One{}, isa) {}
  /// Each: One, or an OnlineEstimator with the same orders, chosen at run time, and the same kind of policy.
  template <class Each>
  OnlineEstimatorBank(std::size_t count, const Each& each, bank::Isa isa = bank::best_isa())
      : tiles_(count, each, isa) {}

  std::size_t size() const { return tiles_.size(); }
  bank::Isa isa() const { return tiles_.isa(); }

  /// Replaces an estimator, index < size(), by a copy of `one`, which has the same orders.
  template <class Each>
  void set(std::size_t index, const Each& one) {
    tiles_.set(index, one);
  }
  /// Writes the state of an estimator to `one`, which has its settings and start values.
  template <class Each>
  void get(std::size_t index, Each& one) {
    tiles_.get(index, one);
  }

  /// One sample for each estimator, in the units of its scaling: size() commands, positions and values of Status, as
  /// OnlineEstimator::step returns them.
  void step(const Scalar* commands, const Scalar* positions, std::uint8_t* status) {
    run({commands, size(), 1}, {positions, size(), 1}, 1, status);
  }

  /// `samples` of them. status: `samples` rows of size(), or null. The estimators first .. last - 1 alone where these are given, both
  /// a multiple of 64 or the end: threads can share a bank, each with a part of its own.
  void run(const bank::Table<Scalar>& commands, const bank::Table<Scalar>& positions,
           std::size_t samples, std::uint8_t* status, const BankTrajectory<Scalar>& trajectory = {},
           std::size_t first = 0, std::size_t last = static_cast<std::size_t>(-1)) {
    const Record record{commands,   positions, samples, status,
                        trajectory, size(),    first,   std::min(last, size())};
    tiles_.visit([&](auto& tiles) { take(tiles, record); });
  }

 private:
  struct Record {
    bank::Table<Scalar> commands;
    bank::Table<Scalar> positions;
    std::size_t samples;
    std::uint8_t* status;
    BankTrajectory<Scalar> trajectory;
    std::size_t count;
    std::size_t first;
    std::size_t last;
  };
  using All = bank::Tiles<One, bank::Estimators>;

  // One function for each set of instructions.
  static void take(typename All::template Row<bank::Isa::baseline>& tiles, const Record& record) {
    walk(tiles, record);
  }
  EHSID_TARGET_AVX2 static void take(typename All::template Row<bank::Isa::avx2>& tiles,
                                     const Record& record) {
    walk(tiles, record);
  }
  EHSID_TARGET_AVX512 static void take(typename All::template Row<bank::Isa::avx512>& tiles,
                                       const Record& record) {
    walk(tiles, record);
  }

  template <class V>
  EHSID_ALWAYS_INLINE static void walk(std::vector<bank::Estimators<One, V>>& tiles,
                                       const Record& record) {
    const bool reported = record.trajectory.theta != nullptr;
    std::vector<Scalar> copies[2];
    bank::in_blocks(
        tiles, record.samples, record.first, record.last,
        [&](auto& tile, const bank::Block& block) EHSID_INLINE_LAMBDA {
          const bank::Rows<V> commands(record.commands, block, 1, copies[0]);
          const bank::Rows<V> positions(record.positions, block, 1, copies[1]);
          const auto wanted = bank::first_lanes<V>(block.count);
          for (std::size_t k = block.start; k < block.end; ++k) {
            const auto status =
                tile.step(wanted, commands[k - block.start], positions[k - block.start]);
            if (record.status != nullptr) {
              bank::store(status, block.count, record.status + k * record.count + block.first);
            }
            if (reported && (k + 1) % record.trajectory.every == 0) {
              const std::size_t row = k / record.trajectory.every;
              write(tile, status, record.trajectory, row * record.count + block.first, block.count);
            }
          }
        });
  }

  /// An innovation exists only where the sample was estimated, else NaN.
  template <class V, class Status_>
  EHSID_ALWAYS_INLINE static void write(const bank::Estimators<One, V>& tile, const Status_& status,
                                        const BankTrajectory<Scalar>& to, std::size_t place,
                                        int count) {
    bank::Results<V, One::kN> results;
    tile.report(results);
    const auto n = static_cast<std::size_t>(tile.size());
    for (std::size_t i = 0; i < n; ++i) {
      for (int lane = 0; lane < count; ++lane) {
        const std::size_t at = (place + static_cast<std::size_t>(lane)) * n + i;
        to.theta[at] = results.theta[i][lane];
        to.deviation[at] = results.deviation[i][lane];
      }
    }
    const auto is = [&](Status one) EHSID_INLINE_LAMBDA {
      return status == Status_(static_cast<typename Status_::Number>(one));
    };
    const auto estimated = is(Status::ok) | is(Status::reset) | is(Status::no_information);
    const V innovation =
        bank::select(estimated, results.innovation, V(std::numeric_limits<Scalar>::quiet_NaN()));
    bank::store(status, count, to.status + place);
    bank::store(innovation, count, to.innovation + place);
    bank::store(results.forgetting_factor, count, to.forgetting_factor + place);
    bank::store(results.residual_variance, count, to.residual_variance + place);
    for (int lane = 0; lane < count; ++lane) {
      to.converged[place + static_cast<std::size_t>(lane)] = results.converged[lane];
    }
  }

  All tiles_;
};

/// Many estimators of an electro-hydraulic servo, ARX(na, nb, nk): EstimatorBank<float, 3, 3, 1>.
template <class Scalar, int kNa, int kNb, int kNk, class Forgetting = FRatio<Scalar>,
          bool kOffset = false>
using EstimatorBank = OnlineEstimatorBank<ArxEstimator<Scalar, kNa, kNb, kNk, Forgetting, kOffset>>;

}  // namespace ehsid
