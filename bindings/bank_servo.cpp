// SPDX-License-Identifier: MIT
// The bank of the third-order servo model in float32, which is what most banks hold: all sizes are known when it is compiled,
// and all loops unrolled.
#if defined(__GNUC__)
#define EHSID_UNROLL _Pragma("GCC unroll 16")
#endif

#include "bank_instances.hpp"

namespace ehsid::bindings {

template <std::size_t kPlace>
struct ServoPattern {
  using Type = ArxEstimator<float, 3, 3, 1, PolicyAt<kPlace, float>>;
};

std::unique_ptr<AnyBank> make_third_order_bank(const std::vector<AnyEstimator*>& estimators,
                                               bank::Isa isa) {
  return make_bank_of<float, ServoPattern>(estimators, isa);
}

}  // namespace ehsid::bindings
