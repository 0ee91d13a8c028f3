// SPDX-License-Identifier: MIT
// expected: Arx: nb, the number of past commands, must be at least 1
#include <ehsid/ehsid.hpp>

#ifdef CORRECTED
template class ehsid::Arx<float, 3, 1, 1>;
#else
template class ehsid::Arx<float, 3, 0, 1>;
#endif
