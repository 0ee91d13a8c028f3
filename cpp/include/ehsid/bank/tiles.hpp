// SPDX-License-Identifier: MIT
// Many estimators in tiles of as many as a register has lanes, and the tables of numbers that they read and write.
#pragma once

#include <ehsid/bank/isa.hpp>

#include <algorithm>
#include <cstddef>
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

/// Those of the estimators first .. first + V::kWidth - 1, of which `count` exist; zero for the others.
template <class V>
EHSID_ALWAYS_INLINE inline V load(const Table<typename V::Number>& from, std::size_t row,
                                  std::size_t first, int count) {
  const auto* numbers = from.numbers + row * from.row + first * from.lane;
  if (from.lane == 0) {
    return V(*numbers);
  }
  if (count == V::kWidth) {
    return V::from(numbers);
  }
  V lanes(typename V::Number(0));
  for (int lane = 0; lane < count; ++lane) {
    lanes.set(lane, numbers[lane]);
  }
  return lanes;
}

/// Writes the first `count` lanes.
template <class Number, class V>
EHSID_ALWAYS_INLINE inline void store(const V& lanes, int count, Number* to) {
  if constexpr (std::is_same_v<Number, typename V::Number>) {
    if (count == V::kWidth) {
      lanes.to(to);
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

/// Estimators of the type One in tiles. Tile<One, V>: those in the lanes of V, with set(lane, one) and get(lane, one). Lanes
/// behind the last estimator hold copies of the first.
template <class One, template <class, class> class Tile>
class Tiles {
 public:
  using Scalar = typename One::Scalar;
  template <Isa kIsa>
  using Row = std::vector<Tile<One, LanesIn<Scalar, kIsa>>>;

  /// `count` copies of `each`.
  Tiles(std::size_t count, const One& each, Isa isa) : count_(count), isa_(isa) {
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

  void set(std::size_t index, const One& one) {
    visit([&](auto& tiles) {
      constexpr std::size_t kWidth = std::decay_t<decltype(tiles)>::value_type::kWidth;
      tiles[index / kWidth].set(static_cast<int>(index % kWidth), one);
    });
  }
  void get(std::size_t index, One& one) {
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
