// SPDX-License-Identifier: MIT
// exp and ln by short series, for targets whose estimator shall not depend on a libm. Every loop is bounded, and the
// result is the same on every machine with IEEE arithmetic.
#pragma once

#include <ehsid/types.hpp>

namespace ehsid {

/// exp(x); x is limited to -4 .. 4. Error below 32 units of the last place: the squarings multiply that of the series by 16.
///
/// exp(x) = (exp(x / 16))^16, and of exp(x / 16) the Taylor series, by Horner's rule.
template <class Scalar>
EHSID_ONCE Scalar bounded_exp(Scalar x) {
  // The first term that is left out is 0.25^(n+1) / (n+1)!: 4e-10 and 2e-18.
  constexpr int kTerms = sizeof(Scalar) == sizeof(float) ? 7 : 12;
  constexpr int kSquarings = 4;
  const Scalar limited = x > Scalar(4) ? Scalar(4) : x < Scalar(-4) ? Scalar(-4) : x;
  const Scalar small = limited * (Scalar(1) / Scalar(1 << kSquarings));
  Scalar sum = Scalar(1);
  EHSID_UNROLL
  for (int n = kTerms; n >= 1; --n) {
    sum = Scalar(1) + small * detail::Inverse<Scalar>::of[n] * sum;
  }
  EHSID_UNROLL
  for (int i = 0; i < kSquarings; ++i) {
    sum *= sum;
  }
  return sum;
}

/// ln(x) for a normal number x > 0; of any other number the logarithm of the least normal one.
///
/// x = 2^e m with m in [0.71, 1.42), and ln m = 2 (s + s^3 / 3 + s^5 / 5 ...) with s = (m - 1) / (m + 1), |s| <= 0.172.
template <class Scalar>
EHSID_ONCE Scalar bounded_log(Scalar x) {
  using Word = typename Bits<Scalar>::Word;
  constexpr int kTerms = sizeof(Scalar) == sizeof(float) ? 5 : 11;
  constexpr int kMantissaBits = sizeof(Scalar) == sizeof(float) ? 23 : 52;
  constexpr int kBias = sizeof(Scalar) == sizeof(float) ? 127 : 1023;
  constexpr Word kMantissa = (Word{1} << kMantissaBits) - 1;
  Word bits = bits_of(x);
  if (!(x > Scalar(0)) || bits < Bits<Scalar>::kLeastNormal || bits >= Bits<Scalar>::kExponent) {
    bits = Bits<Scalar>::kLeastNormal;
  }
  int exponent = static_cast<int>(bits >> kMantissaBits) - kBias;
  const Word one = static_cast<Word>(kBias) << kMantissaBits;
  const Word scaled = static_cast<Word>((bits & kMantissa) | one);
  Scalar m = Scalar(0);
  std::memcpy(&m, &scaled, sizeof m);
  if (m > Scalar(1.41421356)) {
    m *= Scalar(0.5);
    ++exponent;
  }
  const Scalar s = (m - Scalar(1)) / (m + Scalar(1));
  const Scalar square = s * s;
  Scalar sum = Scalar(0);
  for (int n = kTerms; n >= 0; --n) {
    sum = sum * square + detail::Inverse<Scalar>::of[2 * n + 1];
  }
  return Scalar(2) * sum * s + static_cast<Scalar>(exponent) * Scalar(0.69314718055994530942);
}

}  // namespace ehsid
