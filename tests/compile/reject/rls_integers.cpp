// SPDX-License-Identifier: MIT
// expected: Rls needs float or double
#include <ehsid/ehsid.hpp>

#ifdef CORRECTED
ehsid::Rls<double, 2, ehsid::Constant<double>> rls;
#else
ehsid::Rls<int, 2, ehsid::Constant<double>> rls;
#endif
