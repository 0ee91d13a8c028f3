// SPDX-License-Identifier: MIT
#include "servo_reference.h"

#include <ehsid/servo_estimator.hpp>

namespace {
ehsid::ServoEstimator<float> estimator;
}

void servo_reference_start(float dt_s) {
  ehsid::ServoEstimatorOptions<float> options;
  options.dt_s = dt_s;
  static_cast<void>(estimator.configure(options));
}

int servo_reference_step(float command, float position, servo_reference* told) {
  const int status = static_cast<int>(estimator.step(command, position));
  const auto servo = estimator.servo();
  *told = {servo.gain.value, servo.gain.half_width, servo.xi.value, servo.gain.trusted};
  return status;
}
