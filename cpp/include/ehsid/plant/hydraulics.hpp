// SPDX-License-Identifier: MIT
// Cylinder, four metering edges and supply line: what drives the rod of an electro-hydraulic servo.
//
// Equations (Merritt, Hydraulic Control Systems, Wiley 1967, ch. 5 and 6), absolute pressures, y from the cap end:
//   dp_a/dt = beta_e(p_a) / (V_a0 + A_a y) (q_pa - q_at - q_leak,a - A_a y')
//   dp_b/dt = beta_e(p_b) / (V_b0 + A_b (stroke - y)) (q_pb - q_bt - q_leak,b + A_b y')
//   force   = p_a A_a - p_b A_b - p_0 (A_a - A_b)
// Every oil holds a little free gas (ibid., ch. 2, isothermal): alpha p_0 / p of the volume. It is felt near vacuum only:
//   1 / beta_e = 1 / beta + alpha p_0 / p^2
//
// Integration: the two-stage Rosenbrock method of Verwer et al. (SIAM J. Sci. Comput. 20, 1999), second order and
// L-stable, so that stiff edges do not dictate the step.
#pragma once

#include <ehsid/plant/catalogue.hpp>
#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/rig.hpp>
#include <ehsid/plant/valve.hpp>

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <vector>

namespace ehsid::plant {

/// Absolute, Pa.
template <class Scalar>
struct Pressures {
  Scalar a, b, supply;
};

template <class Scalar>
class Hydraulics {
 public:
  /// Values in the order of plant_parameters(). load: on the rod at the start, N.
  Hydraulics(const std::vector<Scalar>& values, const Effects<Scalar>& effects, const Scalar& load);

  /// On the rod, N, positive extends.
  Scalar force() const { return pressure_.a * area_a_ - pressure_.b * area_b_ - atmosphere_force_; }

  const Pressures<Scalar>& pressure() const { return pressure_; }

  /// Absolute, Pa, cap side and rod side; NaN leaves a pressure as it is.
  void set_pressures(const Scalar& a, const Scalar& b) {
    set(pressure_.a, cavity_a_, a);
    set(pressure_.b, cavity_b_, b);
  }

  /// h seconds with the valve open by `opening` and the rod moving by its middle position.
  void advance(const Effects<Scalar>& effects, const Scalar& opening, const Scalar& position,
               const Scalar& velocity, double h);

  /// Largest stiffness of the oil anywhere in the stroke, N/m.
  double stiffness() const;

 private:
  struct Rates {
    Pressures<Scalar> value;  // Pa/s
    Pressures<Scalar> slope;  // of each over its own pressure, 1/s
    Scalar stiff_a, stiff_b;  // Pa/m^3
  };
  /// What does not change during a step.
  struct Standing {
    Scalar open_pa, open_at, open_pb, open_bt;
    Scalar inverse_a, inverse_b;  // of the volumes
    Scalar swept_a, swept_b;      // m^3/s
  };

  template <bool kSlope>
  Rates rates(const Effects<Scalar>& effects, const Standing& standing,
              const Pressures<Scalar>& p) const;

  /// beta_e over the volume, Pa/m^3.
  Scalar stiffness(const Effects<Scalar>& effects, const Scalar& pressure,
                   const Scalar& inverse_volume) const {
    Scalar beta = bulk_modulus_;
    effects.each([&](const auto& effect) { put(beta, effect.bulk_modulus(beta, pressure)); });
    return beta / (1.0 + beta * free_gas_pressure_ / (pressure * pressure)) * inverse_volume;
  }

  template <class Flows>
  static void leak(Scalar& into_a, Scalar& into_b, const Flows& flows) {
    if constexpr (!std::is_same_v<Flows, Nothing>) {
      into_a -= flows.from_a;
      into_b -= flows.from_b;
    }
  }

  static void set(Scalar& pressure, Scalar& cavity, const Scalar& told) {
    if (!std::isnan(value_of(told))) {
      pressure = told;
      cavity = Scalar(0.0);
    }
  }

  static Scalar floored(const Scalar& p) { return value_of(p) < kVapour ? Scalar(kVapour) : p; }

