// SPDX-License-Identifier: MIT
#include "bank_instances.hpp"

namespace ehsid::bindings {

template std::unique_ptr<AnyBank> make_bank<float>(const std::vector<AnyEstimator*>&,
                                                   const std::string&);

}  // namespace ehsid::bindings
