// SPDX-License-Identifier: MIT
#include "eigenvalues.hpp"

#include <Eigen/Eigenvalues>

std::array<std::complex<double>, 3> roots_as_eigenvalues(const std::array<double, 3>& a) {
  Eigen::Matrix3d companion;
  companion << -a[0], -a[1], -a[2], 1.0, 0.0, 0.0, 0.0, 1.0, 0.0;
  const Eigen::Vector3cd z = Eigen::EigenSolver<Eigen::Matrix3d>(companion, false).eigenvalues();
  return {z[0], z[1], z[2]};
}
