// SPDX-License-Identifier: MIT
// Many recursions Rls at once, each bit for bit the Rls of rls.hpp. For hosts: memory comes from the heap.
#pragma once

#include <ehsid/bank/recursions.hpp>
#include <ehsid/bank/tiles.hpp>

namespace ehsid {

/// `count` recursions of the type Rls<Scalar, kN, Forgetting> across SIMD lanes.
///
/// They start as copies of one Rls, and any of them can be replaced by another with its own settings, start values and
/// state. Compile with -ffp-contract=off (the target ehsid::reproducible), or bits differ from those of Rls.
template <class Scalar_, int kN, class Forgetting>
class RlsBank {
 public:
  using Scalar = Scalar_;
  using One = Rls<Scalar, kN, Forgetting>;

  /// isa: one that this machine supports, see bank::supported().
  explicit RlsBank(std::size_t count, const One& each = One{}, bank::Isa isa = bank::best_isa())
      : tiles_(count, each, isa), n_(each.size()) {}

  std::size_t size() const { return tiles_.size(); }
  bank::Isa isa() const { return tiles_.isa(); }

  /// Replaces a recursion, index < size(), by a copy of `one`, which has as many parameters.
  void set(std::size_t index, const One& one) { tiles_.set(index, one); }
  /// Writes the state of a recursion to `one`, which has its settings and start values.
  void get(std::size_t index, One& one) { tiles_.get(index, one); }

  /// One sample for each recursion: y = phi' theta + e.
  ///
  /// phi: n rows of size() numbers. y: size() numbers. status: size() values of Status, as Rls::update returns them.
  void update(const Scalar* phi, const Scalar* y, std::uint8_t* status) { run(phi, y, 1, status); }

  /// `samples` of them, one behind the other: phi has samples * n rows, y and status have `samples` rows.
  void run(const Scalar* phi, const Scalar* y, std::size_t samples, std::uint8_t* status) {
    const Record record{{phi, size(), 1}, {y, size(), 1}, samples, status, size(), n_};
    tiles_.visit([&](auto& tiles) { take(tiles, record); });
  }

 private:
  struct Record {
    bank::Table<Scalar> phi;
    bank::Table<Scalar> y;
    std::size_t samples;
    std::uint8_t* status;
    std::size_t count;
    int n;
  };
  using All = bank::Tiles<One, bank::Recursions>;

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
  EHSID_ALWAYS_INLINE static void walk(std::vector<bank::Recursions<One, V>>& tiles,
                                       const Record& record) {
    std::vector<Scalar> copies[2];
    bank::in_blocks(tiles, record.samples, 0, record.count,
                    [&](auto& tile, const bank::Block& block) EHSID_INLINE_LAMBDA {
                      const bank::Rows<V> phis(record.phi, block,
                                               static_cast<std::size_t>(record.n), copies[0]);
                      const bank::Rows<V> ys(record.y, block, 1, copies[1]);
                      const auto wanted = bank::first_lanes<V>(block.count);
                      std::uint8_t* to = record.status + block.start * record.count + block.first;
                      const int n = tile.size();
                      std::size_t row = 0;
                      for (std::size_t k = 0; k < block.end - block.start; ++k) {
                        typename bank::Recursions<One, V>::Regressors phi;
                        EHSID_UNROLL
                        for (int i = 0; i < n; ++i) {
                          phi[static_cast<std::size_t>(i)] = phis[row++];
                        }
                        bank::store(tile.update(wanted, phi, ys[k]), block.count, to);
                        to += record.count;
                      }
                    });
  }

  All tiles_;
  int n_;
};

}  // namespace ehsid
