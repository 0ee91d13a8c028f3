// SPDX-License-Identifier: MIT
// From the coefficients of a sampled third-order model to its poles and their logarithms, with
// square roots and series of bounded length only. The cubic is solved for delta = z - 1: at short
// sampling periods the poles crowd at z = 1, and the integrator is the root nearest to delta = 0.
#pragma once

#include <ehsid/types.hpp>

#include <cmath>
#include <limits>

namespace ehsid {

template <class Scalar>
constexpr Scalar kPi = Scalar(3.14159265358979323846L);

/// ln z of a real z > 0. Relative accuracy: a few units of rounding, also near z = 1.
template <class Scalar>
Scalar real_logarithm(Scalar z) {
  // ln z = 2^k ln z^(1/2^k). Twelve roots bring the smallest double to within 1/2 of one.
  Scalar factor = Scalar(2);
  for (int i = 0; i < 12 && std::abs(z - Scalar(1)) > Scalar(0.5); ++i) {
    z = std::sqrt(z);
    factor *= Scalar(2);
  }
  // ln(1 + u) = 2 artanh(t), t = u / (2 + u), |t| <= 1/3: term n is below 9^-n, under 2^-53 at n
  // = 17.
  const Scalar t = (z - Scalar(1)) / (z + Scalar(1));
  const Scalar t_t = t * t;
  Scalar sum = Scalar(0);
  for (int n = 17; n >= 0; --n) {
    sum = sum * t_t + Scalar(1) / static_cast<Scalar>(2 * n + 1);
  }
  return factor * t * sum;
}

/// Imaginary part of ln(re + j im), im >= 0 and not both zero: the angle in [0, pi].
/// The argument of a complex square root is half the angle, here as the half-angle formula of the
/// tangent.
template <class Scalar>
Scalar upper_angle(Scalar re, Scalar im) {
  // tan(phi / 2), phi in [0, pi/2] the angle to the nearer half of the real axis.
  Scalar t = im / (std::sqrt(re * re + im * im) + std::abs(re));
  for (int i = 0; i < 2; ++i) {
    t = t / (Scalar(1) + std::sqrt(Scalar(1) + t * t));
  }
  // artan series, t <= tan(pi/16) < 0.2: term n is below 25^-n, under 2^-53 at n = 12.
  const Scalar t_t = t * t;
  Scalar sum = Scalar(0);
  for (int n = 12; n >= 0; --n) {
    sum = Scalar(1) / static_cast<Scalar>(2 * n + 1) - sum * t_t;
  }
  const Scalar phi = Scalar(8) * t * sum;
  return re < Scalar(0) ? kPi<Scalar> - phi : phi;
}

/// x^3 + c2 x^2 + c1 x + c0 = (x - root)(x^2 + b x + c).
template <class Scalar>
struct CubicFactors {
  Scalar root;  // the real root nearest to zero
  Scalar b;
  Scalar c;
  Scalar discriminant;  // b^2/4 - c: negative for a complex pair
};

namespace detail {

/// x^3 + c2 x^2 + c1 x + c0 with the size of the rounding that its evaluation suffers.
template <class Scalar>
struct Cubic {
  Scalar c2;
  Scalar c1;
  Scalar c0;

  Scalar value(Scalar x) const { return ((x + c2) * x + c1) * x + c0; }
  Scalar slope(Scalar x) const { return (Scalar(3) * x + Scalar(2) * c2) * x + c1; }
  bool vanishes(Scalar x) const {
    const Scalar a = std::abs(x);
    const Scalar size = ((a + std::abs(c2)) * a + std::abs(c1)) * a + std::abs(c0);
    return std::abs(value(x)) <= Scalar(4) * std::numeric_limits<Scalar>::epsilon() * size;
  }

  /// Division by (x - root), from the end at which the quotient does not cancel: from the top for
  /// the small roots, from the bottom for the large ones.
  CubicFactors<Scalar> deflate(Scalar root) const {
    Scalar b = c2 + root;
    Scalar c = c1 + root * b;
    if (std::abs(root * root * root) > std::abs(c0)) {
      c = -c0 / root;
      b = (c - c1) / root;
    }
    return {root, b, c, b * b / Scalar(4) - c};
  }

