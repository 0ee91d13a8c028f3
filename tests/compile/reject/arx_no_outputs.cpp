// SPDX-License-Identifier: MIT
// expected: Arx: na, the number of past outputs, must be at least 1
#include <ehsid/ehsid.hpp>

#ifdef CORRECTED
template class ehsid::Arx<float, 1, 3, 1>;
#else
template class ehsid::Arx<float, 0, 3, 1>;
#endif
