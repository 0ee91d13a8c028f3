// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/types.hpp>

#include <cmath>

namespace ehsid {

/// Settings of RmseReset. Windows in samples, ratios of RMSE, floor in units of the scaled output.
template <class Scalar>
struct RmseResetOptions {
  Scalar short_window = Scalar(10);    // >= 1
  Scalar long_window = Scalar(200);    // > short_window; also the samples before the first alarm
  Scalar trigger_ratio = Scalar(3);    // alarm above this ratio, > release_ratio
  Scalar release_ratio = Scalar(1.5);  // armed again below this ratio, >= 1
  std::int32_t cool_down = 50;         // samples after an alarm without another, >= 0
  Scalar floor = Scalar(1e-5);         // an RMSE below this is never a change of the plant, >= 0

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&RmseResetOptions::short_window);
    visit(&RmseResetOptions::long_window);
    visit(&RmseResetOptions::trigger_ratio);
    visit(&RmseResetOptions::release_ratio);
    visit(&RmseResetOptions::cool_down);
    visit(&RmseResetOptions::floor);
  }

  bool valid() const {
    return is_finite(short_window) && short_window >= Scalar(1) && is_finite(long_window) &&
           long_window > short_window && is_finite(trigger_ratio) && is_finite(release_ratio) &&
           release_ratio >= Scalar(1) && trigger_ratio > release_ratio && cool_down >= 0 &&
           is_finite(floor) && floor >= Scalar(0);
  }
};

/// What RmseReset remembers. Plain data.
template <class Scalar>
struct RmseResetState {
  Scalar short_square;   // mean square over the short window
  Scalar long_square;    // mean square over the long window
  std::int32_t seen;     // samples so far, up to the long window
  std::int32_t cooling;  // samples left in which no alarm is raised
  std::int32_t alarms;   // alarms since the start
  // 0 after an alarm until the ratio has fallen below release_ratio; 2 from suspect() to the next alarm
  std::uint8_t armed;

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&RmseResetState::short_square);
    visit(&RmseResetState::long_square);
    visit(&RmseResetState::seen);
    visit(&RmseResetState::cooling);
    visit(&RmseResetState::alarms);
    visit(&RmseResetState::armed);
  }
};

/// Detects a change of the plant from the RMSE of the prediction error (Fig. 4 of Ghazali et al. 2011): a
/// short window against a long one, with hysteresis and cool-down.
///
/// Feed it the normalised square epsilon^2 lambda / (lambda + phi' P phi), whose mean is sigma^2 whether or
/// not the estimate has converged: then neither the first samples nor those after a reset look like a
/// change. The windows are exponential: two numbers of memory instead of two buffers.
///
/// One square counts only so much, whatever its size. With the default windows it takes five large errors close together
/// to raise an alarm, and a single false position makes na + 1 = 4 of them. Where these few have moved theta by many of its
/// deviations, see suspect(), the alarm comes once they are over: a start in the middle of them would learn from them.
template <class Scalar>
class RmseReset {
 public:
  using Options = RmseResetOptions<Scalar>;
  using State = RmseResetState<Scalar>;
  /// What one square counts at most: in the short mean in trigger_ratio^2 times the long mean, in the long one in long
  /// means. Less there, so that the errors of a change do not become usual before they are seen.
  static constexpr Scalar kMostShort = Scalar(2.45);
  static constexpr Scalar kMostLong = Scalar(6);
  /// A policy that forgets this share in a step has 1 % left of what a glitch did after 2000 samples.
  static constexpr Scalar kForgets = Scalar(0.0023);
  static constexpr std::uint8_t kSuspecting = 2;  // of State::armed

  constexpr RmseReset() { restart(); }

  /// invalid_argument, and nothing changed, if an option is out of its range.
  Status configure(const Options& options) {
    if (!options.valid()) {
      return Status::invalid_argument;
    }
    options_ = options;
    restart();
    return Status::ok;
  }

