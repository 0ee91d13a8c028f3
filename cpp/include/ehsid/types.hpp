// SPDX-License-Identifier: MIT
// Vocabulary shared by every estimator header: vectors, status codes, finiteness.
#pragma once

// The first lines that a compiler reads: it then says this before a page of what it does not understand.
#if __cplusplus < 201703L && !(defined(_MSVC_LANG) && _MSVC_LANG >= 201703L)
#error "ehsid needs C++17: compile with -std=c++17 or newer (/std:c++17 with Visual C++)"
#endif

// A program that does not use Eigen defines EHSID_WITHOUT_EIGEN, the same in all its units. Then it has neither
// identify_servo() nor sizes that are chosen at run time.
#ifdef EHSID_WITHOUT_EIGEN
#include <ehsid/plain_matrix.hpp>
#else
#include <Eigen/Core>
#endif
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

// Unrolls the loop that follows, up to 16 times: the loops of the recursion are short and nested, and half of what
// they execute would be the loops' own. Not with -Os, where flash goes before speed.
#if defined(EHSID_UNROLL)  // as the user says, e.g. -DEHSID_UNROLL=
#elif defined(__GNUC__) && defined(__OPTIMIZE__) && !defined(__OPTIMIZE_SIZE__)
#define EHSID_UNROLL _Pragma("GCC unroll 16")
#else
#define EHSID_UNROLL
#endif

// What an update calls: always inlined where the compiler can be told so. Its scratch then shares the stack of the
// caller's (docs/budgets.md); the meaning does not change.
#if defined(__GNUC__) || defined(__clang__)
#define EHSID_ALWAYS_INLINE [[gnu::always_inline]]
#else
#define EHSID_ALWAYS_INLINE
#endif

// What is called from several places, and not in each sample or not for long: once in the flash, and there as small as the
// compiler can make it.
#if defined(__GNUC__) || defined(__clang__)
#define EHSID_ONCE [[gnu::noinline]]
#define EHSID_RARE [[gnu::noinline, gnu::cold]]
#else
#define EHSID_ONCE
#define EHSID_RARE
#endif

// A lambda that is called for each number of a loop: its code stands where it is called. Behind the parameters, where only
// this spelling of the attribute is about the body.
#if defined(__GNUC__) || defined(__clang__)
#define EHSID_INLINE_LAMBDA __attribute__((always_inline))
#else
#define EHSID_INLINE_LAMBDA
#endif

namespace ehsid {

namespace detail {
/// 1 / n for n >= 1: series need no division, which takes a Cortex-M4F as long as 14 other instructions.
template <class Scalar>
struct Inverse {
  static constexpr Scalar of[] = {Scalar(0),      Scalar(1),      Scalar(1) / 2,  Scalar(1) / 3,
                                  Scalar(1) / 4,  Scalar(1) / 5,  Scalar(1) / 6,  Scalar(1) / 7,
                                  Scalar(1) / 8,  Scalar(1) / 9,  Scalar(1) / 10, Scalar(1) / 11,
                                  Scalar(1) / 12, Scalar(1) / 13, Scalar(1) / 14, Scalar(1) / 15,
                                  Scalar(1) / 16, Scalar(1) / 17, Scalar(1) / 18, Scalar(1) / 19,
                                  Scalar(1) / 20, Scalar(1) / 21, Scalar(1) / 22, Scalar(1) / 23};
};
}  // namespace detail

/// A size kN that is chosen at run time, at most `most`: UdFactors<float, up_to(13)>. Firmware gives kN itself.
/// Both run the same statements in the same order, so their results are the same bit for bit (a test compares
/// them). For hosts, where one compiled estimator then serves every size. gcc needs -Wno-maybe-uninitialized with it: it
/// does not see that only the first n numbers of an array are read.
constexpr int up_to(int most) { return -most; }

/// Numbers that a vector of size kN has room for.
constexpr int capacity(int size) { return size > 0 ? size : -size; }

/// The size itself: a constant where kN is one.
template <int kN, bool kFixed = (kN > 0)>
struct Extent {
  static constexpr int size() { return kN; }
  static constexpr bool accepts(std::ptrdiff_t size) { return size == kN; }
  static void resize(std::ptrdiff_t /*size*/) {}
};

template <int kN>
struct Extent<kN, false> {
  std::int32_t chosen = capacity(kN);

