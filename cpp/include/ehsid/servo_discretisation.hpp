// SPDX-License-Identifier: MIT
// The linear servo forwards, Eqs. (1)-(6) of the paper named in servo_model.hpp: physical
// parameters
// -> continuous model -> zero-order hold. No exp, sin or cos; derivatives come along.
//
// Time is counted in sampling periods and K dt = 1, so that two numbers describe the servo:
//   v = 2 xi omega_n dt  and  y = (omega_n dt)^2,  G(s) = y / (s (s^2 + v s + y)).
// Let e and c solve f'' + v f' + y f = 0 with e(0) = 0, e'(0) = 1 and c(0) = 1, c'(0) = 0. Then
//   w = 1 - c    step response of the velocity,
//   s = int w    step response of the position,
//   d = exp(-v)  product of the two poles.
// Reversing time turns xi into -xi. The partners are w_r = d w(-xi) = d - e' and s_r = d s(-xi),
// and
//   Q(z) = z^2 + q1 z + d,  Q(1) = w + w_r,  b1 = s,  b3 = s_r,  b2 = Q(1) - b1 - b3.
// For one short step they come from their Taylor series, whose terms do not cancel; then time is
// doubled. In this form every quantity keeps its relative accuracy, however short the sampling
// period. Derivation: docs/servo_model.md.
#pragma once

#include <ehsid/types.hpp>

#include <cmath>

namespace ehsid {

/// A number and its derivatives by v and by y (forward differentiation).
template <class Scalar>
struct Sensitive {
  Scalar value;
  Scalar by_v = Scalar(0);
  Scalar by_y = Scalar(0);

  friend Sensitive operator+(const Sensitive& l, const Sensitive& r) {
    return {l.value + r.value, l.by_v + r.by_v, l.by_y + r.by_y};
  }
  friend Sensitive operator-(const Sensitive& l, const Sensitive& r) {
    return {l.value - r.value, l.by_v - r.by_v, l.by_y - r.by_y};
  }
  friend Sensitive operator*(const Sensitive& l, const Sensitive& r) {
    return {l.value * r.value, l.by_v * r.value + l.value * r.by_v,
            l.by_y * r.value + l.value * r.by_y};
  }
  friend Sensitive operator*(Scalar l, const Sensitive& r) {
    return {l * r.value, l * r.by_v, l * r.by_y};
  }
  friend Sensitive operator-(Scalar l, const Sensitive& r) {
    return {l - r.value, -r.by_v, -r.by_y};
  }
  friend Sensitive operator+(Scalar l, const Sensitive& r) { return {l + r.value, r.by_v, r.by_y}; }
};

/// v itself, or a multiple of it: its derivative by y is 0.
template <class Scalar>
struct MultipleOfV {
  Scalar value;
  Scalar by_v;

  friend Sensitive<Scalar> operator*(const MultipleOfV& l, const Sensitive<Scalar>& r) {
    return {l.value * r.value, l.by_v * r.value + l.value * r.by_v, l.value * r.by_y};
  }
};

/// y itself, or a multiple of it: its derivative by v is 0.
template <class Scalar>
struct MultipleOfY {
  Scalar value;
  Scalar by_y;

