// SPDX-License-Identifier: MIT
// Does the model run like the servo when it is left alone? In windows of 12 / omega_n the model runs on the command only,
// from the filter's state at their start, and its displacement D^ is compared with the measured one, D.
#pragma once

#include <ehsid/bounded_math.hpp>
#include <ehsid/servo_filter.hpp>

namespace ehsid {

/// Sums over the windows, with a memory of ten of them.
template <class Scalar>
class FreeRun {
 public:
  static constexpr Scalar kLength = Scalar(12);
  static constexpr std::int32_t kLeastLength = 8;
  static constexpr Scalar kKeep = Scalar(0.9);
  /// A window explains too little below this share of the motion.
  static constexpr Scalar kLeastShare = Scalar(0.6);

  /// Forgets all windows.
  void restart() { *this = FreeRun{}; }
  /// Ends the window that is open; the sums stay.
  void interrupt() { open_ = false; }

  /// Closes a window that is long enough, and opens the next one. position: the measured one, after the update of the filter,
  /// whose state is relative to it. slowest: longest window in samples. Returns true where a window was closed.
  EHSID_ONCE bool take(const ServoFilterState<Scalar>& state, Scalar position,
                       std::int32_t slowest) {
    bool closed = false;
    if (open_ && ++count_ >= length_) {
      close(state, position - start_);
      closed = true;
    }
    if (!open_) {
      const Scalar wanted = kLength / state.rate;
      length_ = wanted < static_cast<Scalar>(slowest) ? static_cast<std::int32_t>(wanted) : slowest;
      length_ = length_ < kLeastLength ? kLeastLength : length_;
      count_ = 0;
      position_ = state.position;
      velocity_ = state.velocity;
      acceleration_ = state.acceleration;
      start_ = position;
      open_ = true;
    }
    return closed;
  }

