// SPDX-License-Identifier: MIT
// A sample of a ServoEstimator once one filter is in charge: rest, update, a change of the plant, a command that is one
// sine, free runs; and what the next command does in every phase. Part of servo_estimator.hpp.
#pragma once

#include <ehsid/servo_estimator.hpp>

#include <cmath>

namespace ehsid {

template <class Scalar, int kMaxDelay>
Status ServoEstimator<Scalar, kMaxDelay>::track(Scalar position) {
  const Scalar measured = sign_ * (position - reference_);
  tracked_ += tracked_ < kMostSamples ? 1 : 0;
  if (resting_) {
    return rest(position);
  }
  if (sine_.sine() && !known_ && !placed_) {
    place();
  }
  if (placed_ && sine_.clearly_none()) {
    return seek(position);
  }
  const bool hold = sine_.sine() || placed_;
  typename Filter::Tuning with = tuning();
  if (settling_ == 0) {
    with.adaptation = adaptation(filter_.state().samples);
  }
  with.hold_servo = hold;
  const Scalar rate = filter_.state().rate;
  const Scalar damping = filter_.state().damping;
  filter_.update(measured, with);
  if (!filter_.finite()) {
    return lost();
  }
  // The coefficients follow the parameters where these have moved, and at times in any case.
  if (std::abs(filter_.state().rate - rate) + std::abs(filter_.state().damping - damping) * rate >
          Scalar(1e-3) * rate ||
      filter_.state().samples % 8 == 0) {
    filter_.renew();
  }
  settling_ -= settling_ > 0 ? 1 : 0;
  suspected_ = suspected_ && settling_ > 0;
  cooling_ -= cooling_ > 0 ? 1 : 0;
  if (filter_.state().outliers >= Filter::kPatience && cooling_ == 0 && settling_ == 0 &&
      filter_.state().disturbance < Scalar(0.3)) {
    widen(hold);
  }
  fitted_ = fitted_ || filter_.state().disturbance < kFitted;
  shift(measured, position);
  if (rest_.begins_after_motion()) {
    // A filter that needed no disturbance and now needs much has lost a servo that changed: the starts find it sooner. But a
    // servo that stands still may be held, and will be the same.
    if (fitted_ && filter_.state().disturbance > kLost) {
      return again();
    }
    if (cooling_ == 0) {  // what was taken for a change may be a stop
      keep();
    }
  }
  if (rest_.resting()) {
    resting_ = true;
    rest_position_ = position;
    forget_the_stop(position);
    filter_.settle(Scalar(0), command_square_);
    reference_ = position;
    run_.interrupt();
    return Status::ok;
  }
  // A window that ends with an outlier ends with the next good sample.
  const bool good = filter_.state().outliers == 0 || filter_.state().outliers >= Filter::kPatience;
  if (good && run_.take(filter_.state(), sign_ * position, samples_of(Scalar(2), 8)) &&
      run_.failures() >= 12 && tracked_ >= samples_of(Scalar(2.5), 450)) {
    return again();
  }
  return Status::ok;
}

/// What the filter is now, for forget_the_stop(), beside what it was when this was called last.
template <class Scalar, int kMaxDelay>
void ServoEstimator<Scalar, kMaxDelay>::keep() {
  leader_ = 1 - leader_;
  starts_.kept(leader_) = filter_.state();
}

/// A servo that is held, or that sticks, although a command acts teaches a gain of zero until two calm blocks show that it
/// rests. Then the filter is again what it was when the block began in which the motion ended.
template <class Scalar, int kMaxDelay>
void ServoEstimator<Scalar, kMaxDelay>::forget_the_stop(Scalar position) {
  const auto& before = starts_.kept(1 - leader_);
  const Scalar path = before.gain * std::abs(command_at(delay_ - 1) - before.bias) *
                      static_cast<Scalar>(rest_.samples());
  if (path > rest_.threshold(position)) {
    filter_.state() = before;
    filter_.renew();
    suspected_ = false;
  }
}

/// While the servo stands still the parameters wait, and may drift. A movement beyond the noise ends it.
template <class Scalar, int kMaxDelay>
Status ServoEstimator<Scalar, kMaxDelay>::rest(Scalar position) {
  const Scalar noise = std::sqrt(filter_.state().noise);
  const Scalar quiet = rest_.threshold(position);
  // R of a filter that was led astray may be far beyond the noise of now.
  const Scalar most =
      Scalar(8) * noise < Scalar(100) * quiet ? Scalar(8) * noise : Scalar(100) * quiet;
  const Scalar wide = most > quiet ? most : quiet;
  if (std::abs(position - rest_position_) <= wide) {
    rest_position_ += Scalar(0.01) * (position - rest_position_);
    filter_.let_drift(tuning());
    filter_.state().position = Scalar(0);
    reference_ = position;
    return Status::no_information;
  }
  resting_ = false;
  rest_.moved();
  reference_ = position;
  reopen(Scalar(0));
  keep();
  return Status::ok;
}

/// Four innovations in a row beyond four deviations: the plant has changed, and neither noise is to blame for a while.
template <class Scalar, int kMaxDelay>
void ServoEstimator<Scalar, kMaxDelay>::widen(bool hold) {
  constexpr Scalar kWider = Scalar(0.04);
  filter_.covariance(3, 3) += kWider;
  if (!hold) {
    filter_.covariance(4, 4) += kWider / Scalar(4);
    filter_.covariance(5, 5) += kWider;
  }
  settling_ = static_cast<std::int32_t>(Scalar(8) / filter_.state().rate) + 1;
  suspected_ = true;
  cooling_ = static_cast<std::int32_t>(Scalar(20) / filter_.state().rate) + 1;
}

/// One sine shows size and phase of the response, and every servo on that curve fits. Where nothing else has been seen, the
/// filter is moved along the curve to xi = 0.45, and K gets the uncertainty of that choice.
template <class Scalar, int kMaxDelay>
void ServoEstimator<Scalar, kMaxDelay>::place() {
  constexpr Scalar kDamping = Scalar(0.45);
  auto& state = filter_.state();
  const Scalar angle2 = sine_.squared_angle();
  const Scalar ratio2 = angle2 / (state.rate * state.rate);
  const Scalar real = Scalar(1) - ratio2;
  const Scalar imaginary2 = Scalar(4) * state.damping * state.damping * ratio2;
  const Scalar size2 = Scalar(1) / (real * real + imaginary2);
  const Scalar positive = real > Scalar(0.05) ? real : Scalar(0.05);
  Scalar tangent = std::sqrt(imaginary2) / positive;
  tangent = (tangent < Scalar(2) ? tangent : Scalar(2)) + Scalar(1e-6);
  // tangent = 2 xi r / (1 - r^2)
  const Scalar r = (std::sqrt(kDamping * kDamping + tangent * tangent) - kDamping) / tangent;
  const Scalar r2 = r * r > Scalar(1e-4) ? r * r : Scalar(1e-4);
  const Scalar new_size2 =
      (Scalar(1) - r2) * (Scalar(1) - r2) + Scalar(4) * kDamping * kDamping * r2;
  state.gain *= std::sqrt(size2 * new_size2);
  state.damping = kDamping;
  const Scalar rate = std::sqrt(angle2 / r2);
  state.rate = rate < Scalar(0.01) ? Scalar(0.01) : rate > Scalar(3) ? Scalar(3) : rate;
  filter_.renew();
  for (int i = 3; i < 6; ++i) {
    for (int j = 0; j < Filter::kStates; ++j) {
      filter_.covariance(i, j) = Scalar(0);
    }
  }
  const Scalar deviation = Scalar(2.5) * r2 + Scalar(0.02);
  filter_.covariance(3, 3) = deviation * deviation;
  filter_.covariance(4, 4) = Scalar(0.25);
  filter_.covariance(5, 5) = Scalar(0.25);
  placed_ = true;
  keep();
  keep();
  run_.restart();
}

/// The sine that did not show omega_n and xi has ended. One filter, linearised about the place that was chosen for it, may
/// never find them: the starts look for them, and keep K.
template <class Scalar, int kMaxDelay>
Status ServoEstimator<Scalar, kMaxDelay>::seek(Scalar position) {
  const Scalar deviation = std::sqrt(filter_.covariance(3, 3)) + Scalar(0.1);
  starts_.start(filter_.state().gain, deviation, command_square_, filter_.state().noise);
  filter_ = starts_[Starts::kRates / 2];
  delay_ = options_.delay;
  reference_ = position;
  leader_ = -1;
  phase_ = Phase::starting;
  placed_ = false;
  fitted_ = false;
  suspected_ = false;
  return start(position);
}

/// The states of motion are open again: behind a hole, or as the servo begins to move.
template <class Scalar, int kMaxDelay>
void ServoEstimator<Scalar, kMaxDelay>::reopen(Scalar position) {
  const Scalar shifted = command_at(delay_) - filter_.state().bias;
  const Scalar square = shifted * shifted > command_square_ ? shifted * shifted : command_square_;
  filter_.settle(position, square);
  if (phase_ == Phase::starting) {
    starts_.settle(position, square);
  }
  run_.interrupt();
  settling_ = 12;
  suspected_ = false;
}

/// The reference of the position follows the measured one, so that float32 loses no digits far from zero; not an outlier.
template <class Scalar, int kMaxDelay>
void ServoEstimator<Scalar, kMaxDelay>::shift(Scalar measured, Scalar position) {
  if (phase_ == Phase::starting) {
    starts_.shift(measured);
    reference_ = position;
  } else if (filter_.state().outliers == 0 || filter_.state().outliers >= Filter::kPatience) {
    filter_.state().position -= measured;
    reference_ = position;
  }
}

/// The command that acts until the next sample, and what it says of itself.
template <class Scalar, int kMaxDelay>
void ServoEstimator<Scalar, kMaxDelay>::move_on(Scalar command) {
  Scalar newer = command;
  for (Scalar& kept : commands_) {
    const Scalar older = kept;
    kept = newer;
    newer = older;
  }
  if (!resting_) {
    averaged_ += averaged_ < kMostSamples ? 1 : 0;
    const Scalar step = Scalar(1) / static_cast<Scalar>(averaged_);
    const Scalar least = options_.dt_s / Scalar(2);
    const Scalar share = step > least ? step : least < Scalar(1) ? least : Scalar(1);
    command_square_ += share * (command * command - command_square_);
    // A mean that remembers commands far beyond those of the last 400 samples is theirs.
    peak_ = command * command > peak_ ? command * command : peak_;
    if (++peak_samples_ >= 400) {
      if (peak_ > Scalar(0) && command_square_ > Scalar(1e3) * peak_) {
        command_square_ = peak_;
      }
      peak_ = Scalar(0);
      peak_samples_ = 0;
    }
  }
  if (phase_ == Phase::waiting) {
    return;
  }
  const Scalar apart = Scalar(1) / filter_.state().rate + Scalar(0.5);
  const auto spacing = static_cast<std::int32_t>(apart > Scalar(1) ? apart : Scalar(1));
  sine_.take(command, spacing, options_.dt_s * Scalar(0.2));
  if (sine_.clearly_none() && sine_.samples_not_sine() > samples_of(Scalar(5), 1) &&
      phase_ == Phase::tracking && run_.windows() > Scalar(4) &&
      kHalfInterval * std::sqrt(filter_.covariance(4, 4)) < Scalar(1.5) * options_.tolerance) {
    known_ = true;
  }
  const typename Filter::Tuning with = tuning();
  if (phase_ == Phase::starting) {
    starts_.predict(command_at(options_.delay - 1), command_at(options_.delay), with);
    run_.predict(filter_, command_at(delay_ - 1));
  } else if (!resting_) {
    run_.predict(filter_, command_at(delay_ - 1));
    filter_.predict(command_at(delay_ - 1), with);
  }
}

/// What a filter is told while neither noise is adapted.
template <class Scalar, int kMaxDelay>
typename ServoEstimator<Scalar, kMaxDelay>::Filter::Tuning
ServoEstimator<Scalar, kMaxDelay>::tuning() const {
  return {options_.drift * options_.drift * options_.dt_s, command_square_, least_noise_, Scalar(0),
          false};
}

/// Step of the noise: the larger of 1 / (k + 60) and 0.3 / (1 s or 200 samples), at most 0.01; twice as fast and without
/// that limit while the starts compete, whose likelihoods mean little before the noise is right.
template <class Scalar, int kMaxDelay>
Scalar ServoEstimator<Scalar, kMaxDelay>::adaptation(std::int32_t samples) const {
  const bool starting = phase_ == Phase::starting;
  const Scalar slow = Scalar(0.3) / static_cast<Scalar>(samples_of(Scalar(1), 200));
  const Scalar fast = Scalar(starting ? 2 : 1) / (static_cast<Scalar>(samples) + Scalar(60));
  const Scalar step = fast > slow ? fast : slow;
  const Scalar most = starting ? Scalar(1) : Scalar(0.01);
  return step < most ? step : most;
}

/// A time in samples, at least `least`.
template <class Scalar, int kMaxDelay>
std::int32_t ServoEstimator<Scalar, kMaxDelay>::samples_of(Scalar seconds,
                                                           std::int32_t least) const {
  const Scalar samples = seconds * per_second_;
  const Scalar most = Scalar(1e9);
  const auto found = static_cast<std::int32_t>(samples < most ? samples : most);
  return found > least ? found : least;
}

}  // namespace ehsid
