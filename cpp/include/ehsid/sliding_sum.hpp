// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/types.hpp>

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

  void push(Scalar value) {
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

  /// May a saved window be taken over? `next` says where push() writes.
  bool usable() const {
    return next >= 0 && next < kWindow && is_finite(head) && all_finite<kWindow>(slots);
  }
};

}  // namespace ehsid
