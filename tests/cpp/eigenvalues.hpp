// SPDX-License-Identifier: MIT
// Roots of a cubic as eigenvalues, computed by Eigen. They are in a file of their own because Eigen's solver takes longer
// to compile than the whole test, and sanitizers would find nothing of ours in it.
#pragma once

#include <array>
#include <complex>

/// Roots of z^3 + a[0] z^2 + a[1] z + a[2], in no order: the eigenvalues of the companion matrix.
std::array<std::complex<double>, 3> roots_as_eigenvalues(const std::array<double, 3>& a);