  constexpr void restart() {
    state_ = State{};
    state_.armed = 1;
  }

  /// The same with the noise known beforehand (is_squarable(), >= 0; 0 for unknown): as if the long window were full of
  /// it, so that errors beyond it raise an alarm from the first sample on.
  void restart(Scalar noise_variance) {
    restart();
    if (noise_variance > Scalar(0)) {
      state_.short_square = noise_variance;
      state_.long_square = noise_variance;
      // Full is `seen >= long_window`; beyond a billion samples it is not worth an integer's overflow.
      state_.seen = static_cast<std::int32_t>(smaller(options_.long_window, Scalar(1e9))) + 1;
    }
  }

  /// An error has moved theta far, see WhitenessMonitor::moved_far().
  void suspect() { state_.armed = state_.armed == 1 ? kSuspecting : state_.armed; }

  /// One normalised squared prediction error (is_squarable(), >= 0). True: the plant has changed, or what a glitch did to
  /// theta stays, reset now. stays: does theta keep for long what it has learned so far?
  bool update(Scalar square, bool stays = false) {
    const Scalar before =
        state_.long_square;  // the alarm must not be hidden by the error that raises it
    const bool warm = static_cast<Scalar>(state_.seen) >= options_.long_window;
    state_.seen += warm || state_.seen == kLast ? 0 : 1;
    const auto count = static_cast<Scalar>(state_.seen);
    const Scalar reference = before + options_.floor * options_.floor;
    const Scalar trigger = options_.trigger_ratio * options_.trigger_ratio;
    const Scalar limit = trigger * reference;
    // The mean of fewer samples than the short window holds is no measure of what is usual.
    const bool known = count > options_.short_window;
    const Scalar in_short = known ? smaller(square, kMostShort * limit) : square;
    const Scalar in_long = known ? smaller(square, kMostLong * reference) : square;
    state_.short_square += (in_short - state_.short_square) / smaller(count, options_.short_window);
    state_.long_square += (in_long - state_.long_square) / smaller(count, options_.long_window);
    if (state_.cooling > 0) {
      --state_.cooling;
      return false;
    }
    const Scalar release = options_.release_ratio * options_.release_ratio;
    const bool usual = state_.short_square < release * reference;
    if (state_.armed == 0) {
      state_.armed = usual ? 1 : 0;
      return false;
    }
    const bool over = usual && stays && state_.armed == kSuspecting;
    if (!warm || !(over || state_.short_square > limit)) {
      return false;
    }
    // What was learned of the noise before the change stays; the errors of the change itself do not count.
    state_.short_square = before;
    state_.long_square = before;
    raise();
    return true;
  }

  /// An alarm, here or by the recursion itself.
  void raise() {
    state_.armed = 0;
    state_.cooling = options_.cool_down;
    state_.alarms += state_.alarms < kLast ? 1 : 0;
  }

  Scalar short_rmse() const { return std::sqrt(state_.short_square); }
  Scalar long_rmse() const { return std::sqrt(state_.long_square); }
  std::int32_t alarms() const { return state_.alarms; }

  const Options& options() const { return options_; }
  const State& state() const { return state_; }

  /// May this saved state be taken over?
  static bool usable(const State& saved) {
    return is_variance(saved.short_square) && is_variance(saved.long_square) && saved.seen >= 0 &&
           saved.cooling >= 0 && saved.alarms >= 0 && saved.armed <= kSuspecting;
  }

  /// Takes a saved state over; invalid_argument, and nothing changed, unless it is usable.
  Status restore(const State& saved) {
    if (!usable(saved)) {
      return Status::invalid_argument;
    }
    state_ = saved;
    return Status::ok;
  }

 private:
  static constexpr std::int32_t kLast = 0x7fffffff;  // where a count stops

  static Scalar smaller(Scalar a, Scalar b) { return a < b ? a : b; }

  Options options_{};
  State state_{};
};

}  // namespace ehsid
