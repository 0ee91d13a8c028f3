// SPDX-License-Identifier: MIT
// What the linear servo (5) does during one sampling period, exactly, with its sensitivities to omega_n and xi.
//
// Time is counted in sampling periods: h = omega_n dt, k = K dt. With the demanded velocity r = k (u - d), which is held,
// and the velocity error e = v - r,
//   e'' + 2 xi h e' + h^2 e = 0,   position' = r + e,   acceleration a = e'.
// Let E and c solve the same equation with E(0) = 0, E'(0) = 1 and c(0) = 1, c'(0) = 0. Over one period
//   position + v - S e + I a,   v - W e + E a,   (1 - W - 2 xi h E) a - h^2 E e
// where W = 1 - c, S = integral of W, I = W / h^2. These come without cancellation from servo_discretisation.hpp.
#pragma once

#include <ehsid/servo_discretisation.hpp>
#include <ehsid/types.hpp>

namespace ehsid {

/// A coefficient, and its derivatives by ln omega_n and by ln xi.
template <class Scalar>
struct ServoCoefficient {
  Scalar value;
  Scalar by_rate;
  Scalar by_damping;

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&ServoCoefficient::value);
    visit(&ServoCoefficient::by_rate);
    visit(&ServoCoefficient::by_damping);
  }
};

/// The coefficients of one period.
template <class Scalar>
struct ServoTransition {
  ServoCoefficient<Scalar> s;      // S
  ServoCoefficient<Scalar> w;      // W
  ServoCoefficient<Scalar> e;      // E
  ServoCoefficient<Scalar> i;      // I
  ServoCoefficient<Scalar> decay;  // 1 - W - 2 xi h E
  ServoCoefficient<Scalar> pull;   // h^2 E

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&ServoTransition::s);
    visit(&ServoTransition::w);
    visit(&ServoTransition::e);
    visit(&ServoTransition::i);
    visit(&ServoTransition::decay);
    visit(&ServoTransition::pull);
  }
};

/// The servo with rate h = omega_n dt in (0, 20] and damping ratio xi in (0, 5] over one period.
template <class Scalar>
EHSID_ALWAYS_INLINE inline ServoTransition<Scalar> servo_transition(Scalar rate, Scalar damping) {
  using Number = Sensitive<Scalar>;
  const Scalar v_value = Scalar(2) * damping * rate;
  const Scalar y_value = rate * rate;
  const MultipleOfV<Scalar> v{v_value, Scalar(1)};
  const MultipleOfY<Scalar> y{y_value, Scalar(1)};
  int doublings = 0;
  Scalar tau = Scalar(1);
  while (doublings < detail::kServoMaxDoublings &&
         (tau * v_value > Scalar(0.25) || tau * tau * y_value > Scalar(0.0625))) {
    tau *= Scalar(0.5);
    ++doublings;
  }
  const auto step = detail::short_servo_step(MultipleOfV<Scalar>{tau * v_value, tau},
                                             MultipleOfY<Scalar>{tau * tau * y_value, tau * tau});
  Number e = tau * step.e;
  Number w = step.w;
  Number s = tau * step.s;
  for (int i = 0; i < doublings; ++i) {
    // Twice the time: c + e' = 2 (1 - W) - v E.
    const Number rest = Scalar(2) - w;
    const Number trace = (Scalar(2) - Scalar(2) * w) - v * e;
    s = s * rest + w * (tau + e);
    w = w * rest + y * e * e;
    e = e * trace;
    tau *= Scalar(2);
  }
  // d/d ln omega_n = v d/dv + 2 y d/dy,  d/d ln xi = v d/dv
  const auto by_logarithms = [v_value, y_value](const Number& number) {
    const Scalar damped = v_value * number.by_v;
    return ServoCoefficient<Scalar>{number.value, damped + Scalar(2) * y_value * number.by_y,
                                    damped};
  };
  ServoTransition<Scalar> made{};
  made.s = by_logarithms(s);
  made.w = by_logarithms(w);
  made.e = by_logarithms(e);
  made.decay = by_logarithms((Scalar(1) - w) - v * e);
  made.pull = by_logarithms(y * e);
  made.i = {made.w.value / y_value, made.w.by_rate / y_value - Scalar(2) * (made.w.value / y_value),
            made.w.by_damping / y_value};
  return made;
}

}  // namespace ehsid
