// SPDX-License-Identifier: MIT
// Exported headers as a controller includes them: several in one unit, self-tests at power-on, and the estimator in
// static storage as docs/export.md has it, without a static constructor.
#include <new>

#include "../../export/cases.h"

namespace {
alignas(f_ratio::Estimator) unsigned char storage[sizeof(f_ratio::Estimator)];
f_ratio::Estimator* servo;
}  // namespace

bool power_on() {
  servo = ::new (storage) f_ratio::Estimator;
#define SELF_TEST(name) &&name::self_test()
  return f_ratio::configure(*servo) == ehsid::Status::ok EXPORTED_CASES(SELF_TEST);
}

ehsid::Status step(float command, float position) { return servo->step(command, position); }

ehsid::Status start(exponential::Estimator& estimator) { return exponential::configure(estimator); }
