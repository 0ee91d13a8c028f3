// SPDX-License-Identifier: MIT
// Who adds entries for n parameters. Each is in a translation unit of its own, as in a controller.
#pragma once

#include "peer.hpp"

namespace peers {

/// Recursions with static sizes: textbook.cpp and ours.cpp are compiled once for each n, as EHSID_N.
template <int kN>
void add_textbook(Entries& entries);
template <int kN>
void add_ours(Entries& entries);

/// Libraries with sizes at run time, where they are installed.
void add_dlib(Entries& entries, int n);
void add_liquid(Entries& entries, int n);

}  // namespace peers
