// SPDX-License-Identifier: MIT
// expected: the short window must be shorter than the long one
#include <ehsid/ehsid.hpp>

#ifdef CORRECTED
ehsid::FRatio<float, 4, 8> policy;
#else
ehsid::FRatio<float, 8, 4> policy;
#endif
