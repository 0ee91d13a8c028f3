// SPDX-License-Identifier: MIT
// The linear electro-hydraulic servo, Eqs. (1)-(6) of Ghazali, Sam, Rahmat, Zulfatman, "Recursive
// parameter estimation for discrete-time model of an electro-hydraulic servo system with varying
// forgetting factor", Int. J. Phys. Sci. 6(30), 2011. Forwards (servo_discretisation.hpp): physical
// parameters -> continuous model (5) -> sampled model (6). Here the way back: from an estimated
// theta to gain, natural frequency and damping, with standard deviations, or the reason why there
// are none. Derivation, limits and accuracy: docs/servo_model.md.
#pragma once

#include <ehsid/servo_discretisation.hpp>
#include <ehsid/servo_poles.hpp>
#include <ehsid/tracked_servo.hpp>
#include <ehsid/types.hpp>

#include <cmath>
#include <limits>

namespace ehsid {

/// Whether theta can be read as a servo (5), and if not, why.
enum class ServoReadingStatus : std::uint8_t {
  ok = 0,
  not_finite = 1,           // NaN or Inf in theta, covariance or dt_s
  invalid_argument = 2,     // dt_s <= 0, or a negative variance
  no_integrator = 3,        // no real pole at z = 1, within its uncertainty
  poles_not_separable = 4,  // uncertainty of the integrator pole reaches the next pole
  pole_near_zero = 5,       // product of the other two poles is zero within its uncertainty
  negative_real_pole = 6,   // a real pole below zero: no continuous servo has one under a hold
  unstable_pole = 7,        // one of the other two poles on or outside the unit circle
  aliasing = 8,             // sampled too slowly: angle of the poles reaches pi, or b is that of a
                            // servo above half the sampling rate
  no_gain = 9,              // b1 = b2 = b3 = 0
  numerical_limit = 10,     // result or a standard deviation not finite in Scalar
};

/// The name of the status, as of a Status.
constexpr const char* to_string(ServoReadingStatus status) {
  switch (status) {
    case ServoReadingStatus::ok:
      return "ok";
    case ServoReadingStatus::not_finite:
      return "not_finite";
    case ServoReadingStatus::invalid_argument:
      return "invalid_argument";
    case ServoReadingStatus::no_integrator:
      return "no_integrator";
    case ServoReadingStatus::poles_not_separable:
      return "poles_not_separable";
    case ServoReadingStatus::pole_near_zero:
      return "pole_near_zero";
    case ServoReadingStatus::negative_real_pole:
      return "negative_real_pole";
    case ServoReadingStatus::unstable_pole:
      return "unstable_pole";
    case ServoReadingStatus::aliasing:
      return "aliasing";
    case ServoReadingStatus::no_gain:
      return "no_gain";
    case ServoReadingStatus::numerical_limit:
      return "numerical_limit";
  }
  return "unknown";
}

/// What theta says about the servo. Every number that was not determined, or is too large for Scalar, is NaN; none is
/// infinite. K needs the integrator and two other poles that are stable; omega_n and xi need `ok`.
template <class Scalar>
struct ServoReading {
  static constexpr Scalar kUnknown = std::numeric_limits<Scalar>::quiet_NaN();

  ServoReadingStatus status = ServoReadingStatus::ok;
  Scalar gain = kUnknown;      // K, m/(s V)
  Scalar omega_n = kUnknown;   // rad/s
  Scalar xi = kUnknown;        // 1
  Scalar gain_std = kUnknown;  // standard deviations, units as above
  Scalar omega_n_std = kUnknown;
  Scalar xi_std = kUnknown;
  SquareMatrix<Scalar, 3> covariance = SquareMatrix<Scalar, 3>::Constant(kUnknown);  // same order
  Scalar integrator_pole = kUnknown;  // the real pole nearest to z = 1
  Scalar integrator_pole_std = kUnknown;
  Scalar integrator_distance = kUnknown;  // its distance from 1
  // How far (b1, b2, b3) are from the b that (K, omega_n, xi) imply under zero-order hold:
  Scalar zoh_mismatch = kUnknown;       // |b - b_implied| / |b|
  Scalar zoh_mismatch_chi2 = kUnknown;  // squared distance in its covariance, chi^2 with 2 degrees
  // What the residuals say, which only servo() of an estimator knows, see judge():
  TrustReason reason = TrustReason::starting;
  Scalar residual_std = kUnknown;  // sigma of the equation error, units of the position

