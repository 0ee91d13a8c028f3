// SPDX-License-Identifier: MIT
// Cylinder, four metering edges and supply line: what drives the rod of an electro-hydraulic servo.
//
// Equations (Merritt, Hydraulic Control Systems, Wiley 1967, ch. 5 and 6), absolute pressures, y from the cap end:
//   dp_a/dt = beta_e(p_a) / (V_a0 + A_a y) (q_pa - q_at - q_leak,a - A_a y')
//   dp_b/dt = beta_e(p_b) / (V_b0 + A_b (stroke - y)) (q_pb - q_bt - q_leak,b + A_b y')
//   force   = p_a A_a - p_b A_b - p_0 (A_a - A_b)
// Every oil holds a little free gas, felt near vacuum only; isothermal it is alpha p_0 / p of the volume (ibid., ch. 2).
// What flows in compresses both, so that the pressure p follows from the compression s, which has no edge at vacuum:
//   ds/dt = beta_e q / V,   s = p - g / p,   g = alpha beta p_0
//
// A counterbalance valve passes a share s of the flow of its edge to tank, and its poppet is damped:
//   T ds/dt = share(p_own, p_other) - s
// at half steps, from the pressures between them.
//
// Integration: the two-stage Rosenbrock method of Verwer et al. (SIAM J. Sci. Comput. 20, 1999), second order and
// L-stable, so that stiff edges do not dictate the step.
#pragma once

#include <ehsid/plant/catalogue.hpp>
#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/rig.hpp>
#include <ehsid/plant/ringing_line.hpp>
#include <ehsid/plant/valve.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace ehsid::plant {

/// Absolute, Pa.
template <class Scalar>
struct Pressures {
  Scalar a, b, supply;
};

/// Flows into the chambers besides those of edges and leakages, m^3/s.
template <class Scalar>
struct Flows {
  Scalar into_a{};
  Scalar into_b{};
};

template <class Scalar>
class Hydraulics {
 public:
  /// Values in the order of plant_parameters(). load: on the rod at the start, N. fastest: the pressure line rings no
  /// faster than this, rad/s.
  Hydraulics(const std::vector<Scalar>& values, const Effects<Scalar>& effects, const Scalar& load,
             double fastest);

  /// On the rod, N, positive extends.
  Scalar force() const { return pressure_.a * area_a_ - pressure_.b * area_b_ - atmosphere_force_; }

  const Pressures<Scalar>& pressure() const { return pressure_; }

  /// Absolute, Pa, cap side and rod side; NaN leaves a pressure as it is.
  void set_pressures(const Scalar& a, const Scalar& b) {
    set(pressure_.a, compression_a_, a);
    set(pressure_.b, compression_b_, b);
  }

  /// h seconds about a time, s, with the valve open by `opening` and the rod moving by its middle position.
  void advance(const Effects<Scalar>& effects, const Scalar& opening, const Scalar& position,
               const Scalar& velocity, double time, double h, const Flows<Scalar>& further);

  /// Largest stiffness of the oil anywhere in the stroke, N/m.
  double stiffness() const;

  /// Of the pressure line, rad/s.
  double line_rate() const { return pressure_line_.rate(); }

 private:
  struct Rates {
    Pressures<Scalar> value;  // of the compressions and the supply, Pa/s
    Pressures<Scalar> slope;  // of each over itself, 1/s
  };
  /// What does not change during a step.
  struct Standing {
    OfEdges<Scalar> conductance;
    Scalar inverse_a, inverse_b;  // of the volumes
    Scalar swept_a, swept_b;      // m^3/s
  };

  template <bool kSlope>
  Rates rates(const Effects<Scalar>& effects, const Standing& standing,
              const Pressures<Scalar>& p) const;

  /// beta_e over the volume, Pa/m^3.
  Scalar stiffness(const Effects<Scalar>& effects, const Scalar& pressure,
                   const Scalar& inverse_volume) const {
    // Oil stiffens as it is compressed, walls and hoses may not: beta + m (p - p_s / 2), m some 10 for oil alone.
    Scalar beta = bulk_modulus_ + bulk_slope_ * (pressure - middle_pressure_);
    beta =
        value_of(beta) < kLeastShare * value_of(bulk_modulus_) ? bulk_modulus_ * kLeastShare : beta;
    return effects.bulk_modulus(beta, pressure) * inverse_volume;
  }

