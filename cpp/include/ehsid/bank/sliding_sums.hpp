// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/bank/lanes.hpp>
#include <ehsid/sliding_sum.hpp>

namespace ehsid::bank {

/// A SlidingSum in each lane. Lanes that took the same samples stand at the same place of their windows, and move together;
/// where one has left out a sample or was restarted, each lane is served by itself.
template <class V, int kWindow>
struct SlidingSums {
  using Scalar = typename V::Number;
  using Count = Lanes<Whole<Scalar>, V::kWidth>;
  using One = SlidingSum<Scalar, kWindow>;

  Array<V, kWindow + 1>
      slots;  // the last one stays zero: behind the end of the window there is nothing
  V head;
  Count next;

  void set(int lane, const One& one) {
    for (std::size_t i = 0; i < kWindow; ++i) {
      slots[i].set(lane, one.slots[i]);
    }
    slots[kWindow].set(lane, Scalar(0));
    head.set(lane, one.head);
    next.set(lane, one.next);
  }
  void get(int lane, One& one) const {
    for (std::size_t i = 0; i < kWindow; ++i) {
      one.slots[i] = slots[i][lane];
    }
    one.head = head[lane];
    one.next = static_cast<std::int32_t>(next[lane]);
  }

  EHSID_ALWAYS_INLINE void restart(const typename V::Truth& where) {
    for (int i = 0; i < kWindow; ++i) {
      V& slot = slots[static_cast<std::size_t>(i)];
      slot = select(where, V(0), slot);
    }
    head = select(where, V(0), head);
    next = select(where, Count(0), next);
  }

  EHSID_ALWAYS_INLINE V peek(const V& value) const {
    V tail;
    if (together()) {
      tail = slots[static_cast<std::size_t>(next[0] + 1)];
    } else {
      for (int lane = 0; lane < V::kWidth; ++lane) {
        tail.set(lane, slots[static_cast<std::size_t>(next[lane] + 1)][lane]);
      }
    }
    return tail + (head + value);
  }

  EHSID_ALWAYS_INLINE void push(const V& value, const typename V::Truth& where) {
    if (together()) {
      V& slot = slots[static_cast<std::size_t>(next[0])];
      slot = select(where, value, slot);
    } else {
      for (int lane = 0; lane < V::kWidth; ++lane) {
        V& slot = slots[static_cast<std::size_t>(next[lane])];
        slot.set(lane, where[lane] ? value[lane] : slot[lane]);
      }
    }
    head = select(where, head + value, head);
    next = select(where, next + Count(1), next);
    const auto full = next == Count(kWindow);
    if (any(full)) {
      V sum(0);
      for (int i = kWindow - 1; i >= 0; --i) {
        V& slot = slots[static_cast<std::size_t>(i)];
        sum += slot;
        slot = select(full, sum, slot);
      }
      head = select(full, V(0), head);
      next = select(full, Count(0), next);
    }
  }

 private:
  EHSID_ALWAYS_INLINE bool together() const { return all(next == Count(next[0])); }
};

}  // namespace ehsid::bank
