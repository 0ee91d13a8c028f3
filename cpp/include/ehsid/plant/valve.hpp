// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>

#include <cmath>

namespace ehsid::plant {

/// A flow through an edge and its slope over the pressure drop.
template <class Scalar>
struct Flow {
  Scalar rate;   // m^3/s
  Scalar slope;  // d rate / d (pressure drop), m^3/(s Pa)
};

/// Four metering edges of a spool valve, each opened by the spool.
///
/// Turbulent flow that turns laminar at small pressure drops (Merritt, Hydraulic Control Systems, Wiley 1967, ch. 3):
///   q = K a dp / (dp^2 + dp_l^2)^((1 - e) / 2),  K = rated_flow / rated_drop^e,  e = 0.5 the square-root law.
/// Area a of an edge whose spool is s past its overlap, rounded over r:  a = (s + sqrt(s^2 + r^2)) / 2.
template <class Scalar>
class MeteringEdges {
 public:
  MeteringEdges() = default;
  MeteringEdges(const Scalar& rated_flow, const Scalar& rated_drop, const Scalar& exponent,
                const Scalar& laminar_pressure, const Scalar& rounding)
      : square_root_(value_of(exponent) == 0.5 && is_constant(exponent)),
        power_((exponent - 1.0) * 0.5),
        laminar_square_(laminar_pressure * laminar_pressure),
        rounding_square_(rounding * rounding) {
    using std::exp;
    using std::log;
    gain_ = rated_flow * exp(-(exponent * log(rated_drop)));
  }

  /// Area of an edge, fraction of full opening.
  Scalar area(const Scalar& past_overlap) const {
    using std::sqrt;
    return (past_overlap + sqrt(past_overlap * past_overlap + rounding_square_)) * 0.5;
  }

  /// The slope costs a third of it all: kSlope = false leaves it zero.
  template <bool kSlope>
  Flow<Scalar> flow(const Scalar& area, const Scalar& drop) const {
    using std::exp;
    using std::log;
    using std::sqrt;
    const Scalar square = drop * drop;
    const Scalar softened = square + laminar_square_;
    const Scalar conductance = square_root_ ? gain_ * area / sqrt(sqrt(softened))
                                            : gain_ * area * exp(power_ * log(softened));
    if constexpr (!kSlope) {
      return {conductance * drop, Scalar(0.0)};
    } else {
      // d/d dp of dp (dp^2 + dp_l^2)^p is (...)^p (1 + 2 p dp^2 / (...))
      return {conductance * drop, conductance * (1.0 + power_ * 2.0 * square / softened)};
    }
  }

 private:
  static bool is_constant(double) { return true; }
  template <class Partials>
  static bool is_constant(const Dual<Partials>& x) {
    return x.partial.all_zero();
  }

  bool square_root_ = true;  // the common case, several times cheaper
  Scalar gain_{};
  Scalar power_{};
  Scalar laminar_square_{};
  Scalar rounding_square_{};
};

}  // namespace ehsid::plant