  /// What steep leakages add to the stiffness of a chamber that is on its way to the compression `ahead`, 1/s. A valve
  /// that would open within the step counts, because an explicit step would carry the pressure far beyond it.
  Scalar leakage_stiffness(const Effects<Scalar>& effects, const Scalar& p, const Scalar& ahead,
                           const Scalar& inverse_volume) const {
    const Scalar p_ahead = pressure_of(ahead);
    const Scalar slope = effects.leakage_slope(p, p_ahead, tank_);
    // A cavity that is filled has a slope from where the oil joins again.
    return slope * stiffness(effects, p, inverse_volume) *
           firmness(value_of(p) < value_of(p_ahead) ? p_ahead : p);
  }

  /// The poppets of the counterbalance valves, half a step on.
  void move_poppets(double h) {
    constexpr double kSettles = 0.01;  // s
    const double rate = 0.5 * h / kSettles;
    const auto moved = [&](const Scalar& poppet, const Scalar& own, const Scalar& other) {
      return (poppet * (1.0 - rate) + counterbalance_.share(own, other) * (2.0 * rate)) *
             (1.0 / (1.0 + rate));
    };
    poppet_a_ = moved(poppet_a_, pressure_.a, pressure_.b);
    poppet_b_ = moved(poppet_b_, pressure_.b, pressure_.a);
  }

  /// From a measured pressure; near vacuum it does not say how much gas there is, and none is assumed.
  void set(Scalar& pressure, Scalar& compression, const Scalar& measured) {
    if (!std::isnan(value_of(measured))) {
      const Scalar least(kVapour);
      const Scalar known = value_of(measured) < kVapour ? least : measured;
      compression = known - gas_ / known;
      if (value_of(compression) < 0.0) {
        compression = Scalar(0.0);
      }
      pressure = pressure_of(compression);
    }
  }

  static Scalar floored(const Scalar& p) { return value_of(p) < kVapour ? Scalar(kVapour) : p; }

  /// s = p - g / p, solved for p; no chamber pulls a vacuum.
  Scalar pressure_of(const Scalar& compression) const {
    const double s = value_of(compression);
    const double root = std::sqrt(s * s + 4.0 * value_of(gas_));
    const double over_root = 1.0 / root;
    return floored(chained((s + root) * 0.5, over(compression, 0.5 + 0.5 * s * over_root),
                           over(gas_, over_root)));
  }

  /// dp/ds
  Scalar firmness(const Scalar& p) const {
    return value_of(p) > kVapour ? 1.0 / (1.0 + gas_ / (p * p)) : Scalar(0.0);
  }

  static constexpr double kAtmosphere = 101325.0;       // Pa
  static constexpr double kLeastShare = 0.2;            // of the bulk modulus, at any pressure
  static constexpr double kVapour = 1e3;                // Pa
  static constexpr double kGamma = 0.2928932188134524;  // 1 - 1 / sqrt(2)
  static constexpr OfEdges<bool> kExtends{true, false, false, true};
  static constexpr OfEdges<bool> kAtA{true, true, false, false};
  static constexpr OfEdges<bool> kToTank{false, true, false, true};

  Scalar area_a_, area_b_, stroke_, dead_a_, dead_b_, atmosphere_force_;
  Scalar source_, tank_, bulk_modulus_;
  Scalar bulk_slope_, middle_pressure_;
  Scalar gas_;  // g = alpha beta p_0, Pa^2
  Orifices<Scalar> orifices_;
  OfEdges<Edge<Scalar>> edges_;
  Scalar inverse_resistance_{}, inverse_capacitance_{};
  RingingLine<Scalar> pressure_line_;
  Counterbalance<Scalar> counterbalance_;
  Scalar poppet_a_{}, poppet_b_{};  // shares of the edges to tank
  Pressures<Scalar> pressure_{};
  Scalar compression_a_{}, compression_b_{};  // s; at -V s / beta the oil has parted
  bool steep_leakage_ = false;
  bool line_ = false;
  bool throttled_ = false;
};

