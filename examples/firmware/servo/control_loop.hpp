// SPDX-License-Identifier: MIT
// What happens at a sample: command, then estimate. Knows nothing of the line, so that a board with a valve and a
// sensor of its own calls it in the same way.
#pragma once

#include "configuration.hpp"

namespace servo {

struct Result {
  Command command;
  float gain_v_m;  // that the command was made with
  bool gain_from_estimate;
  ehsid_status status;
  ehsid_tracked_servo servo;  // of a ServoEstimator; what follows is of the other estimators
  float velocity_gain_m_s_v;  // of the estimate after this sample; 0 where it gives none
  ehsid_report report;
  std::size_t parameters;
  float theta[kMaxParameters];
};

class ControlLoop {
 public:
  /// A new estimator and controller. Anything but EHSID_OK: those of before go on.
  ehsid_status configure(Configuration& configuration);

  /// Before a first sample: forgets the samples of before, and goes to the fixed gain.
  void start();

  /// Before a sample whose neighbour is missing. The estimate is kept; the samples before are not those of t_{k-1}, so
  /// the history of the estimator fills anew.
  void forget_samples();

  /// To the fixed gain. The estimate is kept.
  void fall_back();

  /// Whether the estimator is a ServoEstimator.
  bool tracks_servo() const { return servo_ != nullptr; }

  /// u(k) from y(k) and the estimate of t_{k-1}; then (u(k), y(k)) into the estimator.
  Result sample(const Sample& now);

 private:
  void step_arx(float volts, float position_m, Result& result);
  void step_servo(float volts, float position_m, Result& result);

  // One estimator at a time; its pointer is the one that is not null.
  static_assert(EHSID_STORAGE_WORDS(kMaxParameters) <= EHSID_SERVO_STORAGE_WORDS);
  std::uint64_t storage_[EHSID_SERVO_STORAGE_WORDS] = {};
  ehsid_estimator* estimator_ = nullptr;
  ehsid_servo_estimator* servo_ = nullptr;
  Controller controller_;
  std::size_t na_ = 0;
  std::size_t nb_ = 0;
  float sample_time_s_ = 0.0F;
  float trusted_velocity_gain_ = 0.0F;  // of t_{k-1}; 0 where the estimate is not to be trusted
};

}  // namespace servo
