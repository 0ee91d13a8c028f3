// SPDX-License-Identifier: MIT
// Vocabulary shared by every estimator header: vectors, status codes, finiteness.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

// Unrolls the loop that follows, up to 16 times: the loops of the recursion are short and nested, and half of what
// they execute would be the loops' own. Not with -Os, where flash goes before speed.
#if defined(__GNUC__) && defined(__OPTIMIZE__) && !defined(__OPTIMIZE_SIZE__)
#define EHSID_UNROLL _Pragma("GCC unroll 16")
#else
#define EHSID_UNROLL
#endif

namespace ehsid {

/// Plain array of kN numbers: what the state structs are made of, so that they can be copied as
/// bytes (Eigen matrices are not trivially copyable).
template <class Scalar, int kN>
using Array = std::array<Scalar, static_cast<std::size_t>(kN)>;

/// Column vector of kN numbers.
template <class Scalar, int kN>
using Vector = Eigen::Matrix<Scalar, kN, 1>;

/// Square matrix, kN by kN.
template <class Scalar, int kN>
using SquareMatrix = Eigen::Matrix<Scalar, kN, kN>;

/// Outcome of a call. Nothing throws; an error leaves the estimate bit for bit as it was.
enum class Status : std::uint8_t {
  ok = 0,                // step taken, estimate updated
  filling = 1,           // not enough past samples yet; nothing estimated
  no_information = 2,    // sample carries no information: estimate and covariance kept on purpose
  disabled = 3,          // estimation is switched off; only the sample history moves on
  reset = 4,             // step taken; a change of the plant was detected, P and lambda restarted
  invalid_input = 5,     // NaN or Inf among the inputs: rejected
  out_of_range = 6,      // input beyond the plausible range after scaling: rejected
  numerical_limit = 7,   // result not finite or a factor not positive: rejected
  invalid_argument = 8,  // configuration, start value or snapshot refused: kept as it was
};

/// True where the call was refused. The codes below invalid_input are normal operation.
constexpr bool is_error(Status status) { return status >= Status::invalid_input; }

/// Numbers as bits. Guards are decided on them, so that -ffast-math cannot optimise one away.
template <class Scalar>
struct Bits;

template <>
struct Bits<float> {
  using Word = std::uint32_t;
  static constexpr Word kExponent = 0x7f800000U;
  static constexpr Word kLeastNormal = 0x00800000U;
};

template <>
struct Bits<double> {
  using Word = std::uint64_t;
  static constexpr Word kExponent = 0x7ff0000000000000ULL;
  static constexpr Word kLeastNormal = 0x0010000000000000ULL;
};

template <class Scalar>
typename Bits<Scalar>::Word bits_of(Scalar value) {
  typename Bits<Scalar>::Word bits = 0;
  static_assert(sizeof bits == sizeof value, "a number and its bits");
  std::memcpy(&bits, &value, sizeof bits);
#if defined(__GNUC__) && __FINITE_MATH_ONLY__
  // With -ffast-math a compiler may assume that no argument of a function is NaN or Inf. clang 19 (not yet 14) applies
  // that to the bits, too, and removes the guard. Behind an empty asm statement it can assume nothing about them.
  __asm__("" : "+r"(bits));
#endif
  return bits;
}

/// Neither NaN nor Inf?
template <class Scalar>
bool is_finite(Scalar value) {
  return (bits_of(value) & Bits<Scalar>::kExponent) != Bits<Scalar>::kExponent;
}

/// Finite, above zero and not denormal? One comparison: what is smaller wraps round, and a sign is the highest bit.
template <class Scalar>
bool is_normal_positive(Scalar value) {
  constexpr auto kLeast = Bits<Scalar>::kLeastNormal;
  return bits_of(value) - kLeast < Bits<Scalar>::kExponent - kLeast;
}

/// Entry i of a plain array or of an Eigen vector.
template <class Scalar, std::size_t kN>
Scalar entry(const std::array<Scalar, kN>& values, int i) {
  return values[static_cast<std::size_t>(i)];
}

template <class Scalar, int kN>
Scalar entry(const Eigen::Matrix<Scalar, kN, 1>& values, int i) {
  return values[i];
}

/// All kN entries finite?
template <int kN, class Values>
bool all_finite(const Values& values) {
  bool finite = true;
  for (int i = 0; i < kN; ++i) {
    finite = is_finite(entry(values, i)) && finite;
  }
  return finite;
}

/// The plain array seen as an Eigen vector, without a copy.
template <class Scalar, std::size_t kN>
Eigen::Map<const Vector<Scalar, static_cast<int>(kN)>> as_vector(
    const std::array<Scalar, kN>& values) {
  return Eigen::Map<const Vector<Scalar, static_cast<int>(kN)>>(values.data());
}

/// Scalar product in a fixed order. Eigen's own reduction changes the order with the vector width of
/// the machine, and results would no longer be bit for bit the same on host and target.
template <int kN, class Left, class Right>
auto dot(const Left& left, const Right& right) {
  auto sum = entry(left, 0) * entry(right, 0);
  EHSID_UNROLL
  for (int i = 1; i < kN; ++i) {
    sum += entry(left, i) * entry(right, i);
  }
  return sum;
}

}  // namespace ehsid
