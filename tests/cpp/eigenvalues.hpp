// SPDX-License-Identifier: MIT
// Roots of a cubic as eigenvalues, from Eigen. Apart from the test that uses them: Eigen's solver takes longer to
// compile than all the rest, and there is nothing of ours in it for sanitizers to look at.
#pragma once

#include <array>
#include <complex>

/// Roots of z^3 + a[0] z^2 + a[1] z + a[2], in no order: the eigenvalues of the companion matrix.
std::array<std::complex<double>, 3> roots_as_eigenvalues(const std::array<double, 3>& a);
