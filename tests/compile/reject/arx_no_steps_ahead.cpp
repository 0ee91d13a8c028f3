// SPDX-License-Identifier: MIT
// expected: Arx: predict at least one step ahead
#include <ehsid/ehsid.hpp>

#ifdef CORRECTED
ehsid::Vector<float, 2> ahead(const ehsid::Arx<float, 1, 1, 1>& arx) {
  return arx.predict_ahead<2>({1.0F, 1.0F}, {0.0F, 0.0F});
}
#else
ehsid::Vector<float, 0> ahead(const ehsid::Arx<float, 1, 1, 1>& arx) {
  return arx.predict_ahead<0>({1.0F, 1.0F}, {});
}
#endif
