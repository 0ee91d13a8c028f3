// SPDX-License-Identifier: MIT
#include "control_loop.hpp"

#include <limits>

#include "velocity_gain.hpp"

namespace servo {

ehsid_status ControlLoop::configure(Configuration& configuration) {
  ehsid_configuration& wanted = configuration.estimator;
  wanted.seed = configuration.has_seed ? &configuration.seed : nullptr;
  const ehsid_status status =
      configuration.tracks_servo
          ? ehsid_servo_init(&servo_, storage_, sizeof storage_, &configuration.servo)
          : ehsid_init(&estimator_, storage_, sizeof storage_, &wanted);
  if (status != EHSID_OK) {
    return status;
  }
  if (configuration.tracks_servo) {
    estimator_ = nullptr;
  } else {
    servo_ = nullptr;
  }
  controller_.configure(configuration.controller);
  na_ = static_cast<std::size_t>(wanted.na);
  nb_ = static_cast<std::size_t>(wanted.nb);
  sample_time_s_ = configuration.controller.sample_time_s;
  trusted_velocity_gain_ = 0.0F;
  return status;
}

void ControlLoop::start() {
  forget_samples();
  fall_back();
}

void ControlLoop::forget_samples() {
  // A sample that is not finite is refused, leaves the estimate alone and empties the history: c_api.h.
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  static_cast<void>(tracks_servo() ? ehsid_servo_step(servo_, kNone, kNone)
                                   : ehsid_step(estimator_, kNone, kNone));
}

void ControlLoop::fall_back() {
  controller_.fall_back();
  trusted_velocity_gain_ = 0.0F;
}

Result ControlLoop::sample(const Sample& now) {
  Result result{};
  controller_.retune(trusted_velocity_gain_);
  result.command = controller_.command(now);
  result.gain_v_m = controller_.gain();
  result.gain_from_estimate = controller_.gain_from_estimate();

  if (tracks_servo()) {
    step_servo(result.command.volts, now.position_m, result);
  } else {
    step_arx(result.command.volts, now.position_m, result);
  }
  return result;
}

void ControlLoop::step_arx(float volts, float position_m, Result& result) {
  result.status = ehsid_step(estimator_, volts, position_m);
  // These cannot refuse: there is an estimator, of no more than kMaxParameters.
  static_cast<void>(ehsid_read(estimator_, &result.report));
  static_cast<void>(ehsid_theta(estimator_, result.theta, kMaxParameters));
  result.parameters = ehsid_parameters(estimator_);
  result.velocity_gain_m_s_v = velocity_gain(result.theta, na_, nb_, sample_time_s_);

  const bool trusted = result.report.settled && !ehsid_is_error(result.status);
  trusted_velocity_gain_ = trusted ? result.velocity_gain_m_s_v : 0.0F;
}

void ControlLoop::step_servo(float volts, float position_m, Result& result) {
  result.status = ehsid_servo_step(servo_, volts, position_m);
  static_cast<void>(ehsid_servo_read(servo_, &result.servo));  // cannot refuse: there is one
  const ehsid_tracked_value& gain = result.servo.gain;
  // Where a positive command retracts, K is negative, and the controller keeps its fixed gain.
  trusted_velocity_gain_ = gain.trusted && !ehsid_is_error(result.status) ? gain.value : 0.0F;
}

}  // namespace servo
