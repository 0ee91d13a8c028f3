// SPDX-License-Identifier: MIT
#include "control_loop.hpp"

#include <limits>

#include "velocity_gain.hpp"

namespace servo {

ehsid_status ControlLoop::configure(Configuration& configuration) {
  ehsid_configuration& wanted = configuration.estimator;
  wanted.seed = configuration.has_seed ? &configuration.seed : nullptr;
  const ehsid_status status = ehsid_init(&estimator_, storage_, sizeof storage_, &wanted);
  if (status != EHSID_OK) {
    return status;
  }
  controller_.configure(configuration.controller);
  na_ = static_cast<std::size_t>(wanted.na);
  nb_ = static_cast<std::size_t>(wanted.nb);
  sample_time_s_ = configuration.controller.sample_time_s;
  trusted_velocity_gain_ = 0.0F;
  return status;
}

void ControlLoop::start() {
  // A sample that is not finite is refused, leaves the estimate alone and empties the history: c_api.h.
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  static_cast<void>(ehsid_step(estimator_, kNone, kNone));
  fall_back();
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

  result.status = ehsid_step(estimator_, result.command.volts, now.position_m);
  // These cannot refuse: there is an estimator, of no more than kMaxParameters.
  static_cast<void>(ehsid_read(estimator_, &result.report));
  static_cast<void>(ehsid_theta(estimator_, result.theta, kMaxParameters));
  result.parameters = ehsid_parameters(estimator_);
  result.velocity_gain_m_s_v = velocity_gain(result.theta, na_, nb_, sample_time_s_);

  const bool trusted = result.report.settled && !ehsid_is_error(result.status);
  trusted_velocity_gain_ = trusted ? result.velocity_gain_m_s_v : 0.0F;
  return result;
}

}  // namespace servo