  bool trusted() const { return reason == TrustReason::trusted; }
};

/// Does a model of these orders have the (5 or) 6 coefficients of a servo (5), and perhaps a constant term behind them?
/// integrates: the integrator is known, see integrating.hpp. A delay above one sample is a dead time in front of the servo.
constexpr bool has_orders_of_servo(int na, int nb, int nk, bool integrates) {
  return na == (integrates ? 2 : 3) && nb == 3 && nk >= 1;
}

/// Fills in what the residuals say, for an estimator with these answers. Where they are not white theta is biased; where
/// it is not settled the deviations are wider than the tolerance; and before 300 samples nobody knows.
template <class Scalar>
void judge(ServoReading<Scalar>& reading, bool white, bool settled, bool converged,
           Scalar residual_variance) {
  reading.residual_std = std::sqrt(residual_variance);
  if (!white) {
    reading.reason = TrustReason::model_does_not_fit;
  } else if (!settled) {
    reading.reason = TrustReason::not_precise;
  } else if (!converged) {
    reading.reason = TrustReason::starting;
  } else {
    reading.reason = reading.status == ServoReadingStatus::ok ? TrustReason::trusted
                                                              : TrustReason::model_does_not_fit;
  }
}

/// Confidence width of every decision below, in standard deviations.
template <class Scalar>
constexpr Scalar kReadingSigmas = Scalar(3);
/// A pole counts as integrator if it is this much closer to z = 1 than the next pole, whatever its
/// uncertainty: the drift over the time constant of the servo is then below 2 %.
template <class Scalar>
constexpr Scalar kIntegratorShare = Scalar(0.02);
/// Least distance of the poles' angle from pi, as a share of pi.
template <class Scalar>
constexpr Scalar kNyquistMargin = Scalar(0.02);
/// b belongs to a servo above half the sampling rate if zoh_mismatch_chi2 exceeds the first number (of a servo below it
/// once in 3e6 readings) and b is within the second, relative, of the b of such a servo, and twice as close as to the
/// b of the servo below.
template <class Scalar>
constexpr Scalar kFoldedChi2 = Scalar(30);
template <class Scalar>
constexpr Scalar kFoldedMismatch = Scalar(0.1);

namespace detail {

/// The steps of identify_servo. Every test is worded so that NaN fails it.
template <class Scalar>
class ServoReader {
 public:
  using Status = ServoReadingStatus;

  ServoReader(const Vector<Scalar, 6>& theta, const SquareMatrix<Scalar, 6>& covariance,
              Scalar dt_s)
      : theta_(theta), covariance_(covariance), dt_s_(dt_s), poles_(theta) {
    // theta is stored in Scalar: its rounding, up to eps/2 relative, is uncertainty like any other.
    for (int i = 0; i < 6; ++i) {
      const Scalar rounding = std::numeric_limits<Scalar>::epsilon() * theta[i];
      covariance_(i, i) += rounding * rounding;
    }
  }

  Status read(ServoReading<Scalar>& reading) {
    Status status = judge_integrator(reading);
    if (status == Status::ok) {
      read_gain(reading);
      status = judge_pair();
    }
    if (status == Status::ok) {
      logarithms_ = poles_.logarithms();
      differentiate();
      status = judge_angle();
    }
    if (status == Status::ok && !has_gain()) {
      status = Status::no_gain;
    }
    return status == Status::ok ? finish(reading) : status;
  }

 private:
  static Scalar known(Scalar value) {
    return is_finite(value) ? value : ServoReading<Scalar>::kUnknown;
  }

