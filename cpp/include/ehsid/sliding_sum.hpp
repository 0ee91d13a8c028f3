// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/types.hpp>

#include <limits>

namespace ehsid {

/// Sum of the last kWindow numbers by additions only.
///
/// A running sum that subtracts the number that leaves keeps the rounding of the largest number it ever
/// held, for ever; in float32 one spike then hides everything after it. Here the sum is split into
/// the samples since the last wrap (`head`) and stored suffix sums of the block before, so a spike
/// is gone when it leaves the window. One addition a push, kWindow more every kWindow pushes.
template <class Scalar, int kWindow>
struct SlidingSum {
  static_assert(kWindow >= 1, "a window holds at least one sample");
  /// The largest value that push() and peek() may be given: an eighth of what a full window can hold, so that no sum
  /// overflows, of a restored window neither. The least is 0.
  static constexpr Scalar kMost = std::numeric_limits<Scalar>::max() / Scalar(8 * kWindow);

  Array<Scalar, kWindow> slots{};  // [0, next): this block's values; [next, kWindow): suffix sums
  Scalar head{};                   // sum of this block's values
  std::int32_t next = 0;           // where the coming value goes

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&SlidingSum::slots);
    visit(&SlidingSum::head);
    visit(&SlidingSum::next);
  }

  /// The sum as it would be after push(value).
  Scalar peek(Scalar value) const {
    const bool last = next + 1 == kWindow;
    const Scalar tail = last ? Scalar(0) : slots[static_cast<std::size_t>(next + 1)];
    return tail + (head + value);
  }

  /// Takes a value in; nothing changes where `where` is false.
  void push(Scalar value, bool where = true) {
    if (!where) {
      return;
    }
    slots[static_cast<std::size_t>(next)] = value;
    head += value;
    ++next;
    if (next == kWindow) {
      Scalar sum(0);
      for (int i = kWindow - 1; i >= 0; --i) {
        Scalar& slot = slots[static_cast<std::size_t>(i)];
        sum += slot;
        slot = sum;
      }
      head = Scalar(0);
      next = 0;
    }
  }

  /// Empty again.
  void restart(bool where = true) {
    if (where) {
      *this = {};
    }
  }

  /// May a saved window be taken over? `next` says where push() writes. Sums may be twice what the largest values give:
  /// rounding adds up, too.
  bool usable() const {
    if (next < 0 || next >= kWindow) {
      return false;
    }
    bool good = is_from_zero_to(Scalar(2) * Scalar(next) * kMost, head);
    for (int i = 0; i < kWindow; ++i) {
      const Scalar most = i < next ? kMost : Scalar(2 * kWindow) * kMost;
      good = is_from_zero_to(most, slots[static_cast<std::size_t>(i)]) && good;
    }
    return good;
  }

 private:
  static bool is_from_zero_to(Scalar most, Scalar value) {
    return is_finite(value) && value >= Scalar(0) && value <= most;
  }
};

}  // namespace ehsid
