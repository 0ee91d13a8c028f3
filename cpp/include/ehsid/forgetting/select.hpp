// SPDX-License-Identifier: MIT
// Select form: the words that a forgetting policy is written with, so that one text serves one estimator and the lanes of
// a bank. T is a number, or a register of many (bank::Lanes); a condition is a bool, or one bool in each lane:
//   select(condition, a, b)     a where it is true, else b; both are computed
//   both(c, d), either(c, d)    c and d, c or d
//   any(condition)              is it true somewhere? What only a rare case needs stands in `if (any(rare)) { ... }`
//   smaller(a, b), larger(a, b) as a < b ? a : b, and a > b ? a : b
#pragma once

#include <ehsid/sliding_sum.hpp>
#include <ehsid/types.hpp>

#include <cmath>

namespace ehsid {

/// The types that belong to T: itself, where it is a number. See bank/policies.hpp for those of lanes.
template <class T>
struct SelectForm {
  using Scalar = T;
  using Truth = bool;
  using Count = std::int32_t;  // of samples, at most 2^20
  template <int kWindow>
  using Sum = SlidingSum<T, kWindow>;
};

template <class T>
using ScalarOf = typename SelectForm<T>::Scalar;
template <class T>
using TruthOf = typename SelectForm<T>::Truth;
template <class T>
using CountOf = typename SelectForm<T>::Count;
template <class T, int kWindow>
using SumOf = typename SelectForm<T>::template Sum<kWindow>;

template <class Number>
EHSID_ALWAYS_INLINE inline Number select(bool condition, const Number& a, const Number& b) {
  return condition ? a : b;
}
EHSID_ALWAYS_INLINE inline bool both(bool a, bool b) { return a && b; }
EHSID_ALWAYS_INLINE inline bool either(bool a, bool b) { return a || b; }
EHSID_ALWAYS_INLINE inline bool any(bool condition) { return condition; }

template <class Number>
EHSID_ALWAYS_INLINE inline Number smaller(const Number& a, const Number& b) {
  return a < b ? a : b;
}
template <class Number>
EHSID_ALWAYS_INLINE inline Number larger(const Number& a, const Number& b) {
  return a > b ? a : b;
}

}  // namespace ehsid
