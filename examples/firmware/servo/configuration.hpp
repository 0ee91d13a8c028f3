// SPDX-License-Identifier: MIT
// What the requests `configure` and `configure_servo` say.
#pragma once

#include <ehsid/c_api.h>

#include "controller.hpp"
#include "messages.hpp"

namespace servo {

/// Largest watchdog_ms: a valve that nobody has commanded for longer than a minute is nobody's.
constexpr std::uint32_t kMaxWatchdogMs = 60'000;

struct Configuration {
  bool tracks_servo;           // a ServoEstimator, else an estimator of an ARX model
  ehsid_servo_settings servo;  // read where tracks_servo; estimator and seed are not, then
  ehsid_configuration estimator;
  ehsid_estimate seed;  // read where has_seed
  bool has_seed;
  ControllerSettings controller;
  std::uint32_t watchdog_ms;
};

/// Has the body of `configure` as many bytes as its flags and orders say?
bool configure_length_right(Bytes body);

/// Reads a body of `configure` of the right length. Reason::none where controller and watchdog are in their ranges and this firmware
/// holds the estimator; the ranges of its settings are for ehsid_init() to check.
Reason read_configuration(Bytes body, Configuration& configuration);

/// The same of `configure_servo`; the ranges of the estimator's settings are for ehsid_servo_init() to check.
Reason read_servo_configuration(Bytes body, Configuration& configuration);

}  // namespace servo
