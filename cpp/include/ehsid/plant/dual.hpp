// SPDX-License-Identifier: MIT
// Forward-mode dual numbers: a value and its partial derivatives, carried through every operation.
//
// Source: A. Griewank, A. Walther, Evaluating Derivatives, 2nd ed., SIAM 2008, ch. 3. The derivatives are those
// of the computation itself, exact to rounding, not difference quotients.
#pragma once

#include <ehsid/plant/lanes.hpp>

#include <cmath>

namespace ehsid::plant {

/// A number with its partial derivatives, Lanes. Comparisons look at the value only.
template <class Partials>
struct Dual {
  double value = 0.0;
  Partials partial;

  Dual() = default;
  Dual(double constant)
      : value(constant) {}  // NOLINT(google-explicit-constructor): a number is a constant
  Dual(double f, const Partials& derivatives) : value(f), partial(derivatives) {}

  /// f(this), given f and its derivative there.
  EHSID_LANES_INLINE Dual chain(double f, double slope) const { return {f, slope * partial}; }

  EHSID_LANES_INLINE Dual& operator+=(const Dual& other) {
    value += other.value;
    partial += other.partial;
    return *this;
  }
  EHSID_LANES_INLINE Dual& operator-=(const Dual& other) {
    value -= other.value;
    partial -= other.partial;
    return *this;
  }
  EHSID_LANES_INLINE Dual& operator*=(double factor) {
    value *= factor;
    partial *= factor;
    return *this;
  }
  EHSID_LANES_INLINE Dual& operator+=(double constant) {
    value += constant;
    return *this;
  }
  EHSID_LANES_INLINE Dual operator-() const { return {-value, -partial}; }

  EHSID_LANES_INLINE friend Dual operator+(const Dual& a, const Dual& b) {
    return {a.value + b.value, a.partial + b.partial};
  }
  EHSID_LANES_INLINE friend Dual operator-(const Dual& a, const Dual& b) {
    return {a.value - b.value, a.partial - b.partial};
  }
  EHSID_LANES_INLINE friend Dual operator*(const Dual& a, const Dual& b) {
    return {a.value * b.value, a.partial * b.value + a.value * b.partial};
  }
  EHSID_LANES_INLINE friend Dual operator/(const Dual& a, const Dual& b) {
    const double inverse = 1.0 / b.value;
    const double ratio = a.value * inverse;
    return {ratio, (a.partial - ratio * b.partial) * inverse};
  }
  EHSID_LANES_INLINE friend Dual operator+(const Dual& a, double b) {
    return {a.value + b, a.partial};
  }
  EHSID_LANES_INLINE friend Dual operator+(double a, const Dual& b) {
    return {a + b.value, b.partial};
  }
  EHSID_LANES_INLINE friend Dual operator-(const Dual& a, double b) {
    return {a.value - b, a.partial};
  }
  EHSID_LANES_INLINE friend Dual operator-(double a, const Dual& b) {
    return {a - b.value, -b.partial};
  }
  EHSID_LANES_INLINE friend Dual operator*(const Dual& a, double b) {
    return {a.value * b, a.partial * b};
  }
  EHSID_LANES_INLINE friend Dual operator*(double a, const Dual& b) {
    return {a * b.value, a * b.partial};
  }
  EHSID_LANES_INLINE friend Dual operator/(const Dual& a, double b) { return a * (1.0 / b); }
  EHSID_LANES_INLINE friend Dual operator/(double a, const Dual& b) {
    return b.chain(a / b.value, -a / (b.value * b.value));
  }

  EHSID_LANES_INLINE friend bool operator<(const Dual& a, const Dual& b) {
    return a.value < b.value;
  }
  EHSID_LANES_INLINE friend bool operator>(const Dual& a, const Dual& b) {
    return a.value > b.value;
  }

  EHSID_LANES_INLINE friend Dual sqrt(const Dual& x) {
    const double root = std::sqrt(x.value);
    return x.chain(root, 0.5 / root);
  }
  EHSID_LANES_INLINE friend Dual exp(const Dual& x) {
    const double e = std::exp(x.value);
    return x.chain(e, e);
  }
  EHSID_LANES_INLINE friend Dual log(const Dual& x) {
    return x.chain(std::log(x.value), 1.0 / x.value);
  }
  EHSID_LANES_INLINE friend Dual sin(const Dual& x) {
    return x.chain(std::sin(x.value), std::cos(x.value));
  }
  EHSID_LANES_INLINE friend Dual tanh(const Dual& x) {
    const double t = std::tanh(x.value);
    return x.chain(t, 1.0 - t * t);
  }
};

/// A number on which a function depends, and the slope of the function over it.
template <class Scalar>
struct Over {
  double slope;
  const Scalar& number;
};
template <class Scalar>
EHSID_LANES_INLINE Over<Scalar> over(const Scalar& number, double slope) {
  return {slope, number};
}

/// A function, given its value and its slopes over all on which it depends. The chain rule in one pass takes a fraction of
/// the work of derivatives that are carried through every operation of a long formula.
template <class... More>
EHSID_LANES_INLINE double chained(double value, const Over<double>& /*first*/,
                                  const More&... /*more*/) {
  return value;
}
template <class Partials, class... More>
EHSID_LANES_INLINE Dual<Partials> chained(double value, const Over<Dual<Partials>>& first,
                                          const More&... more) {
  Partials partial = first.slope * first.number.partial;
  ((partial += more.slope * more.number.partial), ...);
  return {value, partial};
}

/// Is x zero, and will it stay so whatever is varied?
inline bool is_nothing(double x) { return x == 0.0; }
template <class Partials>
bool is_nothing(const Dual<Partials>& x) {
  return x.value == 0.0 && x.partial.all_zero();
}

/// The value without its derivatives.
inline double value_of(double x) { return x; }
template <class Partials>
double value_of(const Dual<Partials>& x) {
  return x.value;
}

/// Numbers that fit into a register of the processor for which code with this type is compiled.
template <class Scalar>
inline constexpr int kRegisterWidth = Lanes<2>::kBlockWidth;
template <int kN, int kWidth>
inline constexpr int kRegisterWidth<Dual<Lanes<kN, kWidth>>> = Lanes<kN, kWidth>::kBlockWidth;

/// base^exponent for base > 0 and an exponent without derivatives.
inline double power(double base, double exponent) { return std::pow(base, exponent); }
template <class Partials>
Dual<Partials> power(const Dual<Partials>& base, double exponent) {
  const double result = std::pow(base.value, exponent);
  return base.chain(result, exponent * result / base.value);
}

/// The nearer of the two bounds where x lies outside of them. Derivatives of what is returned.
template <class Scalar>
Scalar clamp(const Scalar& x, const Scalar& low, const Scalar& high) {
  return x < low ? low : (x > high ? high : x);
}

/// |x|, with the derivative of +x at zero.
template <class Scalar>
Scalar absolute(const Scalar& x) {
  return value_of(x) < 0.0 ? -x : x;
}

}  // namespace ehsid::plant
