// SPDX-License-Identifier: MIT
// expected: Rls needs at least one parameter
#include <ehsid/ehsid.hpp>

#ifdef CORRECTED
ehsid::Rls<float, 1, ehsid::Constant<float>> rls;
#else
ehsid::Rls<float, 0, ehsid::Constant<float>> rls;
#endif
