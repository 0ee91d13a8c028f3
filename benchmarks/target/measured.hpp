// SPDX-License-Identifier: MIT
// What is measured: one form of the estimator, see forms.cpp.
#pragma once

#include <ehsid/types.hpp>

namespace budget {

constexpr int kN = EHSID_N;

/// One sample, in the two shapes that forms ask for.
struct Input {
  ehsid::Vector<float, kN> phi;
  float y;         // of phi, plus noise
  float command;   // of a servo, model (16)
  float position;  // of the same
};

}  // namespace budget

extern "C" {
void measured_start(void* storage);
/// Status of the sample, 0 for an update.
int measured_update(void* storage, const budget::Input& input);
/// Size of the storage.
extern const std::uint32_t measured_bytes;
}
