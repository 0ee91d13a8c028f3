// SPDX-License-Identifier: MIT
// Exported headers as a controller includes them: several in one unit, self-tests at power-on, and the estimator in
// static storage as docs/export.md has it, without a static constructor.
#include <new>

#include "../../export/constant.hpp"
#include "../../export/directional.hpp"
#include "../../export/error_driven.hpp"
#include "../../export/exponential.hpp"
#include "../../export/f_ratio.hpp"
#include "../../export/random_walk.hpp"

namespace {
alignas(f_ratio::Estimator) unsigned char storage[sizeof(f_ratio::Estimator)];
f_ratio::Estimator* servo;
}  // namespace

bool power_on() {
  servo = ::new (storage) f_ratio::Estimator;
  return f_ratio::configure(*servo) == ehsid::Status::ok && constant::self_test() &&
         directional::self_test() && error_driven::self_test() && exponential::self_test() &&
         f_ratio::self_test() && random_walk::self_test();
}

ehsid::Status step(float command, float position) { return servo->step(command, position); }

ehsid::Status start(exponential::Estimator& estimator) { return exponential::configure(estimator); }

ehsid::Status start(random_walk::Estimator& estimator) { return random_walk::configure(estimator); }
