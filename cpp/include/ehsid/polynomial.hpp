// SPDX-License-Identifier: MIT
// The polynomial of a recursive filter, 1 + a1 q^-1 + ... + an q^-n, and whether the filter is stable.
#pragma once

#include <ehsid/types.hpp>

namespace ehsid {

/// Coefficients a1 .. an of (1 - pole q^-1)^n.
template <int kN, class Scalar>
Array<Scalar, kN> repeated_pole(int n, Scalar pole) {
  Array<Scalar, kN> a{};
  for (int order = 1; order <= n; ++order) {
    for (int i = order - 1; i >= 0; --i) {
      const Scalar before = i == 0 ? Scalar(1) : a[static_cast<std::size_t>(i - 1)];
      a[static_cast<std::size_t>(i)] -= pole * before;
    }
  }
  return a;
}

/// to_i = a_i factor^i for the first n coefficients: every root becomes `factor` times what it was. What lies behind n
/// becomes zero.
template <int kN, class Scalar, class Values>
EHSID_ALWAYS_INLINE inline Array<Scalar, kN> contracted(int n, const Values& a, Scalar factor) {
  Array<Scalar, kN> to{};
  Scalar power = factor;
  EHSID_UNROLL
  for (int i = 0; i < n; ++i) {
    to[static_cast<std::size_t>(i)] = entry(a, i) * power;
    power *= factor;
  }
  return to;
}

/// Are all roots of z^n + a1 z^(n-1) + ... + an inside the unit circle? NaN gives false.
///
/// Source: Schur-Cohn recursion, E. I. Jury, Theory and Application of the z-Transform Method, Wiley 1964, sec. 3.
/// Equation: with k = a_n the roots are inside where |k| < 1 and those of (a_i - k a_(n-i)) / (1 - k^2), i = 1 .. n-1, are.
/// Cost: n^2 / 2 multiplications and n divisions. No roots are computed.
template <int kN, class Scalar>
bool roots_inside_unit_circle(int n, Array<Scalar, kN> a) {
  for (int order = n; order >= 1; --order) {
    const Scalar k = a[static_cast<std::size_t>(order - 1)];
    const Scalar rest = Scalar(1) - k * k;
    if (!(rest > Scalar(0))) {
      return false;
    }
    // In pairs from both ends, because each needs the other one's value of before.
    for (int i = 0, j = order - 2; i <= j; ++i, --j) {
      const auto low = static_cast<std::size_t>(i);
      const auto high = static_cast<std::size_t>(j);
      const Scalar front = a[low];
      const Scalar back = a[high];
      a[low] = (front - k * back) / rest;
      a[high] = (back - k * front) / rest;
    }
  }
  return true;
}

}  // namespace ehsid