template <class Scalar>
Hydraulics<Scalar>::Hydraulics(const std::vector<Scalar>& values, const Effects<Scalar>& effects,
                               const Scalar& load, double fastest)
    : stroke_(value_at(values, RigValue::stroke)),
      dead_a_(value_at(values, RigValue::dead_volume_a)),
      dead_b_(value_at(values, RigValue::dead_volume_b)),
      source_(value_at(values, RigValue::supply_pressure)),
      tank_(value_at(values, RigValue::tank_pressure)),
      bulk_modulus_(value_at(values, RigValue::bulk_modulus)),
      bulk_slope_(value_at(values, Nuisance::bulk_slope)),
      middle_pressure_(source_ * 0.5),
      gas_(value_at(values, Nuisance::free_gas) * bulk_modulus_ * kAtmosphere),
      orifices_(
          value_at(values, RigValue::rated_flow), value_at(values, RigValue::rated_pressure_drop),
          value_at(values, Nuisance::flow_exponent), value_at(values, Nuisance::laminar_pressure)) {
  constexpr double kQuarterPi = 0.7853981633974483;
  const Scalar bore = value_at(values, RigValue::bore);
  const Scalar rod = value_at(values, RigValue::rod);
  area_a_ = bore * bore * kQuarterPi;
  area_b_ = area_a_ - rod * rod * kQuarterPi;
  atmosphere_force_ = (area_a_ - area_b_) * value_at(values, Nuisance::atmosphere) * kAtmosphere;

  const Overlap<Scalar> overlap = effects.overlap();
  const SupplyLine<Scalar> line = effects.supply_line();
  // Edges are not quite alike. What all flows share is the rated one, and what sets extending apart from retracting is a
  // null bias: of four overlaps their mean and two differences are left, of four flows three. Of four roundings the
  // logarithms have a mean and three differences.
  const auto unequal = [&](std::size_t i, const Scalar& direction, const Scalar& sides,
                           const Scalar& tank) {
    return (kExtends[i] ? direction : -direction) + (kAtA[i] ? sides : -sides) +
           (kToTank[i] ? tank : -tank);
  };
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    Edge<Scalar>& edge = edges_[i];
    edge.gain = orifices_.gain() * (unequal(i, value_at(values, Nuisance::edge_gain_direction),
                                            value_at(values, Nuisance::edge_gain_sides),
                                            value_at(values, Nuisance::edge_gain_tank)) +
                                    1.0);
    edge.overlap = (kExtends[i] ? overlap.extending : overlap.retracting) +
                   value_at(values, Nuisance::edge_overlap) +
                   unequal(i, Scalar(0.0), value_at(values, Nuisance::edge_overlap_sides),
                           value_at(values, Nuisance::edge_overlap_tank));
    using std::exp;
    edge.rounding = value_at(values, Nuisance::edge_rounding) *
                    exp(unequal(i, value_at(values, Nuisance::edge_rounding_direction),
                                value_at(values, Nuisance::edge_rounding_sides),
                                value_at(values, Nuisance::edge_rounding_tank)));
    edge.closing = value_at(values, Nuisance::edge_closing);
  }
  steep_leakage_ = effects.leak_steeply();
  line_ = value_of(line.resistance) > 0.0;
  if (line_) {
    inverse_resistance_ = 1.0 / line.resistance;
    inverse_capacitance_ = 1.0 / line.capacitance;
  }
  pressure_line_ =
      RingingLine<Scalar>(effects.pressure_line(), line, source_, bulk_modulus_, fastest);
  if (pressure_line_.active()) {
    // The line stands between the source and the valve.
    line_ = true;
    inverse_resistance_ = Scalar(0.0);
    inverse_capacitance_ = pressure_line_.inverse_capacitance();
  }

  // p_a A_a - p_b A_b = load, and p_a + p_b = p_s + p_t as in a valve with alike edges at null.
  const Scalar sum = source_ + tank_;
  const Scalar force = load + atmosphere_force_;
  const Scalar a = clamp<Scalar>((force + sum * area_b_) / (area_a_ + area_b_), tank_, source_);
  const Scalar b = clamp<Scalar>((a * area_a_ - force) / area_b_, tank_, source_);
  pressure_.supply = source_;
  set_pressures(a, b);
  set_pressures(value_at(values, Initial::pressure_a), value_at(values, Initial::pressure_b));
  counterbalance_ = effects.counterbalance();
  throttled_ = value_of(counterbalance_.pressure) > 0.0;
  if (throttled_) {
    poppet_a_ = counterbalance_.share(pressure_.a, pressure_.b);
    poppet_b_ = counterbalance_.share(pressure_.b, pressure_.a);
  }
}

template <class Scalar>
template <bool kSlope>
typename Hydraulics<Scalar>::Rates Hydraulics<Scalar>::rates(const Effects<Scalar>& effects,
                                                             const Standing& standing,
                                                             const Pressures<Scalar>& p) const {
  const auto [pa, at, pb, bt] = orifices_.template flows<kSlope>(
      standing.conductance, {p.supply - p.a, p.a - tank_, p.supply - p.b, p.b - tank_});
  Scalar into_a = pa.rate - at.rate - standing.swept_a;
  Scalar into_b = pb.rate - bt.rate + standing.swept_b;
  effects.leakages(p.a, p.b, tank_, [&](const Leakage<Scalar>& flows) {
    into_a -= flows.from_a;
    into_b -= flows.from_b;
  });
  Rates r{};
  const Scalar stiff_a = stiffness(effects, p.a, standing.inverse_a);
  const Scalar stiff_b = stiffness(effects, p.b, standing.inverse_b);
  r.value.a = stiff_a * into_a;
  r.value.b = stiff_b * into_b;
  if constexpr (kSlope) {
    r.slope.a = -(stiff_a * (pa.slope + at.slope) * firmness(p.a));
    r.slope.b = -(stiff_b * (pb.slope + bt.slope) * firmness(p.b));
  }
  if (line_) {
    const Scalar inflow = pressure_line_.active() ? pressure_line_.flow()
                                                  : (source_ - p.supply) * inverse_resistance_;
    r.value.supply = (inflow - pa.rate - pb.rate) * inverse_capacitance_;
    if constexpr (kSlope) {
      r.slope.supply = -((inverse_resistance_ + pa.slope + pb.slope) * inverse_capacitance_);
    }
  }
  return r;
}