  /// Standard deviation of a quantity with the given gradient; NaN where the covariance is none. What a covariance of lower
  /// rank knows exactly, such as the integrator of a servo, is known to the rounding of its sum: that may be negative.
  Scalar deviation(const Row6<Scalar>& gradient) const {
    const Scalar variance = (gradient * covariance_).dot(gradient);
    // |g_i C_ij g_j| sums to at most 6 g_i^2 C_ii, and each of its terms is rounded less than ten times.
    const Scalar rounding = Scalar(64) * std::numeric_limits<Scalar>::epsilon() *
                            gradient.cwiseAbs2().dot(covariance_.diagonal());
    return std::sqrt(variance < Scalar(0) && variance > -rounding ? rounding : variance);
  }

  Status judge_integrator(ServoReading<Scalar>& reading) const {
    const Scalar distance = std::abs(poles_.factors.root);
    const Scalar width = kReadingSigmas<Scalar> * deviation(poles_.d_pole);
    const Scalar next = poles_.next_distance();
    reading.integrator_pole = known(Scalar(1) + poles_.factors.root);
    reading.integrator_pole_std = known(deviation(poles_.d_pole));
    reading.integrator_distance = known(distance);
    if (!(distance <= width) && !(distance <= kIntegratorShare<Scalar> * next)) {
      return Status::no_integrator;
    }
    return width < next ? Status::ok : Status::poles_not_separable;
  }

  Status judge_pair() const {
    const auto& factors = poles_.factors;
    const Scalar width = kReadingSigmas<Scalar> * deviation(poles_.d_q2);
    if (poles_.q2 < -width) {
      return Status::negative_real_pole;
    }
    if (!(poles_.q2 > width)) {
      return Status::pole_near_zero;
    }
    // Q = delta^2 + b delta + c. Real poles of one sign by now; b/2 is the distance of their mean
    // from 1.
    const bool real = factors.discriminant >= Scalar(0);
    if (real && factors.b > Scalar(2)) {
      return Status::negative_real_pole;
    }
    return stable() ? Status::ok : Status::unstable_pole;
  }

  /// Both other poles inside the unit circle: |q2| < 1, Q(1) > 0, Q(-1) > 0 (E. I. Jury 1964, for degree two).
  bool stable() const {
    const Scalar at_minus_one = Scalar(4) - Scalar(2) * poles_.factors.b + poles_.factors.c;
    return std::abs(poles_.q2) < Scalar(1) && poles_.q_at_one > Scalar(0) &&
           at_minus_one > Scalar(0);
  }

  /// K dt, the velocity at constant input: it asks for a stable pair, not for one that a servo has.
  void read_gain(ServoReading<Scalar>& reading) {
    const auto b = theta_.template tail<3>();
    step_ = (b[0] + b[1] + b[2]) / poles_.q_at_one;
    d_step_ << Scalar(0), Scalar(0), Scalar(0), Scalar(1), Scalar(1), Scalar(1);
    d_step_ = (d_step_ - step_ * poles_.d_q_at_one) / poles_.q_at_one;
    const Scalar gain = step_ / dt_s_;
    const Scalar gain_std = deviation(d_step_) / dt_s_;
    if (stable() && is_finite(gain) && is_finite(gain_std) && has_gain()) {
      reading.gain = gain;
      reading.gain_std = gain_std;
    }
  }

  bool has_gain() const { return theta_.template tail<3>().cwiseAbs().maxCoeff() > Scalar(0); }

  Status judge_angle() const {
    const Scalar angle = logarithms_.angle;
    Scalar margin = kNyquistMargin<Scalar> * kPi<Scalar>;
    if (angle > kPi<Scalar> / Scalar(2)) {
      // angle^2 = y - v^2/4 differentiated
      const Row6<Scalar> d_angle =
          (d_y_ - (logarithms_.v / Scalar(2)) * d_v_) / (Scalar(2) * angle);
      const Scalar width = kReadingSigmas<Scalar> * deviation(d_angle);
      margin = width <= margin ? margin : width;
    }
    return angle <= kPi<Scalar> - margin ? Status::ok : Status::aliasing;
  }

