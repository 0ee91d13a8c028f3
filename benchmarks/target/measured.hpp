// SPDX-License-Identifier: MIT
// What is measured: one form of the estimator, see forms.cpp.
#pragma once

#include <ehsid/types.hpp>

namespace budget {

constexpr int kN = EHSID_N;

/// One sample, in the two shapes that forms ask for.
struct Input {
  ehsid::Vector<float, kN> phi;
  float y;               // of phi, plus noise
  float command;         // of a servo, model (16)
  float position;        // of the same
  float servo_command;   // of a servo of third order, 13 rad/s and xi 0.47, every 50 ms
  float servo_position;  // of the same, with noise of its sensor
};

}  // namespace budget

extern "C" {
void measured_start(void* storage);
/// Status of the sample, 0 for an update.
int measured_update(void* storage, const budget::Input& input);
/// Size of the storage.
extern const std::uint32_t measured_bytes;
/// Samples before those that count: windows are full, and P is no longer vague.
extern const std::int32_t measured_first;
}