template <class Scalar>
void Hydraulics<Scalar>::advance(const Effects<Scalar>& effects, const Scalar& opening,
                                 const Scalar& position, const Scalar& velocity, double time,
                                 double h, const Flows<Scalar>& further) {
  if (pressure_line_.active()) {
    pressure_line_.advance(pressure_.supply, h);
  }
  Standing standing{{edges_[0].conductance(opening), edges_[1].conductance(-opening),
                     edges_[2].conductance(-opening), edges_[3].conductance(opening)},
                    1.0 / (dead_a_ + area_a_ * position),
                    1.0 / (dead_b_ + area_b_ * (stroke_ - position)),
                    area_a_ * velocity - further.into_a,
                    area_b_ * velocity + further.into_b};
  if (throttled_) {
    move_poppets(h);
    standing.conductance[1] = standing.conductance[1] * poppet_a_;
    standing.conductance[3] = standing.conductance[3] * poppet_b_;
  }
  effects.flow_shares(time, [&](const Scalar& share) {
    for (Scalar& conductance : standing.conductance) {
      conductance = conductance * share;
    }
  });

  // (1 - g h J) k1 = f(s),  (1 - g h J) k2 = f(s + h k1) - 2 k1,  s <- s + h (3 k1 + k2) / 2,
  // J the diagonal of the Jacobian: the order does not depend on what J leaves out.
  Rates first = rates<true>(effects, standing, pressure_);
  if (steep_leakage_) {
    first.slope.a -= leakage_stiffness(effects, pressure_.a, compression_a_ + first.value.a * h,
                                       standing.inverse_a);
    first.slope.b -= leakage_stiffness(effects, pressure_.b, compression_b_ + first.value.b * h,
                                       standing.inverse_b);
  }
  const Scalar a = 1.0 / (1.0 - first.slope.a * (kGamma * h));
  const Scalar b = 1.0 / (1.0 - first.slope.b * (kGamma * h));
  const Scalar k1_a = first.value.a * a;
  const Scalar k1_b = first.value.b * b;
  Pressures<Scalar> ahead{pressure_of(compression_a_ + k1_a * h),
                          pressure_of(compression_b_ + k1_b * h), pressure_.supply};
  Scalar s(0.0);
  Scalar k1_s(0.0);
  if (line_) {
    s = 1.0 / (1.0 - first.slope.supply * (kGamma * h));
    k1_s = first.value.supply * s;
    ahead.supply = floored(pressure_.supply + k1_s * h);
  }
  const Rates second = rates<false>(effects, standing, ahead);
  const auto step = [&](const Scalar& s0, const Scalar& k1, const Scalar& rate,
                        const Scalar& inverse) {
    const Scalar k2 = (rate - k1 * 2.0) * inverse;
    return s0 + (k1 * 3.0 + k2) * (0.5 * h);
  };
  compression_a_ = step(compression_a_, k1_a, second.value.a, a);
  compression_b_ = step(compression_b_, k1_b, second.value.b, b);
  pressure_.a = pressure_of(compression_a_);
  pressure_.b = pressure_of(compression_b_);
  if (line_) {
    pressure_.supply = floored(step(pressure_.supply, k1_s, second.value.supply, s));
  }
}

template <class Scalar>
double Hydraulics<Scalar>::stiffness() const {
  const auto oil = [&](double from_cap) {
    const double a =
        value_of(area_a_) * value_of(area_a_) / (value_of(dead_a_) + value_of(area_a_) * from_cap);
    const double b = value_of(area_b_) * value_of(area_b_) /
                     (value_of(dead_b_) + value_of(area_b_) * (value_of(stroke_) - from_cap));
    return value_of(bulk_modulus_) * (a + b);
  };
  // Stiffest at one of the ends: each term is convex in the position.
  return (std::max)(oil(0.0), oil(value_of(stroke_)));
}

}  // namespace ehsid::plant