  friend Sensitive<Scalar> operator*(const MultipleOfY& l, const Sensitive<Scalar>& r) {
    return {l.value * r.value, l.value * r.by_v, l.by_y * r.value + l.value * r.by_y};
  }
};

/// The sampled servo for K dt = 1: denominator (z - 1) Q(z), numerator b1 z^2 + b2 z + b3.
template <class Scalar>
struct SampledServo {
  Sensitive<Scalar> q_at_one;  // Q(1) = 1 + q1 + q2 = b1 + b2 + b3
  Sensitive<Scalar> q2;        // product of the two poles, exp(-v)
  Sensitive<Scalar> b1;
  Sensitive<Scalar> b3;
};

namespace detail {

// The short step has v, sqrt(y) <= 1/4, so term n is below 0.41^n / n!: under 2^-53 from n = 14 on, and under 2^-24 from
// n = 8 on.
template <class Scalar>
constexpr int kServoSeriesTerms = sizeof(Scalar) == sizeof(float) ? 9 : 15;
constexpr int kServoMaxDoublings = 12;

/// e, w and S over a unit of time, for v and sqrt(y) up to 1/4 in size.
template <class Scalar>
struct ServoStep {
  Sensitive<Scalar> e;
  Sensitive<Scalar> w;
  Sensitive<Scalar> s;
};

template <class Scalar>
ServoStep<Scalar> short_servo_step(const MultipleOfV<Scalar>& v, const MultipleOfY<Scalar>& y) {
  using Number = Sensitive<Scalar>;
  Number before{Scalar(0)};
  Number term{Scalar(1)};
  ServoStep<Scalar> sum{term, Scalar(1) / Scalar(2) * term, Scalar(1) / Scalar(6) * term};
  for (int n = 2; n <= kServoSeriesTerms<Scalar>; ++n) {
    // e_n = -(v e_(n-1) + y e_(n-2) / (n-1)) / n
    const Number next =
        -Inverse<Scalar>::of[n] * (v * term + Inverse<Scalar>::of[n - 1] * (y * before));
    before = term;
    term = next;
    // w = y times the integral of e, S = integral of w
    const Scalar once = Inverse<Scalar>::of[n + 1];
    sum.e = sum.e + term;
    sum.w = sum.w + once * term;
    sum.s = sum.s + once * Inverse<Scalar>::of[n + 2] * term;
  }
  return {sum.e, y * sum.w, y * sum.s};
}

/// exp(-v) for v up to 1/4 in size, by Horner's rule: 1 - v (1 - v/2 (1 - v/3 (...))).
template <class Scalar>
Sensitive<Scalar> short_exponential(const MultipleOfV<Scalar>& v) {
  Sensitive<Scalar> sum{Scalar(1)};
  for (int n = kServoSeriesTerms<Scalar>; n >= 1; --n) {
    const Scalar inverse = Inverse<Scalar>::of[n];
    sum = Scalar(1) - MultipleOfV<Scalar>{inverse * v.value, inverse * v.by_v} * sum;
  }
  return sum;
}

}  // namespace detail

/// Largest value of v and of sqrt(y) that sample_servo takes.
template <class Scalar>
constexpr Scalar kLargestServoRate = Scalar(1 << (detail::kServoMaxDoublings - 2));

/// Zero-order hold of y / (s (s^2 + v s + y)) over one sampling period.
/// v in [0, kLargestServoRate], y in (0, kLargestServoRate^2].
template <class Scalar>
SampledServo<Scalar> sample_servo(Scalar v_value, Scalar y_value) {
  using Number = Sensitive<Scalar>;
  const MultipleOfY<Scalar> y{y_value, Scalar(1)};

  int doublings = 0;
  Scalar tau = Scalar(1);  // length of the short step, then of the time covered
  while (doublings < detail::kServoMaxDoublings &&
         (tau * v_value > Scalar(0.25) || tau * tau * y_value > Scalar(0.0625))) {
    tau *= Scalar(0.5);
    ++doublings;
  }

  const MultipleOfV<Scalar> short_v{tau * v_value, tau};
  const MultipleOfY<Scalar> short_y{tau * tau * y_value, tau * tau};
  const auto forward = detail::short_servo_step(short_v, short_y);
  const auto backward =
      detail::short_servo_step(MultipleOfV<Scalar>{-short_v.value, -short_v.by_v}, short_y);
  Number d = detail::short_exponential(short_v);
  Number e = tau * forward.e;
  Number w = forward.w;
  Number s = tau * forward.s;
  Number w_r = d * backward.w;
  Number s_r = tau * (d * backward.s);

  for (int i = 0; i < doublings; ++i) {
    const Number y_e_e = y * e * e;
    // 1 + c = 2 - w,  d + e' = 2 d - w_r,  c + e' = (1 - w) + (d - w_r)
    const Number one_plus_c = Scalar(2) - w;
    const Number d_plus_e_dot = Scalar(2) * d - w_r;
    const Number trace = (Scalar(1) - w) + (d - w_r);
    s = s * one_plus_c + w * (tau + e);
    w = w * one_plus_c + y_e_e;
    s_r = s_r * d_plus_e_dot + w_r * (tau * d + e);
    w_r = w_r * d_plus_e_dot + y_e_e;
    e = e * trace;
    d = d * d;
    tau *= Scalar(2);
  }
  return {w + w_r, d, s, s_r};
}

/// Physical parameters of Eqs. (1)-(4), SI.
template <class Scalar>
struct ServoParameters {
  Scalar k_v;     // spool displacement per volt, m/V, > 0
  Scalar k_q;     // flow gain, m^3/s per m of spool (m^2/s), > 0
  Scalar k_c;     // flow-pressure coefficient, m^3/(s Pa), >= 0
  Scalar c_p;     // leakage coefficient, m^3/(s Pa), >= 0
  Scalar a_p;     // piston area, m^2, > 0
  Scalar v_t;     // total volume under compression, m^3, > 0
  Scalar beta_e;  // effective bulk modulus, Pa, > 0
  Scalar m_t;     // moved mass, kg, > 0

  bool valid() const {
    const Scalar positive[] = {k_v, k_q, a_p, v_t, beta_e, m_t};
    const Scalar not_negative[] = {k_c, c_p};
    bool good = true;
    for (const Scalar value : positive) {
      good = is_finite(value) && value > Scalar(0) && good;
    }
    for (const Scalar value : not_negative) {
      good = is_finite(value) && value >= Scalar(0) && good;
    }
    return good;
  }
};

/// Y(s)/U(s) = K omega_n^2 / (s (s^2 + 2 xi omega_n s + omega_n^2)), Eq. (5).
template <class Scalar>
struct ContinuousServo {
  Scalar gain;     // K, velocity gain, m/(s V)
  Scalar omega_n;  // undamped natural frequency, rad/s, > 0
  Scalar xi;       // damping ratio, >= 0; above 1 the two poles are real

