// SPDX-License-Identifier: MIT
// Position controller: proportional, with velocity feed-forward, and a gain that may follow the estimated plant.
#pragma once

#include <cmath>
#include <initializer_list>

namespace servo {

/// Ranges: all finite; sample_time_s, command_limit_v > 0; 0 <= gain_min <= fixed gain <= gain_max;
/// bandwidth, gain_step >= 0; any feed_forward.
struct ControllerSettings {
  float sample_time_s;
  float fixed_gain_v_m;
  float feed_forward_v_s_m;
  float command_limit_v;
  float bandwidth_rad_s;  // wanted of the closed loop: gain * velocity gain
  float gain_min_v_m;
  float gain_max_v_m;
  float gain_step;        // largest change of the gain a sample, share of the fixed gain
  bool position_control;  // else the command is direct_v
  bool follow_estimate;   // else the gain is the fixed one

  bool valid() const {
    for (const float value : {sample_time_s, fixed_gain_v_m, feed_forward_v_s_m, command_limit_v,
                              bandwidth_rad_s, gain_min_v_m, gain_max_v_m, gain_step}) {
      if (!std::isfinite(value)) {
        return false;
      }
    }
    return sample_time_s > 0.0F && command_limit_v > 0.0F && bandwidth_rad_s >= 0.0F &&
           gain_step >= 0.0F && gain_min_v_m >= 0.0F && gain_min_v_m <= fixed_gain_v_m &&
           fixed_gain_v_m <= gain_max_v_m;
  }
};

/// What was measured and is wanted at t_k.
struct Sample {
  float position_m;
  float reference_m;
  float reference_velocity_m_s;
  float direct_v;
};

struct Command {
  float volts;
  bool at_limit;
};

class Controller {
 public:
  /// The settings must be valid.
  void configure(const ControllerSettings& settings) {
    settings_ = settings;
    fall_back();
  }

  /// To the fixed gain, and at once: a gain that nobody vouches for any more must not act for another sample. The
  /// command may jump, within its limit; by steps it would not, but the loop might be unstable meanwhile.
  void fall_back() {
    gain_ = settings_.fixed_gain_v_m;
    from_estimate_ = false;
  }

  /// Before command(): velocity_gain of the estimate that is trusted, m/(s V); 0 where none is.
  void retune(float velocity_gain) {
    if (!settings_.follow_estimate || !(velocity_gain > 0.0F)) {
      fall_back();
      return;
    }
    // With a velocity gain K and a gain g the closed loop has the bandwidth g K.
    const float wanted = clipped(settings_.bandwidth_rad_s / velocity_gain, settings_.gain_min_v_m,
                                 settings_.gain_max_v_m);
    const float step = settings_.gain_step * settings_.fixed_gain_v_m;
    gain_ = clipped(wanted, gain_ - step, gain_ + step);
    from_estimate_ = true;
  }

  /// u(k). With any number that is not finite: 0, and back to the fixed gain.
  Command command(const Sample& s) {
    float volts = s.direct_v;
    if (settings_.position_control) {
      volts += gain_ * (s.reference_m - s.position_m) +
               settings_.feed_forward_v_s_m * s.reference_velocity_m_s;
    }
    // In direct mode too: a host that sends NaN does not know what it does.
    const bool sane = std::isfinite(s.position_m) && std::isfinite(s.reference_m) &&
                      std::isfinite(s.reference_velocity_m_s) && std::isfinite(volts);
    if (!sane) {
      fall_back();
      return {0.0F, false};
    }
    const float limit = settings_.command_limit_v;
    volts = clipped(volts, -limit, limit);
    return {volts, volts == limit || volts == -limit};
  }

  float gain() const { return gain_; }
  bool gain_from_estimate() const { return from_estimate_; }

 private:
  static float clipped(float value, float low, float high) {
    return value < low ? low : value > high ? high : value;
  }

  ControllerSettings settings_{};
  float gain_ = 0.0F;
  bool from_estimate_ = false;
};

}  // namespace servo
