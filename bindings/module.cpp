// SPDX-License-Identifier: MIT
#include "bindings.hpp"

#include <ehsid/version.hpp>

PYBIND11_MODULE(_core, m) {
  m.doc() = "Compiled part of ehsid: the C++ estimator as firmware runs it.";
  m.attr("__version__") = EHSID_VERSION_STRING;
  ehsid::bindings::bind_types(m);
  ehsid::bindings::bind_forgetting(m);
  ehsid::bindings::bind_rls(m);
  bind_servo_model(m);
  ehsid::bindings::bind_arx_estimator(m);
  ehsid::bindings::bind_estimator_bank(m);
  ehsid::bindings::bind_servo_estimator(m);
  ehsid::bindings::bind_servo_bank(m);
  ehsid::bindings::bind_growth_monitor(m);
  ehsid::bindings::bind_effects(m);
  ehsid::bindings::bind_plant(m);
  ehsid::bindings::bind_outside(m);
}
