// SPDX-License-Identifier: MIT
// Forward-mode dual numbers: a value and its partial derivatives, carried through every operation.
//
// Source: A. Griewank, A. Walther, Evaluating Derivatives, 2nd ed., SIAM 2008, ch. 3. The derivatives are those
// of the computation itself, exact to rounding, not difference quotients.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace ehsid::plant {

/// A number with kN partial derivatives. Comparisons look at the value only.
template <int kN>
struct Dual {
  using Partials = Eigen::Array<double, kN, 1>;

  double value = 0.0;
  Partials partial = Partials::Zero();

  Dual() = default;
  Dual(double constant)
      : value(constant) {}  // NOLINT(google-explicit-constructor): a number is a constant
  template <class Expression>
  Dual(double f, const Expression& derivatives) : value(f), partial(derivatives) {}

  /// f(this), given f and its derivative there.
  EIGEN_ALWAYS_INLINE Dual chain(double f, double slope) const { return {f, slope * partial}; }

  EIGEN_ALWAYS_INLINE Dual& operator+=(const Dual& other) {
    value += other.value;
    partial += other.partial;
    return *this;
  }
  EIGEN_ALWAYS_INLINE Dual& operator-=(const Dual& other) {
    value -= other.value;
    partial -= other.partial;
    return *this;
  }
  EIGEN_ALWAYS_INLINE Dual& operator*=(double factor) {
    value *= factor;
    partial *= factor;
    return *this;
  }
  EIGEN_ALWAYS_INLINE Dual& operator+=(double constant) {
    value += constant;
    return *this;
  }
  EIGEN_ALWAYS_INLINE Dual operator-() const { return {-value, -partial}; }

  EIGEN_ALWAYS_INLINE friend Dual operator+(const Dual& a, const Dual& b) {
    return {a.value + b.value, a.partial + b.partial};
  }
  EIGEN_ALWAYS_INLINE friend Dual operator-(const Dual& a, const Dual& b) {
    return {a.value - b.value, a.partial - b.partial};
  }
  EIGEN_ALWAYS_INLINE friend Dual operator*(const Dual& a, const Dual& b) {
    return {a.value * b.value, a.partial * b.value + a.value * b.partial};
  }
  EIGEN_ALWAYS_INLINE friend Dual operator/(const Dual& a, const Dual& b) {
    const double inverse = 1.0 / b.value;
    const double ratio = a.value * inverse;
    return {ratio, (a.partial - ratio * b.partial) * inverse};
  }
  EIGEN_ALWAYS_INLINE friend Dual operator+(const Dual& a, double b) {
    return {a.value + b, a.partial};
  }
  EIGEN_ALWAYS_INLINE friend Dual operator+(double a, const Dual& b) {
    return {a + b.value, b.partial};
  }
  EIGEN_ALWAYS_INLINE friend Dual operator-(const Dual& a, double b) {
    return {a.value - b, a.partial};
  }
  EIGEN_ALWAYS_INLINE friend Dual operator-(double a, const Dual& b) {
    return {a - b.value, -b.partial};
  }
  EIGEN_ALWAYS_INLINE friend Dual operator*(const Dual& a, double b) {
    return {a.value * b, a.partial * b};
  }
  EIGEN_ALWAYS_INLINE friend Dual operator*(double a, const Dual& b) {
    return {a * b.value, a * b.partial};
  }
  EIGEN_ALWAYS_INLINE friend Dual operator/(const Dual& a, double b) { return a * (1.0 / b); }
  EIGEN_ALWAYS_INLINE friend Dual operator/(double a, const Dual& b) {
    return b.chain(a / b.value, -a / (b.value * b.value));
  }

  EIGEN_ALWAYS_INLINE friend bool operator<(const Dual& a, const Dual& b) {
    return a.value < b.value;
  }
  EIGEN_ALWAYS_INLINE friend bool operator>(const Dual& a, const Dual& b) {
    return a.value > b.value;
  }

  EIGEN_ALWAYS_INLINE friend Dual sqrt(const Dual& x) {
    const double root = std::sqrt(x.value);
    return x.chain(root, 0.5 / root);
  }
  EIGEN_ALWAYS_INLINE friend Dual exp(const Dual& x) {
    const double e = std::exp(x.value);
    return x.chain(e, e);
  }
  EIGEN_ALWAYS_INLINE friend Dual log(const Dual& x) {
    return x.chain(std::log(x.value), 1.0 / x.value);
  }
  EIGEN_ALWAYS_INLINE friend Dual tanh(const Dual& x) {
    const double t = std::tanh(x.value);
    return x.chain(t, 1.0 - t * t);
  }
};

/// Is x zero, and will it stay so whatever is varied?
inline bool is_nothing(double x) { return x == 0.0; }
template <int kN>
bool is_nothing(const Dual<kN>& x) {
  return x.value == 0.0 && (x.partial == 0.0).all();
}

/// The value without its derivatives.
inline double value_of(double x) { return x; }
template <int kN>
double value_of(const Dual<kN>& x) {
  return x.value;
}

/// base^exponent for base > 0 and an exponent without derivatives.
inline double power(double base, double exponent) { return std::pow(base, exponent); }
template <int kN>
Dual<kN> power(const Dual<kN>& base, double exponent) {
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