  bool valid() const {
    return is_finite(gain) && is_finite(omega_n) && omega_n > Scalar(0) && is_finite(xi) &&
           xi >= Scalar(0);
  }
};

/// Eq. (5) from the physical parameters. invalid_argument where a parameter is outside its range,
/// numerical_limit where the result is not finite in Scalar; `servo` is then kept as it was.
template <class Scalar>
Status continuous_servo(const ServoParameters<Scalar>& p, ContinuousServo<Scalar>& servo) {
  if (!p.valid()) {
    return Status::invalid_argument;
  }
  const Scalar stiffness = Scalar(4) * p.beta_e / p.v_t;
  // K = K_q K_v / A_p,  omega_n = A_p sqrt(4 beta_e / (V_t M_t)),
  // xi = sqrt(4 beta_e M_t / V_t) (K_c + C_p) / (2 A_p)
  const ContinuousServo<Scalar> result{
      p.k_q * p.k_v / p.a_p, p.a_p * std::sqrt(stiffness / p.m_t),
      std::sqrt(stiffness * p.m_t) * (p.k_c + p.c_p) / (Scalar(2) * p.a_p)};
  if (!result.valid()) {
    return Status::numerical_limit;
  }
  servo = result;
  return Status::ok;
}

namespace detail {

/// Eq. (6) of what a part of the sampled servo says: its value, or one of its derivatives. one: 1 for the value, which has the
/// constants of (z - 1)(z^2 + q1 z + q2) with q1 = Q(1) - 1 - q2, multiplied out; 0 for a derivative.
template <class Scalar>
Vector<Scalar, 6> servo_coefficients(Scalar one, Scalar q_at_one, Scalar q2, Scalar b1, Scalar b3,
                                     Scalar step) {
  Vector<Scalar, 6> theta;
  theta[0] = (q_at_one - Scalar(2) * one) - q2;
  theta[1] = (one - q_at_one) + Scalar(2) * q2;
  theta[2] = -q2;
  theta[3] = step * b1;
  theta[4] = step * ((q_at_one - b1) - b3);
  theta[5] = step * b3;
  return theta;
}

}  // namespace detail

/// Zero-order hold of (5), Eq. (6): theta = (a1, a2, a3, b1, b2, b3), and where asked for, its derivatives by ln K, ln omega_n
/// and ln xi, one a column.
/// dt_s: sampling period, s. invalid_input for NaN or Inf; invalid_argument for omega_n <= 0, xi <
/// 0 or dt_s <= 0; out_of_range unless 1e-6 <= omega_n dt and omega_n dt max(1, 2 xi) <= 1024;
/// numerical_limit where a coefficient is not finite in Scalar. `theta` is kept as it was unless
/// ok.
template <class Scalar>
Status discretise(const ContinuousServo<Scalar>& servo, Scalar dt_s, Vector<Scalar, 6>& theta,
                  Matrix<Scalar, 6, 3>* derivatives = nullptr) {
  if (!is_finite(dt_s) || !is_finite(servo.gain) || !is_finite(servo.omega_n) ||
      !is_finite(servo.xi)) {
    return Status::invalid_input;
  }
  if (!(dt_s > Scalar(0)) || !servo.valid()) {
    return Status::invalid_argument;
  }
  const Scalar x = servo.omega_n * dt_s;
  const Scalar v = Scalar(2) * servo.xi * x;
  if (!(x >= Scalar(1e-6) && x <= kLargestServoRate<Scalar> && v <= kLargestServoRate<Scalar>)) {
    return Status::out_of_range;
  }
  const SampledServo<Scalar> unit = sample_servo(v, x * x);
  const Scalar step = servo.gain * dt_s;
  const Vector<Scalar, 6> result = detail::servo_coefficients(
      Scalar(1), unit.q_at_one.value, unit.q2.value, unit.b1.value, unit.b3.value, step);
  if (!all_finite<6>(result)) {
    return Status::numerical_limit;
  }
  theta = result;
  if (derivatives != nullptr) {
    const Vector<Scalar, 6> by_v = detail::servo_coefficients(
        Scalar(0), unit.q_at_one.by_v, unit.q2.by_v, unit.b1.by_v, unit.b3.by_v, step);
    const Vector<Scalar, 6> by_y = detail::servo_coefficients(
        Scalar(0), unit.q_at_one.by_y, unit.q2.by_y, unit.b1.by_y, unit.b3.by_y, step);
    for (int i = 0; i < 6; ++i) {
      (*derivatives)(i, 0) = i < 3 ? Scalar(0) : theta[i];
      (*derivatives)(i, 1) =
          v * by_v[i] + Scalar(2) * x * x * by_y[i];  // v ~ omega_n, y ~ omega_n^2
      (*derivatives)(i, 2) = v * by_v[i];
    }
  }
  return Status::ok;
}

}  // namespace ehsid
