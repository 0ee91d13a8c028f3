// SPDX-License-Identifier: MIT
// A parameter of the plant as Python sees it: that of an effect under its own name, any under its full name.
#pragma once

#include "bindings.hpp"

#include <ehsid/plant/effect_info.hpp>

#include <string>

namespace ehsid::bindings {

py::object shown_parameter(const std::string& name, const plant::ParameterInfo& info);

}  // namespace ehsid::bindings
