// SPDX-License-Identifier: MIT
// expected: Arx: nk, the delay in samples, must not be negative
#include <ehsid/ehsid.hpp>

#ifdef CORRECTED
template class ehsid::Arx<float, 3, 3, 0>;
#else
template class ehsid::Arx<float, 3, 3, -1>;
#endif