  /// Implicit differentiation: the forward map (v, y) -> (Q(1), q2) is smooth also where the two
  /// poles coincide, so its 2 x 2 Jacobian is inverted instead of differentiating the poles.
  void differentiate() {
    unit_ = sample_servo(logarithms_.v, logarithms_.y);
    d_v_ = (Scalar(1) / unit_.q2.by_v) * poles_.d_q2;
    d_y_ = (Scalar(1) / unit_.q_at_one.by_y) * (poles_.d_q_at_one - unit_.q_at_one.by_v * d_v_);
  }

  Status finish(ServoReading<Scalar>& reading) const {
    ServoReading<Scalar> result = reading;
    const auto b = theta_.template tail<3>();
    const Scalar x = std::sqrt(logarithms_.y);
    result.omega_n = x / dt_s_;
    result.xi = logarithms_.v / (Scalar(2) * x);

    Eigen::Matrix<Scalar, 5, 6> jacobian;  // K, omega_n, xi, and the mismatch of b1 and b3
    jacobian.row(0) = d_step_ / dt_s_;
    jacobian.row(1) = d_y_ / (Scalar(2) * x * dt_s_);
    jacobian.row(2) = (d_v_ - (result.xi / x) * d_y_) / (Scalar(2) * x);
    jacobian.row(3) = -implied_gradient(unit_.b1);
    jacobian.row(4) = -implied_gradient(unit_.b3);
    jacobian(3, 3) += Scalar(1);
    jacobian(4, 5) += Scalar(1);
    const Eigen::Matrix<Scalar, 5, 6> weighted = jacobian * covariance_;
    const SquareMatrix<Scalar, 5> spread = weighted * jacobian.transpose();

    result.covariance = spread.template topLeftCorner<3, 3>();
    result.gain_std = std::sqrt(spread(0, 0));
    result.omega_n_std = std::sqrt(spread(1, 1));
    result.xi_std = std::sqrt(spread(2, 2));

    // b and its implied value have the same sum by the choice of K: two mismatches say everything.
    const Scalar first = b[0] - step_ * unit_.b1.value;
    const Scalar last = b[2] - step_ * unit_.b3.value;
    const Vector<Scalar, 3> mismatch(first, -(first + last), last);
    const Scalar largest = b.cwiseAbs().maxCoeff();  // squares of small b underflow in float
    result.zoh_mismatch = (mismatch / largest).norm() / (b / largest).norm();
    // r' C^-1 r by Cholesky factors of the 2 x 2 covariance C
    const Scalar l11 = std::sqrt(spread(3, 3));
    const Scalar l21 = spread(4, 3) / l11;
    const Scalar l22 = std::sqrt(spread(4, 4) - l21 * l21);
    const Scalar u1 = first / l11;
    const Scalar u2 = (last - l21 * u1) / l22;
    result.zoh_mismatch_chi2 = u1 * u1 + u2 * u2;
    if (result.zoh_mismatch_chi2 > kFoldedChi2<Scalar> && is_folded(result.zoh_mismatch)) {
      reading.zoh_mismatch = known(result.zoh_mismatch);
      reading.zoh_mismatch_chi2 = known(result.zoh_mismatch_chi2);
      return Status::aliasing;
    }

    const Scalar results[] = {result.gain,     result.omega_n,     result.xi,
                              result.gain_std, result.omega_n_std, result.xi_std};
    for (const Scalar value : results) {
      if (!is_finite(value)) {
        return Status::numerical_limit;
      }
    }
    result.zoh_mismatch = known(result.zoh_mismatch);
    result.zoh_mismatch_chi2 = known(result.zoh_mismatch_chi2);
    for (int i = 0; i < 9; ++i) {
      result.covariance(i / 3, i % 3) = known(result.covariance(i / 3, i % 3));
    }
    reading = result;
    return Status::ok;
  }

