// SPDX-License-Identifier: MIT
// How a ServoEstimator begins, and begins anew: it waits for a motion, lets its starts compete, and puts the winner in
// charge. Part of servo_estimator.hpp.
#pragma once

#include <ehsid/servo_estimator.hpp>

#include <cmath>

namespace ehsid {

template <class Scalar, int kMaxDelay>
void ServoEstimator<Scalar, kMaxDelay>::begin_anew() {
  phase_ = Phase::waiting;
  run_.restart();
  waited_ = 0;
  averaged_ = 0;
  peak_ = Scalar(0);
  peak_samples_ = 0;
  thirds_ = paths_ = pulls_ = pushed_ = together_ = Scalar(0);
  last_[0] = last_[1] = before_;
  low_ = high_ = before_;
  resting_ = false;
  known_ = false;
  placed_ = false;
  fitted_ = false;
  suspected_ = false;
  settling_ = 0;
  cooling_ = 0;
}

/// Everything begins anew; servo() tells the old values, not trusted, until there are new ones.
template <class Scalar, int kMaxDelay>
Status ServoEstimator<Scalar, kMaxDelay>::again() {
  resets_ += resets_ < kMostSamples ? 1 : 0;
  begin_anew();
  return Status::reset;
}

/// A filter whose numbers are not finite has nothing to tell.
template <class Scalar, int kMaxDelay>
Status ServoEstimator<Scalar, kMaxDelay>::lost() {
  filter_ = {};
  return again();
}

/// Before the first motion: the noise of the sensor, the gain to within a factor, its sign.
template <class Scalar, int kMaxDelay>
void ServoEstimator<Scalar, kMaxDelay>::wait(Scalar position) {
  const Scalar third = position - Scalar(3) * before_ + Scalar(3) * last_[0] - last_[1];
  const Scalar path = position - before_;
  last_[1] = last_[0];
  last_[0] = before_;
  if (++waited_ <= 3) {
    low_ = high_ = reference_ = position;
    return;
  }
  thirds_ += third * third;
  paths_ += std::abs(path);
  pulls_ += std::abs(command_at(options_.delay));
  // K has the sign of sum X U, where X and U are the way and the commands with the same short memory. Slow motion prevails in
  // it, which follows the command; that of a servo that rings or is late may be against the command of now.
  const std::int32_t wanted = samples_of(Scalar(0.3), 40);
  const std::int32_t enough = wanted < 400 ? wanted : 400;
  const Scalar forgotten = Scalar(6) / static_cast<Scalar>(enough);
  reference_ += forgotten * (position - reference_);
  together_ += (position - reference_) * pushed_;
  pushed_ += command_at(options_.delay) - forgotten * pushed_;
  low_ = position < low_ ? position : low_;
  high_ = position > high_ ? position : high_;
  const auto count = static_cast<Scalar>(waited_ - 3);
  const Scalar noise = thirds_ / (Scalar(20) * count);
  const bool moves =
      high_ - low_ > Scalar(10) * std::sqrt(noise) && pulls_ > Scalar(0) && paths_ > Scalar(0);
  if (waited_ - 3 < enough) {
    return;
  }
  if (!moves) {
    if (waited_ > 4 * wanted) {  // what was long ago says nothing of the noise of now
      waited_ = 3;
      low_ = high_ = reference_ = position;
      thirds_ = paths_ = pulls_ = pushed_ = together_ = Scalar(0);
    }
    return;
  }
  const Scalar mean_path = paths_ / count;
  least_noise_ = Scalar(1e-6) * mean_path * mean_path;
  least_noise_ = least_noise_ > Scalar(1e-30) ? least_noise_ : Scalar(1e-30);
  sign_ = together_ < Scalar(0) ? Scalar(-1) : Scalar(1);
  starts_.start(Scalar(0.7) * paths_ / pulls_, Scalar(1), command_square_,
                noise > least_noise_ ? noise : least_noise_);
  filter_ = starts_[Starts::kRates / 2];
  delay_ = options_.delay;
  reference_ = position;
  leader_ = -1;
  phase_ = Phase::starting;
}

/// Every start takes the sample; the most likely one is in charge, and wins once it leads clearly.
template <class Scalar, int kMaxDelay>
Status ServoEstimator<Scalar, kMaxDelay>::start(Scalar position) {
  const Scalar measured = sign_ * (position - reference_);
  if (rest_.resting() && starts_.samples() > 10) {
    starts_.settle(measured, command_square_);
    shift(measured, position);
    return Status::no_information;
  }
  typename Filter::Tuning with = tuning();
  with.adaptation = adaptation(starts_.samples());
  starts_.update(measured, with);
  shift(measured, position);
  const int best = starts_.most_likely();
  if (best != leader_) {
    run_.restart();
  }
  leader_ = best;
  filter_ = starts_[best];
  delay_ = options_.delay + (Starts::is_late(best) ? 1 : 0);
  if (!filter_.finite()) {
    return lost();
  }
  const std::int32_t samples = starts_.samples();
  if (samples >= 40) {
    static_cast<void>(run_.take(filter_.state(), sign_ * position, samples_of(Scalar(2), 8)));
  }
  const std::int32_t least = samples_of(Scalar(1.5), 150);
  const std::int32_t most = samples_of(Scalar(9), 150);
  // A motion that fades shows omega_n and K long before a step shows the delay, and a filter of the wrong delay loses its
  // servo at that step. A start that hostile samples have spoilt is not to wait for it.
  const bool delay_asked = samples < samples_of(Scalar(4), 150);
  if (samples >= most || (samples >= least && starts_.leads(best, delay_asked))) {
    take_charge(best);
  }
  return Status::ok;
}

/// The winner goes on alone, with the spread of the others as uncertainty. A filter that is linearised anew at each sample
/// takes itself for too certain (G. Huang, A. Mourikis, S. Roumeliotis, IJRR 29 (2010) 502): it gets some more.
template <class Scalar, int kMaxDelay>
void ServoEstimator<Scalar, kMaxDelay>::take_charge(int best) {
  const std::array<Scalar, 3> spread = starts_.spread(best);
  const Scalar more[] = {Scalar(0.03), Scalar(0.05), Scalar(0.1)};
  for (int i = 0; i < 3; ++i) {
    filter_.covariance(3 + i, 3 + i) += spread[static_cast<std::size_t>(i)] + more[i] * more[i];
  }
  phase_ = Phase::tracking;
  tracked_ = 0;
  leader_ = 0;
  keep();
  keep();
}

}  // namespace ehsid
