// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/four.hpp>
#include <ehsid/plant/powers.hpp>

#include <array>
#include <cmath>
#include <cstddef>

namespace ehsid::plant {

/// A flow through an edge and its slope over the pressure drop.
template <class Scalar>
struct Flow {
  Scalar rate{};   // m^3/s
  Scalar slope{};  // d rate / d (pressure drop), m^3/(s Pa)
};

/// Of each edge: supply to cap side, cap side to tank, supply to rod side, rod side to tank.
template <class T>
using OfEdges = std::array<T, 4>;

/// A metering edge as the spool opens it.
///
/// Area of an edge whose spool is s past its overlap, rounded over r, fraction of full opening:
///   a = (1 - c) h + c p,  h = (s + sqrt(s^2 + r^2)) / 2,
///   p = (s + w)^2 / (4 w) from s = -w to w, zero before, s after; w = 2 r.
/// The hyperbola h leaks far from the edge, as a clearance does; the parabola p of a worn corner closes. Both are r / 2 at
/// s = 0 and s well beyond it.
template <class Scalar>
struct Edge {
  Scalar gain{};      // K, see Orifices
  Scalar overlap{};   // fraction of rated command
  Scalar rounding{};  // r
  Scalar closing{};   // c

  /// K a. opening: of the spool towards this edge, fraction of rated command.
  EHSID_LANES_INLINE Scalar conductance(const Scalar& opening) const {
    const Scalar past = opening - overlap;
    const double s = value_of(past);
    const double r = value_of(rounding);
    const double c = value_of(closing);
    const double root = std::sqrt(s * s + r * r);
    const double hyperbola = (s + root) * 0.5;
    const double inverse = root > 0.0 ? 0.5 / root : 0.0;
    double parabola = s > 0.0 ? s : 0.0;
    double over_past = s > 0.0 ? 1.0 : 0.0;
    double over_rounding = 0.0;
    if (s < 2.0 * r && s > -2.0 * r) {
      // dp/ds = (s + w) / (2 w),  dp/dw = dp/ds - (dp/ds)^2
      over_past = s / (4.0 * r) + 0.5;
      parabola = 2.0 * r * over_past * over_past;
      over_rounding = 2.0 * over_past * (1.0 - over_past);
    }
    const Scalar area = chained(hyperbola + c * (parabola - hyperbola),
                                over(past, (1.0 - c) * (0.5 + inverse * s) + c * over_past),
                                over(rounding, (1.0 - c) * inverse * r + c * over_rounding),
                                over(closing, parabola - hyperbola));
    return gain * area;
  }
};

/// What flows through the four metering edges of a spool valve.
///
/// Turbulent flow that turns laminar at small pressure drops (Merritt, Hydraulic Control Systems, Wiley 1967, ch. 3):
///   q = K a dp / (dp^2 + dp_l^2)^((1 - e) / 2),  K = rated_flow / rated_drop^e,  e = 0.5 the square-root law.
///
/// The law is evaluated on values; its slopes over all that it depends on give the derivatives.
template <class Scalar>
class Orifices {
 public:
  Orifices() = default;
  Orifices(const Scalar& rated_flow, const Scalar& rated_drop, const Scalar& exponent,
           const Scalar& laminar_pressure)
      : power_((exponent - 1.0) * 0.5),
        laminar_square_(laminar_pressure * laminar_pressure),
        powers_(value_of(laminar_square_), value_of(power_)) {
    using std::exp;
    using std::log;
    gain_ = rated_flow * exp(-(exponent * log(rated_drop)));
  }

  /// K
  const Scalar& gain() const { return gain_; }

  /// Flows at pressure drops, Pa, through edges that are open by K a. The slopes take a third of the time: kSlope = false
  /// leaves them zero.
  template <bool kSlope>
  EHSID_LANES_INLINE OfEdges<Flow<Scalar>> flows(const OfEdges<Scalar>& conductance,
                                                 const OfEdges<Scalar>& drop) const {
    using Values = Four<kRegisterWidth<Scalar>>;
    // With c = K a, d = dp, w = d^2 + dp_l^2 and p = (e - 1) / 2:
    //   q = c d w^p,  dq/dd = c w^p g,  dq/dp = q ln w,  dq/d(dp_l^2) = q p / w,  g = 1 + 2 p d^2 / w
    const double p = value_of(power_);
    const Values c(values_of(conductance));
    const Values d(values_of(drop));
    const Values square = d * d;
    const Values w = square + value_of(laminar_square_);
    const auto parts = powers_.parts(w);
    const Values power = powers_.power(parts);
    const Values logarithm = powers_.logarithm(parts);
    const Values inverse = 1.0 / w;
    const Values share = square * inverse;
    const Values growth = share * (2.0 * p) + 1.0;
    const Values open = c * power;
    const Values rate = open * d;
    const Values over_conductance = power * d;
    const Values over_drop = open * growth;
    const Values over_power = rate * logarithm;
    const Values over_laminar = rate * inverse * p;
    OfEdges<Flow<Scalar>> flows;
    for (std::size_t i = 0; i < flows.size(); ++i) {
      flows[i].rate =
          chained(rate[i], over(conductance[i], over_conductance[i]), over(drop[i], over_drop[i]),
                  over(power_, over_power[i]), over(laminar_square_, over_laminar[i]));
    }
    if constexpr (kSlope) {
      // The slope is f = c w^p g, with
      //   df/dd = 2 p c w^p (d / w) (g + 2 - 2 d^2 / w),  df/dp = c w^p (g ln w + 2 d^2 / w),
      //   df/d(dp_l^2) = c w^p (p / w) (g - 2 d^2 / w)
      const Values open_by_w = open * inverse;
      const Values slope_over_conductance = power * growth;
      const Values slope_over_drop = open_by_w * d * (2.0 * p) * (growth + 2.0 + share * -2.0);
      const Values slope_over_power = open * (growth * logarithm + share * 2.0);
      const Values slope_over_laminar = open_by_w * p * (growth + share * -2.0);
      for (std::size_t i = 0; i < flows.size(); ++i) {
        flows[i].slope =
            chained(over_drop[i], over(conductance[i], slope_over_conductance[i]),
                    over(drop[i], slope_over_drop[i]), over(power_, slope_over_power[i]),
                    over(laminar_square_, slope_over_laminar[i]));
      }
    }
    return flows;
  }

 private:
  EHSID_LANES_INLINE static OfEdges<double> values_of(const OfEdges<Scalar>& numbers) {
    return {value_of(numbers[0]), value_of(numbers[1]), value_of(numbers[2]), value_of(numbers[3])};
  }

  Scalar gain_{};
  Scalar power_{};
  Scalar laminar_square_{};
  Powers powers_{};
};

}  // namespace ehsid::plant
