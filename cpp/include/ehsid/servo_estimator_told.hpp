// SPDX-License-Identifier: MIT
// What a ServoEstimator tells: its values, how wide their intervals are, and whether they are trusted. Part of
// servo_estimator.hpp.
#pragma once

#include <ehsid/servo_estimator.hpp>

#include <cmath>

namespace ehsid {

template <class Scalar, int kMaxDelay>
TrackedServo<Scalar> ServoEstimator<Scalar, kMaxDelay>::servo() const {
  TrackedServo<Scalar> told;
  if (!filter_.started()) {
    return told;
  }
  const auto& state = filter_.state();
  // The share of the squared motion that neither the model nor the noise explains; where the disturbance is small, the
  // filter explains the rest by it. It widens every interval.
  const Scalar part = state.disturbance < Scalar(0.3) ? state.disturbance / Scalar(0.3) : Scalar(1);
  const Scalar structural = part * part;
  const bool enough = run_.windows() >= Scalar(2) && run_.log_ratio() != Scalar(0);
  const Scalar scatter = enough ? run_.variance() : Scalar(0);
  const Scalar unexplained = scatter * run_.windows() - Scalar(1.3) * run_.noise_share();
  const Scalar excess = enough && unexplained > Scalar(0) ? structural * unexplained : Scalar(0);
  // Innovations that are too large, or large and not white, widen what P says.
  const Scalar ratio = state.innovation_product / (state.innovation_square + Scalar(1e-9));
  const Scalar correlation = ratio < Scalar(0)      ? Scalar(0)
                             : ratio > Scalar(0.95) ? Scalar(0.95)
                                                    : ratio;
  const Scalar of_sums =
      state.innovation_square * (Scalar(1) + correlation) / (Scalar(1) - correlation);
  const Scalar wider = of_sums > Scalar(1) ? of_sums : Scalar(1);
  // K of the free runs counts as far as it differs from that of the filter by more than its scatter.
  const Scalar shift = enough ? run_.log_ratio() : Scalar(0);
  const Scalar doubt = Scalar(3) * scatter / (shift * shift + Scalar(1e-12));
  const Scalar weight = enough && doubt < Scalar(1) ? Scalar(1) - doubt : Scalar(0);
  const Scalar moved = weight * shift;
  const Scalar gain_variance = (Scalar(1) - weight) * wider * filter_.covariance(3, 3) +
                               weight * scatter + moved * moved / Scalar(4) +
                               Scalar(0.2025) * excess + structural * run_.gain_scatter();
  // Beyond half the sampling rate, omega_n dt > pi, the samples are those of a slower servo, too: neither omega_n nor xi is known.
  const Scalar aliased = state.rate > Scalar(3.14159265) ? Scalar(1) : Scalar(0);
  const Scalar dt = options_.dt_s;
  set(told.gain, sign_ * state.gain * bounded_exp(moved) / dt, gain_variance, Scalar(1));
  set(told.omega_n, state.rate / dt,
      wider * filter_.covariance(4, 4) + Scalar(6.25) * excess + aliased, Scalar(1.5));
  // xi is wanted to 0.15 at least.
  const Scalar xi_share = state.damping > Scalar(0.3) ? state.damping : Scalar(0.3);
  set(told.xi, state.damping, wider * filter_.covariance(5, 5) + Scalar(3.6) * excess + aliased,
      Scalar(1.5) / xi_share);
  if (sine_.sine()) {
    refuse(told.omega_n, TrustReason::single_sine);
    refuse(told.xi, TrustReason::single_sine);
  }
  return told;
}

template <class Scalar, int kMaxDelay>
void ServoEstimator<Scalar, kMaxDelay>::set(TrackedValue<Scalar>& to, Scalar value, Scalar variance,
                                            Scalar times) const {
  // Not beyond a factor of 1e3, nor without a number.
  const Scalar half = variance < Scalar(1e6) ? kHalfInterval * std::sqrt(variance) : Scalar(1e3);
  to.value = value;
  to.half_width = half * std::abs(value);
  if (phase_ == Phase::waiting || run_.windows() < Scalar(3.4)) {
    to.reason = TrustReason::starting;
  } else if (suspected_ || filter_.state().outliers > 1) {
    to.reason = TrustReason::change_suspected;
  } else if (half < times * options_.tolerance && run_.share() > Scalar(0.7)) {
    to.trusted = true;
    to.reason = TrustReason::trusted;
  } else if (resting_) {
    to.reason = TrustReason::resting;
  } else if (run_.share() <= Scalar(0.7)) {
    to.reason = TrustReason::model_does_not_fit;
  } else {
    to.reason = TrustReason::not_precise;
  }
}

template <class Scalar, int kMaxDelay>
void ServoEstimator<Scalar, kMaxDelay>::refuse(TrackedValue<Scalar>& value, TrustReason reason) {
  if (value.reason != TrustReason::starting) {
    value.trusted = false;
    value.reason = reason;
  }
}

template <class Scalar, int kMaxDelay>
template <class Real>
Status ServoEstimator<Scalar, kMaxDelay>::model(Vector<Real, 6>& theta,
                                                SquareMatrix<Real, 6>& covariance) const {
  const TrackedServo<Scalar> told = servo();
  if (!is_finite(told.gain.value)) {
    return Status::filling;
  }
  const ContinuousServo<Real> found{static_cast<Real>(told.gain.value),
                                    static_cast<Real>(told.omega_n.value),
                                    static_cast<Real>(told.xi.value)};
  Matrix<Real, 6, 3> jacobian;
  const Status status = discretise(found, static_cast<Real>(options_.dt_s), theta, &jacobian);
  if (is_error(status)) {
    return status;
  }
  // The deviations are those of servo(), their correlations those of the filter.
  const TrackedValue<Scalar>* const values[] = {&told.gain, &told.omega_n, &told.xi};
  SquareMatrix<Real, 3> parameters;
  for (int i = 0; i < 3; ++i) {
    const TrackedValue<Scalar>& value = *values[i];
    const Scalar scale = value.half_width / (kHalfInterval * std::abs(value.value) *
                                             std::sqrt(filter_.covariance(3 + i, 3 + i)));
    for (int row = 0; row < 6; ++row) {
      jacobian(row, i) *= static_cast<Real>(scale);
    }
    for (int j = 0; j < 3; ++j) {
      parameters(i, j) = static_cast<Real>(filter_.covariance(3 + i, 3 + j));
    }
  }
  for (int i = 0; i < 6; ++i) {
    Real weighted[3];
    for (int k = 0; k < 3; ++k) {
      weighted[k] = jacobian(i, 0) * parameters(0, k) + jacobian(i, 1) * parameters(1, k) +
                    jacobian(i, 2) * parameters(2, k);
    }
    for (int j = 0; j < 6; ++j) {
      covariance(i, j) = weighted[0] * jacobian(j, 0) + weighted[1] * jacobian(j, 1) +
                         weighted[2] * jacobian(j, 2);
    }
  }
  return Status::ok;
}

}  // namespace ehsid