  /// A chamber's pressure after a step. No chamber pulls a vacuum: at the vapour pressure the oil parts, and the
  /// cavity, m^3, must be filled before the pressure rises again. inflow: m^3 during the step.
  static Scalar with_cavity(const Scalar& stepped, const Scalar& inflow, const Scalar& stiffness,
                            Scalar& cavity) {
    if (value_of(cavity) > 0.0) {
      cavity -= inflow;
      if (value_of(cavity) > 0.0) {
        return Scalar(kVapour);
      }
      const Scalar pressure = kVapour - stiffness * cavity;
      cavity = Scalar(0.0);
      return pressure;
    }
    if (value_of(stepped) < kVapour) {
      cavity = (kVapour - stepped) / stiffness;
      return Scalar(kVapour);
    }
    return stepped;
  }

  static constexpr double kAtmosphere = 101325.0;       // Pa
  static constexpr double kVapour = 1e3;                // Pa
  static constexpr double kGamma = 0.2928932188134524;  // 1 - 1 / sqrt(2)

  Scalar area_a_, area_b_, stroke_, dead_a_, dead_b_, atmosphere_force_;
  Scalar source_, tank_, bulk_modulus_, free_gas_pressure_;
  MeteringEdges<Scalar> edges_;
  Scalar overlap_pa_, overlap_at_, overlap_pb_, overlap_bt_;
  bool line_ = false;
  Scalar inverse_resistance_{}, inverse_capacitance_{};
  Pressures<Scalar> pressure_{};
  Scalar cavity_a_{}, cavity_b_{};
};

template <class Scalar>
Hydraulics<Scalar>::Hydraulics(const std::vector<Scalar>& values, const Effects<Scalar>& effects,
                               const Scalar& load)
    : stroke_(value_at(values, RigValue::stroke)),
      dead_a_(value_at(values, RigValue::dead_volume_a)),
      dead_b_(value_at(values, RigValue::dead_volume_b)),
      source_(value_at(values, RigValue::supply_pressure)),
      tank_(value_at(values, RigValue::tank_pressure)),
      bulk_modulus_(value_at(values, RigValue::bulk_modulus)),
      free_gas_pressure_(value_at(values, Nuisance::free_gas) * kAtmosphere),
      edges_(
          value_at(values, RigValue::rated_flow), value_at(values, RigValue::rated_pressure_drop),
          value_at(values, Nuisance::flow_exponent), value_at(values, Nuisance::laminar_pressure),
          value_at(values, Nuisance::edge_rounding)) {
  constexpr double kQuarterPi = 0.7853981633974483;
  const Scalar bore = value_at(values, RigValue::bore);
  const Scalar rod = value_at(values, RigValue::rod);
  area_a_ = bore * bore * kQuarterPi;
  area_b_ = area_a_ - rod * rod * kQuarterPi;
  atmosphere_force_ = (area_a_ - area_b_) * kAtmosphere;

  Scalar overlap(0.0);
  SupplyLine<Scalar> line{};
  effects.each([&](const auto& effect) {
    add(overlap, effect.overlap());
    put(line, effect.supply_line());
  });
  overlap_pa_ = overlap + value_at(values, Nuisance::edge_pa);
  overlap_at_ = overlap + value_at(values, Nuisance::edge_at);
  overlap_pb_ = overlap + value_at(values, Nuisance::edge_pb);
  overlap_bt_ = overlap + value_at(values, Nuisance::edge_bt);
  line_ = value_of(line.resistance) > 0.0;
  if (line_) {
    inverse_resistance_ = 1.0 / line.resistance;
    inverse_capacitance_ = 1.0 / line.capacitance;
  }

  // p_a A_a - p_b A_b = load, and p_a + p_b = p_s + p_t as in a valve with alike edges at null.
  const Scalar sum = source_ + tank_;
  const Scalar force = load + atmosphere_force_;
  pressure_.a = clamp<Scalar>((force + sum * area_b_) / (area_a_ + area_b_), tank_, source_);
  pressure_.b = clamp<Scalar>((pressure_.a * area_a_ - force) / area_b_, tank_, source_);
  pressure_.supply = source_;
  set_pressures(value_at(values, Initial::pressure_a), value_at(values, Initial::pressure_b));
}

template <class Scalar>
template <bool kSlope>
typename Hydraulics<Scalar>::Rates Hydraulics<Scalar>::rates(const Effects<Scalar>& effects,
                                                             const Standing& standing,
                                                             const Pressures<Scalar>& p) const {
  const Flow<Scalar> pa = edges_.template flow<kSlope>(standing.open_pa, p.supply - p.a);
  const Flow<Scalar> at = edges_.template flow<kSlope>(standing.open_at, p.a - tank_);
  const Flow<Scalar> pb = edges_.template flow<kSlope>(standing.open_pb, p.supply - p.b);
  const Flow<Scalar> bt = edges_.template flow<kSlope>(standing.open_bt, p.b - tank_);
  Scalar into_a = pa.rate - at.rate - standing.swept_a;
  Scalar into_b = pb.rate - bt.rate + standing.swept_b;
  effects.each([&](const auto& effect) { leak(into_a, into_b, effect.leakage(p.a, p.b, tank_)); });
  Rates r{};
  r.stiff_a = stiffness(effects, p.a, standing.inverse_a);
  r.stiff_b = stiffness(effects, p.b, standing.inverse_b);
  r.value.a = r.stiff_a * into_a;
  r.value.b = r.stiff_b * into_b;
  if constexpr (kSlope) {
    r.slope.a = -(r.stiff_a * (pa.slope + at.slope));
    r.slope.b = -(r.stiff_b * (pb.slope + bt.slope));
  }
  if (line_) {
    r.value.supply =
        ((source_ - p.supply) * inverse_resistance_ - pa.rate - pb.rate) * inverse_capacitance_;
    if constexpr (kSlope) {
      r.slope.supply = -((inverse_resistance_ + pa.slope + pb.slope) * inverse_capacitance_);
    }
  }
  return r;
}

template <class Scalar>
void Hydraulics<Scalar>::advance(const Effects<Scalar>& effects, const Scalar& opening,
                                 const Scalar& position, const Scalar& velocity, double h) {
  const Standing standing{edges_.area(opening - overlap_pa_),
                          edges_.area(-opening - overlap_at_),
                          edges_.area(-opening - overlap_pb_),
                          edges_.area(opening - overlap_bt_),
                          1.0 / (dead_a_ + area_a_ * position),
                          1.0 / (dead_b_ + area_b_ * (stroke_ - position)),
                          area_a_ * velocity,
                          area_b_ * velocity};

  // (1 - g h J) k1 = f(p),  (1 - g h J) k2 = f(p + h k1) - 2 k1,  p <- p + h (3 k1 + k2) / 2,
  // J the diagonal of the Jacobian: the order does not depend on what J leaves out.
  const Rates first = rates<true>(effects, standing, pressure_);
  const Scalar a = 1.0 / (1.0 - first.slope.a * (kGamma * h));
  const Scalar b = 1.0 / (1.0 - first.slope.b * (kGamma * h));
  const Scalar k1_a = first.value.a * a;
  const Scalar k1_b = first.value.b * b;
  Pressures<Scalar> ahead{floored(pressure_.a + k1_a * h), floored(pressure_.b + k1_b * h),
                          pressure_.supply};
  Scalar s;
  Scalar k1_s;
  if (line_) {
    s = 1.0 / (1.0 - first.slope.supply * (kGamma * h));
    k1_s = first.value.supply * s;
    ahead.supply = floored(pressure_.supply + k1_s * h);
  }
  const Rates second = rates<false>(effects, standing, ahead);
  const auto step = [&](const Scalar& p, const Scalar& k1, const Scalar& rate,
                        const Scalar& inverse) {
    const Scalar k2 = (rate - k1 * 2.0) * inverse;
    return p + (k1 * 3.0 + k2) * (0.5 * h);
  };
  pressure_.a = with_cavity(step(pressure_.a, k1_a, second.value.a, a),
                            first.value.a * h / first.stiff_a, first.stiff_a, cavity_a_);
  pressure_.b = with_cavity(step(pressure_.b, k1_b, second.value.b, b),
                            first.value.b * h / first.stiff_b, first.stiff_b, cavity_b_);
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
  return std::max(oil(0.0), oil(value_of(stroke_)));
}

}  // namespace ehsid::plant
