// SPDX-License-Identifier: MIT
// Many estimators in tiles of as many as a register has lanes, and the tables of numbers that they read and write.
#pragma once

#include <ehsid/bank/isa.hpp>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <type_traits>
#include <vector>

namespace ehsid::bank {

/// Numbers that a bank reads. `row` numbers further is the next sample, `lane` numbers further the next estimator: 1, or 0
/// where all estimators read the same number.
template <class Number>
struct Table {
  const Number* numbers;
  std::size_t row;
  std::size_t lane;
};

/// A block of samples for the estimators of one tile: first .. first + count - 1, as many as it has lanes but for the last tile.
struct Block {
  std::size_t start;  // the first sample
  std::size_t end;
  std::size_t first;
  int count;
};

/// Rows of a table as registers of one number for each estimator of a tile; zero in the lanes behind the last estimator.
template <class V>
class Rows {
 public:
  using Number = typename V::Number;

  /// Those of the block, `each` rows a sample. copy: holds them where the table has no whole registers of its own.
  Rows(const Table<Number>& from, const Block& block, std::size_t each, std::vector<Number>& copy)
      : numbers_(from.numbers + block.start * each * from.row + block.first * from.lane),
        row_(from.row) {
    if (from.lane == 1 && block.count == V::kWidth) {
      return;
    }
    constexpr auto kWidth = static_cast<std::size_t>(V::kWidth);
    const std::size_t rows = (block.end - block.start) * each;
    copy.assign(rows * kWidth, Number(0));
    for (std::size_t row = 0; row < rows; ++row) {
      for (std::size_t lane = 0; lane < static_cast<std::size_t>(block.count); ++lane) {
        copy[row * kWidth + lane] = numbers_[row * row_ + lane * from.lane];
      }
    }
    numbers_ = copy.data();
    row_ = kWidth;
  }

  /// row: from the start of the block.
  EHSID_ALWAYS_INLINE V operator[](std::size_t row) const { return V::from(numbers_ + row * row_); }

 private:
  const Number* numbers_;
  std::size_t row_;
};

/// Writes the first `count` lanes.
template <class Number, class V>
EHSID_ALWAYS_INLINE inline void store(const V& lanes, int count, Number* to) {
  if constexpr (std::is_same_v<Number, typename V::Number>) {
    if (count == V::kWidth) {
      lanes.to(to);
      return;
    }
  } else if constexpr (sizeof(Number) == 1) {
    if (count == V::kWidth) {
      const auto bytes = __builtin_convertvector(lanes.native, typename V::Truth::Bytes);
      std::memcpy(to, &bytes, sizeof bytes);
      return;
    }
  }
  alignas(V) typename V::Number all[V::kWidth];
  lanes.to(all);
  for (int lane = 0; lane < count; ++lane) {
    to[lane] = static_cast<Number>(all[lane]);
  }
}

/// True in the first `count` lanes.
template <class V>
EHSID_ALWAYS_INLINE inline typename V::Truth first_lanes(int count) {
  typename V::Truth first(true);
  for (int lane = count; lane < V::kWidth; ++lane) {
    first.set(lane, false);
  }
  return first;
}

/// work(tile, block) for the estimators first .. last - 1 and all samples. A tile takes a block of samples before the next one:
/// its state stays in the nearest cache, and so do the pages of these rows.
template <class Tile, class Work>
EHSID_ALWAYS_INLINE inline void in_blocks(std::vector<Tile>& tiles, std::size_t samples,
                                          std::size_t first, std::size_t last, const Work& work) {
  constexpr std::size_t kSamples = 32;
  constexpr auto kWidth = static_cast<std::size_t>(Tile::kWidth);
  for (std::size_t start = 0; start < samples; start += kSamples) {
    for (std::size_t lane = first; lane < last; lane += kWidth) {
      work(tiles[lane / kWidth], Block{start, std::min(start + kSamples, samples), lane,
                                       static_cast<int>(std::min(kWidth, last - lane))});
    }
  }
}

/// Estimators of the type One in tiles. Tile<One, V>: those in the lanes of V, with set(lane, one) and get(lane, one). Lanes
/// behind the last estimator hold copies of the first. The estimators copied in and out may have sizes chosen at run time
/// where those of One are fixed.
template <class One, template <class, class> class Tile>
class Tiles {
 public:
  using Scalar = typename One::Scalar;
  template <Isa kIsa>
  using Row = std::vector<Tile<One, LanesIn<Scalar, kIsa>>>;

  /// `count` copies of `each`.
  template <class Each>
  Tiles(std::size_t count, const Each& each, Isa isa) : count_(count), isa_(isa) {
    visit([&](auto& tiles) {
      using Which = typename std::decay_t<decltype(tiles)>::value_type;
      tiles.resize((count + Which::kWidth - 1) / Which::kWidth);
      if (!tiles.empty()) {
        for (int lane = 0; lane < Which::kWidth; ++lane) {
          tiles.front().set(lane, each);
        }
        std::fill(tiles.begin() + 1, tiles.end(), tiles.front());
      }
    });
  }

  std::size_t size() const { return count_; }
  Isa isa() const { return isa_; }

  template <class Each>
  void set(std::size_t index, const Each& one) {
    visit([&](auto& tiles) {
      constexpr std::size_t kWidth = std::decay_t<decltype(tiles)>::value_type::kWidth;
      tiles[index / kWidth].set(static_cast<int>(index % kWidth), one);
    });
  }
  template <class Each>
  void get(std::size_t index, Each& one) {
    visit([&](auto& tiles) {
      constexpr std::size_t kWidth = std::decay_t<decltype(tiles)>::value_type::kWidth;
      tiles[index / kWidth].get(static_cast<int>(index % kWidth), one);
    });
  }

  /// call(tiles) with the row of tiles that is in use.
  template <class Call>
  void visit(const Call& call) {
    if (isa_ == Isa::avx512) {
      call(wide_);
    } else if (isa_ == Isa::avx2) {
      call(middle_);
    } else {
      call(narrow_);
    }
  }

 private:
  std::size_t count_;
  Isa isa_;
  // One of them is in use.
  Row<Isa::baseline> narrow_;
  Row<Isa::avx2> middle_;
  Row<Isa::avx512> wide_;
};

}  // namespace ehsid::bank
