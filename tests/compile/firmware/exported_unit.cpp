// SPDX-License-Identifier: MIT
// Exported headers as a controller includes them: several in one unit, self-tests at power-on.
#include "../../export/constant.hpp"
#include "../../export/directional.hpp"
#include "../../export/error_driven.hpp"
#include "../../export/exponential.hpp"
#include "../../export/f_ratio.hpp"
#include "../../export/random_walk.hpp"

bool power_on() {
  return constant::self_test() && directional::self_test() && error_driven::self_test() &&
         exponential::self_test() && f_ratio::self_test() && random_walk::self_test();
}

ehsid::Status start(exponential::Estimator& estimator) { return exponential::configure(estimator); }

ehsid::Status start(random_walk::Estimator& estimator) { return random_walk::configure(estimator); }