  int size() const { return chosen; }
  static bool accepts(std::ptrdiff_t size) { return size >= 1 && size <= capacity(kN); }
  void resize(std::ptrdiff_t size) { chosen = static_cast<std::int32_t>(size); }
};

/// Plain array of kN numbers: what the state structs are made of, so that they can be copied as
/// bytes (Eigen matrices are not trivially copyable).
template <class Scalar, int kN>
using Array = std::array<Scalar, static_cast<std::size_t>(capacity(kN))>;

#ifdef EHSID_WITHOUT_EIGEN
template <class Scalar, int kRows, int kColumns>
using Matrix = PlainMatrix<Scalar, kRows, kColumns>;
#else
/// Matrix, kRows by kColumns; a size below 0 is up_to(most).
template <class Scalar, int kRows, int kColumns>
using Matrix = Eigen::Matrix<Scalar, (kRows > 0 ? kRows : Eigen::Dynamic),
                             (kColumns > 0 ? kColumns : Eigen::Dynamic), Eigen::ColMajor,
                             capacity(kRows), capacity(kColumns)>;
#endif

/// Column vector of kN numbers.
template <class Scalar, int kN>
using Vector = Matrix<Scalar, kN, 1>;

/// Square matrix, kN by kN.
template <class Scalar, int kN>
using SquareMatrix = Matrix<Scalar, kN, kN>;

// Many estimators at once, see bank/: the same equations with the same constants.
namespace bank {
template <class Recursion, class V>
class Recursions;
template <class Estimator, class V>
class Estimators;
template <class V>
struct Whitenesses;
}  // namespace bank

/// Outcome of a call. Nothing throws; an error leaves the estimate bit for bit as it was.
enum class [[nodiscard]] Status : std::uint8_t {
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

/// The name of the status, e.g. "no_information", for a log. A constant of the program; "unknown" for any other number.
constexpr const char* to_string(Status status) {
  switch (status) {
    case Status::ok:
      return "ok";
    case Status::filling:
      return "filling";
    case Status::no_information:
      return "no_information";
    case Status::disabled:
      return "disabled";
    case Status::reset:
      return "reset";
    case Status::invalid_input:
      return "invalid_input";
    case Status::out_of_range:
      return "out_of_range";
    case Status::numerical_limit:
      return "numerical_limit";
    case Status::invalid_argument:
      return "invalid_argument";
  }
  return "unknown";
}

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
  static constexpr Word kSquareOverflows = 0x5f000000U;  // 2^63
};

template <>
struct Bits<double> {
  using Word = std::uint64_t;
  static constexpr Word kExponent = 0x7ff0000000000000ULL;
  static constexpr Word kLeastNormal = 0x0010000000000000ULL;
  static constexpr Word kSquareOverflows = 0x5fe0000000000000ULL;  // 2^511
};

template <class Scalar>
typename Bits<Scalar>::Word bits_of(Scalar value) {
  typename Bits<Scalar>::Word bits = 0;
  static_assert(sizeof bits == sizeof value, "a number and its bits");
  std::memcpy(&bits, &value, sizeof bits);
#if (defined(__GNUC__) || defined(__clang__)) && __FINITE_MATH_ONLY__
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

/// Below 2^63 in size (float) or 2^511 (double), so that its square is finite? Not so NaN and Inf.
template <class Scalar>
bool is_squarable(Scalar value) {
  return (bits_of(value) & Bits<Scalar>::kExponent) < Bits<Scalar>::kSquareOverflows;
}

/// Can this be a variance, which is a mean of squarable numbers >= 0? Twice their limit, because rounding may raise a mean.
template <class Scalar>
bool is_variance(Scalar value) {
  return value >= Scalar(0) && is_squarable(value / Scalar(2));
}

/// The product of two finite numbers, or the largest finite number of its sign where the product is beyond it.
template <class Scalar>
Scalar bounded_product(Scalar a, Scalar b) {
  const Scalar product = a * b;
  if (is_finite(product)) {
    return product;
  }
  const Scalar largest = std::numeric_limits<Scalar>::max();
  return (a < Scalar(0)) == (b < Scalar(0)) ? largest : -largest;
}

/// Finite, above zero and not denormal? One comparison: what is smaller wraps round, and a sign is the highest bit.
template <class Scalar>
bool is_normal_positive(Scalar value) {
  constexpr auto kLeast = Bits<Scalar>::kLeastNormal;
  return bits_of(value) - kLeast < Bits<Scalar>::kExponent - kLeast;
}

/// Entry i of a plain array or of a vector.
template <class Scalar, std::size_t kN>
EHSID_ALWAYS_INLINE inline Scalar entry(const std::array<Scalar, kN>& values, int i) {
  return values[static_cast<std::size_t>(i)];
}

#ifdef EHSID_WITHOUT_EIGEN
template <class Scalar, int kRows>
EHSID_ALWAYS_INLINE inline Scalar entry(const Matrix<Scalar, kRows, 1>& values, int i) {
  return values[i];
}
#else
template <class Scalar, int kRows, int kOptions, int kCapacity>
EHSID_ALWAYS_INLINE inline Scalar entry(
    const Eigen::Matrix<Scalar, kRows, 1, kOptions, kCapacity, 1>& values, int i) {
  return values[i];
}
#endif

/// The first `count` entries finite?
template <class Values>
bool all_finite(int count, const Values& values) {
  bool finite = true;
  for (int i = 0; i < count; ++i) {
    finite = is_finite(entry(values, i)) && finite;
  }
  return finite;
}

/// All `count` of these squarable?
template <class Values>
bool all_squarable(int count, const Values& values) {
  bool good = true;
  for (int i = 0; i < count; ++i) {
    good = is_squarable(entry(values, i)) && good;
  }
  return good;
}

/// All kN entries finite?
template <int kN, class Values>
bool all_finite(const Values& values) {
  return all_finite(kN, values);
}

/// to = from, as far as they are in use: what lies behind stays as it was.
template <int kN, class Values>
EHSID_ALWAYS_INLINE inline void keep(int size, const Values& from, Values& to) {
  if constexpr (kN > 0) {
    to = from;
  } else {
    for (std::size_t i = 0; i < static_cast<std::size_t>(size); ++i) {
      to[i] = from[i];
    }
  }
}

#ifndef EHSID_WITHOUT_EIGEN
/// The plain array seen as an Eigen vector, without a copy.
template <class Scalar, std::size_t kN>
Eigen::Map<const Vector<Scalar, static_cast<int>(kN)>> as_vector(
    const std::array<Scalar, kN>& values) {
  return Eigen::Map<const Vector<Scalar, static_cast<int>(kN)>>(values.data());
}
#endif

/// The first `size` entries of a plain array as a vector of size kN.
template <int kN, class Scalar, std::size_t kCapacity>
Vector<Scalar, kN> to_vector(int size, const std::array<Scalar, kCapacity>& values) {
  Vector<Scalar, kN> vector(size);
  for (int i = 0; i < size; ++i) {
    vector[i] = entry(values, i);
  }
  return vector;
}

/// Scalar product in a fixed order. Eigen's own reduction changes the order with the vector width of
/// the machine, and results would no longer be bit for bit the same on host and target.
template <class Left, class Right>
EHSID_ALWAYS_INLINE inline auto dot(int size, const Left& left, const Right& right) {
  auto sum = entry(left, 0) * entry(right, 0);
  EHSID_UNROLL
  for (int i = 1; i < size; ++i) {
    sum += entry(left, i) * entry(right, i);
  }
  return sum;
}

/// The same of all kN entries.
template <int kN, class Left, class Right>
auto dot(const Left& left, const Right& right) {
  return dot(kN, left, right);
}

}  // namespace ehsid