  /// Poles of the angles phi, 2 pi - phi, 2 pi + phi, ... are the same after sampling, and so is K; b is not. Is b that
  /// of a servo with one of the next four angles rather than of that with phi?
  bool is_folded(Scalar zoh_mismatch) const {
    const auto b = theta_.template tail<3>();
    const Scalar largest = b.cwiseAbs().maxCoeff();
    const Scalar half_v = logarithms_.v / Scalar(2);
    Scalar closest = zoh_mismatch;
    for (int i = 0; i < 4; ++i) {
      const int turn = i < 2 ? 1 : 2;
      const Scalar turns = Scalar(2 * turn) * kPi<Scalar>;
      const Scalar angle = i % 2 == 0 ? turns - logarithms_.angle : turns + logarithms_.angle;
      const SampledServo<Scalar> other =
          sample_servo(logarithms_.v, half_v * half_v + angle * angle);
      const Scalar first = step_ * other.b1.value;
      const Scalar last = step_ * other.b3.value;
      const Scalar middle = step_ * other.q_at_one.value - first - last;
      const Vector<Scalar, 3> mismatch(b[0] - first, b[1] - middle, b[2] - last);
      const Scalar distance = (mismatch / largest).norm() / (b / largest).norm();
      closest = distance < closest ? distance : closest;
    }
    return closest < kFoldedMismatch<Scalar> && closest < zoh_mismatch / Scalar(2);
  }

  /// Gradient of b_implied = K dt beta(v, y).
  Row6<Scalar> implied_gradient(const Sensitive<Scalar>& beta) const {
    return beta.value * d_step_ + step_ * (beta.by_v * d_v_ + beta.by_y * d_y_);
  }

  Vector<Scalar, 6> theta_;
  SquareMatrix<Scalar, 6> covariance_;
  Scalar dt_s_;
  ServoDenominator<Scalar> poles_;
  PoleLogarithms<Scalar> logarithms_{};
  SampledServo<Scalar> unit_{};
  Scalar step_{};  // K dt
  Row6<Scalar> d_step_;
  Row6<Scalar> d_v_;
  Row6<Scalar> d_y_;
};

}  // namespace detail

/// Reads theta = (a1, a2, a3, b1, b2, b3) of Eq. (6) as a servo (5) under zero-order hold.
/// covariance: of theta, sigma^2 P, symmetric, zero where unknown (rounding of theta is added).
/// dt_s: sampling period, s, > 0.
template <class Scalar>
ServoReading<Scalar> identify_servo(const Vector<Scalar, 6>& theta,
                                    const SquareMatrix<Scalar, 6>& covariance, Scalar dt_s) {
  ServoReading<Scalar> reading;
  bool finite = is_finite(dt_s) && all_finite<6>(theta);
  bool valid = dt_s > Scalar(0);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      finite = is_finite(covariance(i, j)) && finite;
    }
    valid = covariance(i, i) >= Scalar(0) && valid;
  }
  if (!finite || !valid) {
    reading.status = finite ? ServoReadingStatus::invalid_argument : ServoReadingStatus::not_finite;
    return reading;
  }
  reading.status = detail::ServoReader<Scalar>(theta, covariance, dt_s).read(reading);
  return reading;
}

/// The same of an estimate whose integrator is known, see integrating.hpp: theta = (a1, a2, b1, b2, b3).
template <class Scalar>
ServoReading<Scalar> identify_integrating_servo(const Vector<Scalar, 5>& theta,
                                                const SquareMatrix<Scalar, 5>& covariance,
                                                Scalar dt_s) {
  // (1 - q^-1) (1 + a1 q^-1 + a2 q^-2) = 1 + (a1 - 1) q^-1 + (a2 - a1) q^-2 - a2 q^-3
  Eigen::Matrix<Scalar, 6, 5> times = Eigen::Matrix<Scalar, 6, 5>::Zero();
  times(0, 0) = times(1, 1) = Scalar(1);
  times(1, 0) = times(2, 1) = Scalar(-1);
  times.template bottomRightCorner<3, 3>().setIdentity();
  Vector<Scalar, 6> whole = times * theta;
  whole[0] -= Scalar(1);
  const SquareMatrix<Scalar, 6> spread = times * covariance * times.transpose();
  return identify_servo(whole, spread, dt_s);
}

}  // namespace ehsid
