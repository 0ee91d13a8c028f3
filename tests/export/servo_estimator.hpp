// Written by `ehsid export --servo`, ehsid 0.2.0; do not edit, export again.
// Settings of the estimator of K, omega_n and xi, and a self-test for the target. Numbers are float32 in
// hexadecimal, exact to the bit; decimals are for people.
//
// Made by tests/export/make_headers.py
//
// Results are bit for bit those of Python where the compiler does not fuse multiplications and additions
// (-ffp-contract=off, as the CMake target ehsid::reproducible sets it), nor uses -ffast-math.
// clang-format off
#pragma once

#include <cstdint>
#include <cstring>
#include <ehsid/servo_estimator.hpp>

namespace servo_estimator {

using Estimator = ehsid::ServoEstimator<float, 6>;

/// Sets the estimator up; ok, unless this file was changed.
inline ehsid::Status configure(Estimator& estimator) {
  Estimator::Options options;
  options.dt_s = 0x1.0624dep-9F;  // 0.002 s: call step() as often
  options.delay = 6;
  options.drift = 0x1.eb851ep-6F;  // 0.03
  options.tolerance = 0x1.333334p-3F;  // 0.15
  return estimator.configure(options);
}

/// Value and half width of K, omega_n and xi after the self-test.
inline constexpr float kTold[6] = {
    0x1.59a7e2p+4F,  // 21.6035
    0x1.dab73ep+2F,  // 7.41743
    0x1.398902p+9F,  // 627.07
    0x1.22d676p+10F,  // 1163.35
    0x1.5285p+1F,  // 2.64468
    0x1.e18d34p+1F,  // 3.76212
};

/// Runs 600 samples of a servo that is computed here; changes `estimator`, which is configured anew then. True
/// where what is told is, bit for bit, what Python computed.
inline bool self_test(Estimator& estimator) {
  bool same = configure(estimator) == ehsid::Status::ok;
  float position = 0.0F;
  float velocity = 0.0F;
  std::uint32_t random = 1;
  for (int k = 0; k < 600; ++k) {
    random = random * 1664525U + 1013904223U;
    const float noise = static_cast<float>(random >> 16U) * 0x1p-24F;
    const float command = k / 50 % 2 == 0 ? 1.0F : -1.0F;
    same = !ehsid::is_error(estimator.step(command, position + noise)) && same;
    velocity = velocity + 0.25F * (command - velocity);
    position = position + 0.0625F * velocity;
  }
  const ehsid::TrackedServo<float> told = estimator.servo();
  const float* wanted = kTold;
  for (const auto* value : {&told.gain, &told.omega_n, &told.xi}) {
    for (const float number : {value->value, value->half_width}) {
      same = std::memcmp(&number, wanted++, sizeof number) == 0 && same;
    }
  }
  return configure(estimator) == ehsid::Status::ok && same;
}

}  // namespace servo_estimator