  /// A real root by Newton steps that stay inside a bracket and at least halve from one to the
  /// next; otherwise bisection.
  Scalar real_root() const {
    // Cauchy: no root is larger than 1 + max |c|. The sign of c0 says on which side one must lie.
    Scalar bound = std::abs(c2) > std::abs(c1) ? std::abs(c2) : std::abs(c1);
    bound = Scalar(1) + (bound > std::abs(c0) ? bound : std::abs(c0));
    Scalar below = c0 > Scalar(0) ? -bound : Scalar(0);
    Scalar above = c0 > Scalar(0) ? Scalar(0) : bound;
    Scalar x = Scalar(0);
    Scalar last_step = bound;
    for (int i = 0; i < 128 && last_step > Scalar(0); ++i) {
      const Scalar here = value(x);
      (here < Scalar(0) ? below : above) = x;
      Scalar next = x - here / slope(x);
      const bool inside = next >= below && next <= above;  // false for NaN too
      if (!inside || std::abs(next - x) > Scalar(0.5) * last_step) {
        next = below + Scalar(0.5) * (above - below);
      }
      last_step = std::abs(next - x);
      x = next;
    }
    return x;
  }
};

}  // namespace detail

/// Splits off the real root nearest to zero. Coefficients finite.
template <class Scalar>
CubicFactors<Scalar> split_cubic(Scalar c2, Scalar c1, Scalar c0) {
  const detail::Cubic<Scalar> cubic{c2, c1, c0};
  const auto factors = cubic.deflate(cubic.real_root());
  if (!(factors.discriminant >= Scalar(0))) {
    return factors;
  }
  // Three real roots, or nearly so. If another is nearer to zero, polish it on the cubic itself;
  // near a double root Newton's method gains a factor of four in the residual a step.
  const Scalar half = factors.b / Scalar(2);
  const Scalar root = std::sqrt(factors.discriminant);
  const Scalar outer = half < Scalar(0) ? root - half : -half - root;
  Scalar x = std::abs(outer) > Scalar(0) ? factors.c / outer : Scalar(0);
  if (!(std::abs(x) < std::abs(factors.root))) {
    return factors;
  }
  for (int i = 0; i < 32 && !cubic.vanishes(x); ++i) {
    x -= cubic.value(x) / cubic.slope(x);
  }
  return cubic.vanishes(x) ? cubic.deflate(x) : factors;
}

namespace detail {

/// What the logarithms of the two poles say, whether real or complex.
template <class Scalar>
struct PoleLogarithms {
  Scalar v;      // 2 xi omega_n dt, minus their sum
  Scalar y;      // (omega_n dt)^2, their product
  Scalar angle;  // omega_n dt sqrt(1 - xi^2), 0 for real poles
};

/// Gradient by theta.
template <class Scalar>
using Row6 = Eigen::Matrix<Scalar, 1, 6>;

/// Denominator of theta taken apart: (z - p)(z^2 + q1 z + q2), with gradients by theta.
template <class Scalar>
struct ServoDenominator {
  CubicFactors<Scalar> factors;  // in delta = z - 1
  Scalar q2;
  Scalar q_at_one;
  Row6<Scalar> d_pole;
  Row6<Scalar> d_q2;
  Row6<Scalar> d_q_at_one;

  explicit ServoDenominator(const Vector<Scalar, 6>& theta) {
    const Scalar a1 = theta[0];
    const Scalar a2 = theta[1];
    const Scalar a3 = theta[2];
    factors = split_cubic(Scalar(3) + a1, (Scalar(3) + Scalar(2) * a1) + a2,
                          (Scalar(1) + a2) + (a1 + a3));
    const Scalar rho = factors.root;
    const Scalar p = Scalar(1) + rho;
    q2 = -a3 / p;
    q_at_one = factors.c;
    // A(p) = 0 differentiated: dp = -(p^2 da1 + p da2 + da3) / A'(p), and A'(p) = Q(p)
    const Scalar slope = (rho + factors.b) * rho + factors.c;
    d_pole << p * p, p, Scalar(1), Scalar(0), Scalar(0), Scalar(0);
    d_pole *= Scalar(-1) / slope;
    // a3 = -p q2 and a1 = q1 - p; p - q2 = rho - (q2 - 1) = rho - (c - b)
    d_q2 = (-q2 / p) * d_pole;
    d_q2[2] -= Scalar(1) / p;
    d_q_at_one = ((rho - (factors.c - factors.b)) / p) * d_pole;
    d_q_at_one[0] += Scalar(1);
    d_q_at_one[2] -= Scalar(1) / p;
  }

  /// Distance from z = 1 of the nearer of the other two poles.
  Scalar next_distance() const {
    if (factors.discriminant < Scalar(0)) {
      return std::sqrt(factors.c);
    }
    const Scalar outer = std::abs(factors.b) / Scalar(2) + std::sqrt(factors.discriminant);
    return outer > Scalar(0) ? std::abs(factors.c) / outer : Scalar(0);
  }

  /// Needs the two poles inside the unit circle, and positive if they are real.
  PoleLogarithms<Scalar> logarithms() const {
    const Scalar v = -real_logarithm(q2);
    const Scalar mean = Scalar(1) - factors.b / Scalar(2);
    if (factors.discriminant < Scalar(0)) {
      const Scalar angle = upper_angle(mean, std::sqrt(-factors.discriminant));
      return {v, v * v / Scalar(4) + angle * angle, angle};
    }
    // The fast pole may be far below the rounding of the slow one: from the product, not by
    // subtraction.
    const Scalar z_slow = mean + std::sqrt(factors.discriminant);
    const Scalar y = real_logarithm(z_slow) * real_logarithm(q2 / z_slow);
    return {v, y, Scalar(0)};
  }
};

}  // namespace detail
}  // namespace ehsid
