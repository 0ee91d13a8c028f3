// SPDX-License-Identifier: MIT
// What a forgetting policy sees of a step, and what it answers.
#pragma once

#include <ehsid/types.hpp>

namespace ehsid {

/// A step before it is taken.
template <class Scalar>
struct Evidence {
  Scalar innovation;          // epsilon(k), Eq. (12)
  Scalar regressor_variance;  // phi' P(k-1) phi, in units of the residual variance
};

/// Forgetting of one step: P is divided by `before` ahead of the measurement, as in Eq. (13), and by
/// `after` behind it, as in Fortescue (1981). Both in (0, 1]; 1 forgets nothing.
template <class Scalar>
struct ForgettingFactors {
  Scalar before;
  Scalar after;
};

/// Is lambda a usable forgetting factor?
template <class Scalar>
bool is_forgetting_factor(Scalar lambda) {
  return lambda > Scalar(0) && lambda <= Scalar(1);
}

}  // namespace ehsid