  /// The model goes on by one sample, while the command acts.
  EHSID_ONCE void predict(const ServoFilter<Scalar>& filter, Scalar command) {
    if (!open_) {
      return;
    }
    const auto& t = filter.transition();
    const Scalar error = velocity_ - filter.state().gain * (command - filter.state().bias);
    const Scalar a = acceleration_;
    position_ += velocity_ - t.s.value * error + t.i.value * a;
    velocity_ += t.e.value * a - t.w.value * error;
    acceleration_ = t.decay.value * a - t.pull.value * error;
  }

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&FreeRun::position_);
    visit(&FreeRun::velocity_);
    visit(&FreeRun::acceleration_);
    visit(&FreeRun::start_);
    visit(&FreeRun::windows_);
    visit(&FreeRun::measured_);
    visit(&FreeRun::product_);
    visit(&FreeRun::model_);
    visit(&FreeRun::noise_);
    visit(&FreeRun::weight_);
    visit(&FreeRun::gain_sum_);
    visit(&FreeRun::gain_squares_);
    visit(&FreeRun::first_gain_);
    visit(&FreeRun::length_);
    visit(&FreeRun::count_);
    visit(&FreeRun::failures_);
    visit(&FreeRun::since_);
    visit(&FreeRun::largest_);
    visit(&FreeRun::open_);
  }

  /// Whether a state that was read can be one of free runs.
  bool possible() const {
    return length_ >= 0 && length_ <= 1000000000 && count_ >= 0 && count_ <= length_ &&
           failures_ >= 0 && failures_ < 1000000000 && since_ >= 0 && since_ < 10 &&
           windows_ >= Scalar(0) && weight_ >= Scalar(0) && first_gain_ >= Scalar(0);
  }

  /// Effective number of windows, at most ten.
  Scalar windows() const { return windows_; }
  /// Share of the motion that the model explains; 0 before the first window.
  Scalar share() const {
    return measured_ > Scalar(0)
               ? Scalar(1) - (measured_ - Scalar(2) * product_ + model_) / measured_
               : Scalar(0);
  }
  /// ln of the gain over that of the filter which the windows show, sum D D^ / sum D^^2, and its variance by their scatter.
  Scalar log_ratio() const {
    return product_ > Scalar(0) ? bounded_log(product_ / model_) : Scalar(0);
  }
  Scalar variance() const {
    if (!(product_ > Scalar(0)) || !(windows_ > Scalar(0))) {
      return Scalar(1);
    }
    const Scalar scatter = (measured_ / product_) * (model_ / product_) - Scalar(1);
    return scatter > Scalar(0) ? scatter / windows_ : Scalar(0);
  }
  /// Share of the squared motion that the noise of the sensor makes.
  Scalar noise_share() const { return measured_ > Scalar(0) ? noise_ / measured_ : Scalar(0); }
  /// Variance of the filter's ln K over the windows.
  Scalar gain_scatter() const {
    if (!(weight_ > Scalar(1))) {
      return Scalar(0);
    }
    const Scalar mean = gain_sum_ / weight_;
    const Scalar found = gain_squares_ / weight_ - mean * mean;
    return found > Scalar(0) ? found : Scalar(0);
  }
  /// How many windows in a row explained too little; one that explains nothing of a lost filter counts fivefold.
  std::int32_t failures() const { return failures_; }

 private:
  EHSID_RARE void close(const ServoFilterState<Scalar>& state, Scalar measured) {
    if (!(weight_ > Scalar(0))) {
      first_gain_ = state.gain;
    }
    const Scalar gain = bounded_log(state.gain / first_gain_);
    // Ten windows with far less motion than the sums remember: what was, was not of this servo.
    const Scalar square = measured * measured + position_ * position_;
    largest_ = square > largest_ ? square : largest_;
    if (++since_ >= 10) {
      if (measured_ + model_ > Scalar(1e10) * largest_) {
        windows_ = measured_ = product_ = model_ = noise_ = Scalar(0);
      }
      largest_ = Scalar(0);
      since_ = 0;
    }
    constexpr Scalar kKeepGain = Scalar(0.85);
    weight_ = kKeepGain * weight_ + Scalar(1);
    gain_sum_ = kKeepGain * gain_sum_ + gain;
    gain_squares_ = kKeepGain * gain_squares_ + gain * gain;
    windows_ = kKeep * windows_ + Scalar(1);
    measured_ = kKeep * measured_ + measured * measured;
    product_ = kKeep * product_ + measured * position_;
    model_ = kKeep * model_ + position_ * position_;
    noise_ = kKeep * noise_ + Scalar(2) * state.noise;
    // Nothing is explained by a filter for which all is disturbance, or all is noise, or whose servo swings by itself: what
    // a loop does again and again can be taken for that. Only of a small motion that is explained well, and not by the
    // disturbance, the noise may be more than a tenth.
    const bool disturbed = state.disturbance > Scalar(0.9);
    const bool explained = share() >= kLeastShare && !disturbed;
    const bool lost = (disturbed && share() < Scalar(0)) ||
                      noise_ > (explained ? Scalar(1) : Scalar(0.1)) * measured_ ||
                      (disturbed && state.damping < Scalar(0.02));
    failures_ = lost ? failures_ + 5 : share() < kLeastShare ? failures_ + 1 : 0;
    open_ = false;
  }

  Scalar position_ = Scalar(0);
  Scalar velocity_ = Scalar(0);
  Scalar acceleration_ = Scalar(0);
  Scalar start_ = Scalar(0);
  Scalar windows_ = Scalar(0);
  Scalar measured_ = Scalar(0);
  Scalar product_ = Scalar(0);
  Scalar model_ = Scalar(0);
  Scalar noise_ = Scalar(0);
  Scalar weight_ = Scalar(0);
  Scalar gain_sum_ = Scalar(0);
  Scalar gain_squares_ = Scalar(0);
  Scalar first_gain_ = Scalar(0);
  std::int32_t length_ = 0;
  std::int32_t count_ = 0;
  std::int32_t failures_ = 0;
  std::int32_t since_ = 0;
  Scalar largest_ = Scalar(0);
  bool open_ = false;
};

}  // namespace ehsid
