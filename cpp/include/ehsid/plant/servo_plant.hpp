// SPDX-License-Identifier: MIT
// The servo: asymmetric cylinder, four metering edges, load, and every effect of the catalogue.
//
// Equations (Merritt, Hydraulic Control Systems, Wiley 1967, ch. 5 and 6), absolute pressures, y from the cap end:
//   dp_a/dt = beta_e(p_a) / (V_a0 + A_a y) (q_pa - q_at - q_leak,a - A_a y')
//   dp_b/dt = beta_e(p_b) / (V_b0 + A_b (stroke - y)) (q_pb - q_bt - q_leak,b + A_b y')
//   m y''   = p_a A_a - p_b A_b - p_0 (A_a - A_b) - b y' - friction - load - end stops
//
// Integration: positions and pressures at whole steps, velocity at half steps (leapfrog, second order, no
// damping of its own); pressures by the two-stage Rosenbrock method of Verwer et al. (SIAM J. Sci. Comput. 20,
// 1999), second order and L-stable, so that stiff edges do not dictate the step.
#pragma once

#include <ehsid/plant/catalogue.hpp>
#include <ehsid/plant/command_path.hpp>
#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/rig.hpp>
#include <ehsid/plant/seals.hpp>
#include <ehsid/plant/spool.hpp>
#include <ehsid/plant/valve.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <tuple>
#include <type_traits>
#include <vector>

namespace ehsid::plant {

enum class PlantKind { ehs, axis };

/// What a record of the plant can hold.
template <class Scalar>
struct Outputs {
  Scalar position;         // m, as the sensor shows it
  Scalar velocity;         // m/s, of the rod
  Scalar pressure_a;       // Pa
  Scalar pressure_b;       // Pa
  Scalar supply_pressure;  // Pa
  Scalar spool;            // fraction of rated command, before null bias
};

template <class Scalar>
class ServoPlant {
 public:
  /// Values in the order of parameter_infos() (parameters.hpp). dt: sampling time of the command, s;
  /// substeps: steps of integration a sample; samples: how many will come. It starts at the initial position and
  /// velocity, the valve closed, pressures as told or else in balance with the load.
  ServoPlant(PlantKind kind, const std::vector<Scalar>& values, double dt, int substeps,
             std::size_t samples);

  /// The rod is at a measured position from here on; all else goes on. The sensor moves along.
  void align(const Scalar& reading);

  /// Outputs at sample k, then on to sample k + 1 with this command, V. Samples in order.
  Outputs<Scalar> sample(double command_v);

  /// Largest angular frequency of the mass on oil and seals anywhere in the stroke, rad/s.
  double fastest_rate() const;

 private:
  struct Pressures {
    Scalar a, b, supply;
  };

  /// Asks every active effect, in the order of the catalogue.
  template <class Place>
  void each(Place place) {
    std::apply([&](auto&... effect) { ((effect.active ? place(effect) : void()), ...); }, effects_);
  }
  template <class Place>
  void each(Place place) const {
    std::apply([&](const auto&... effect) { ((effect.active ? place(effect) : void()), ...); },
               effects_);
  }

  static Scalar at(const std::vector<Scalar>& values, RigValue which) {
    return values[static_cast<std::size_t>(which)];
  }
  static Scalar at(const std::vector<Scalar>& values, Nuisance which) {
    return values[kRigValues.size() + static_cast<std::size_t>(which)];
  }

  Scalar load(const Scalar& position) const {
    Scalar sum(0.0);
    each([&](const auto& effect) { add(sum, effect.load(position - middle_)); });
    return sum;
  }

  Scalar friction(const Scalar& speed) const {
    Scalar sum(0.0);
    each([&](const auto& effect) { add(sum, effect.friction(speed)); });
    return sum;
  }

  /// beta_e over the volume, Pa/m^3.
  Scalar stiffness(const Scalar& pressure, const Scalar& inverse_volume) const {
    Scalar beta = bulk_modulus_;
    each([&](const auto& effect) { put(beta, effect.bulk_modulus(beta, pressure)); });
    return beta * inverse_volume;
  }

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

  static Scalar at(const std::vector<Scalar>& values, Initial which) {
    return values[kRigValues.size() + kNuisances.size() + static_cast<std::size_t>(which)];
  }

  template <class Flows>
  static void leak(Scalar& into_a, Scalar& into_b, const Flows& flows) {
    if constexpr (!std::is_same_v<Flows, Nothing>) {
      into_a -= flows.from_a;
      into_b -= flows.from_b;
    }
  }

  void start(const std::vector<Scalar>& values);

  /// Outputs at this whole step, the new command not acting yet.
  Outputs<Scalar> observe(const Scalar& drive) const {
    Outputs<Scalar> now{reading_,         (velocity_ + accelerate(drive)) * 0.5,
                        pressure_.a,      pressure_.b,
                        pressure_.supply, spool_.position()};
    each([&](const auto& effect) { put(now.position, effect.store(now.position)); });
    return now;
  }

  /// Velocity half a step on, from the forces at this whole step.
  Scalar accelerate(const Scalar& drive) const;
  void advance_pressures(const Scalar& spool, const Scalar& from_middle_position);

  static constexpr double kAtmosphere = 101325.0;       // Pa
  static constexpr double kVapour = 1e3;                // Pa
  static constexpr double kStopRate = 1000.0;           // rad/s, of the mass on its end stop
  static constexpr double kGamma = 0.2928932188134524;  // 1 - 1 / sqrt(2)

  PlantKind kind_;
  double dt_;
  double h_;
  int substeps_;
  Catalogue<Scalar> effects_{};
  CommandPath<Scalar> commands_;
  Spool<Scalar> spool_;
  MeteringEdges<Scalar> edges_;
  Seals<Scalar> seals_;

  Scalar area_a_, area_b_, stroke_, middle_, dead_a_, dead_b_, mass_, viscous_, atmosphere_force_;
  Scalar source_, tank_, bulk_modulus_, force_gain_, rated_command_;
  Scalar overlap_pa_, overlap_at_, overlap_pb_, overlap_bt_;
  bool line_ = false;
  Scalar inverse_resistance_, inverse_capacitance_;

  std::size_t sample_ = 0;
  Scalar position_, velocity_, reading_;
  Pressures pressure_{};
  Scalar cavity_a_{}, cavity_b_{};
  Scalar drive_before_{};
};

template <class Scalar>
ServoPlant<Scalar>::ServoPlant(PlantKind kind, const std::vector<Scalar>& values, double dt,
                               int substeps, std::size_t samples)
    : kind_(kind), dt_(dt), h_(dt / substeps), substeps_(substeps) {
  std::size_t next = kRigValues.size() + kNuisances.size() + kInitials.size();
  const auto tell = [&](auto& effect) {
    effect.active = false;
    for (Scalar& parameter : effect.parameters) {
      parameter = values[next++];
      effect.active = effect.active || !is_nothing(parameter);
    }
  };
  std::apply([&](auto&... effect) { (tell(effect), ...); }, effects_);
  constexpr double kQuarterPi = 0.7853981633974483;
  const Scalar bore = at(values, RigValue::bore);
  const Scalar rod = at(values, RigValue::rod);
  area_a_ = bore * bore * kQuarterPi;
  area_b_ = area_a_ - rod * rod * kQuarterPi;
  stroke_ = at(values, RigValue::stroke);
  middle_ = kind == PlantKind::ehs ? stroke_ * 0.5 : Scalar(0.0);
  dead_a_ = at(values, RigValue::dead_volume_a);
  dead_b_ = at(values, RigValue::dead_volume_b);
  const bool hydraulic = kind == PlantKind::ehs;
  mass_ = at(values, hydraulic ? RigValue::mass : RigValue::axis_mass);
  viscous_ = at(values, hydraulic ? RigValue::viscous_friction : RigValue::axis_viscous_friction);
  atmosphere_force_ = (area_a_ - area_b_) * kAtmosphere;
  source_ = at(values, RigValue::supply_pressure);
  tank_ = at(values, RigValue::tank_pressure);
  bulk_modulus_ = at(values, RigValue::bulk_modulus);
  force_gain_ = at(values, RigValue::force_per_volt);
  rated_command_ = hydraulic ? at(values, RigValue::rated_command) : Scalar(1.0);

  Scalar delay(0.0);
  Scalar overlap(0.0);
  SpoolLag<Scalar> lag{at(values, Nuisance::spool_bandwidth), at(values, Nuisance::spool_damping)};
  SupplyLine<Scalar> line{};
  each([&](const auto& effect) {
    add(delay, effect.delay());
    add(overlap, effect.overlap());
    put(lag, effect.spool_lag());
    put(line, effect.supply_line());
  });
  line_ = value_of(line.resistance) > 0.0;
  if (line_) {
    inverse_resistance_ = 1.0 / line.resistance;
    inverse_capacitance_ = 1.0 / line.capacitance;
  }
  commands_ = CommandPath<Scalar>(delay, dt, samples);
  spool_ = Spool<Scalar>(lag, 0.5 * h_);
  overlap_pa_ = overlap + at(values, Nuisance::edge_pa);
  overlap_at_ = overlap + at(values, Nuisance::edge_at);
  overlap_pb_ = overlap + at(values, Nuisance::edge_pb);
  overlap_bt_ = overlap + at(values, Nuisance::edge_bt);
  edges_ = MeteringEdges<Scalar>(
      at(values, RigValue::rated_flow), at(values, RigValue::rated_pressure_drop),
      at(values, Nuisance::flow_exponent), at(values, Nuisance::laminar_pressure),
      at(values, Nuisance::edge_rounding));
  seals_ = Seals<Scalar>(friction(Scalar(0.0)), at(values, Nuisance::presliding));
  start(values);
}

template <class Scalar>
void ServoPlant<Scalar>::start(const std::vector<Scalar>& values) {
  const Scalar position = at(values, Initial::position);
  position_ = position;
  reading_ = position;
  velocity_ = at(values, Initial::velocity);
  each([&](auto& effect) { effect.start_sensor(position); });
  // p_a A_a - p_b A_b = load, and p_a + p_b = p_s + p_t as in a valve with alike edges at null.
  const Scalar sum = source_ + tank_;
  const Scalar force = load(position) + atmosphere_force_;
  pressure_.a = clamp<Scalar>((force + sum * area_b_) / (area_a_ + area_b_), tank_, source_);
  pressure_.b = clamp<Scalar>((pressure_.a * area_a_ - force) / area_b_, tank_, source_);
  pressure_.supply = source_;
  const Scalar told_a = at(values, Initial::pressure_a);
  const Scalar told_b = at(values, Initial::pressure_b);
  pressure_.a = std::isnan(value_of(told_a)) ? pressure_.a : told_a;
  pressure_.b = std::isnan(value_of(told_b)) ? pressure_.b : told_b;
}

template <class Scalar>
void ServoPlant<Scalar>::align(const Scalar& reading) {
  const Scalar change = reading - reading_;
  position_ += change;
  each([&](auto& effect) { effect.shift_sensor(change); });
  reading_ = reading;
}

template <class Scalar>
Scalar ServoPlant<Scalar>::accelerate(const Scalar& drive) const {
  Scalar force = drive - load(position_);
  Scalar damping = viscous_;
  if (seals_.active()) {
    force -= seals_.force();
    damping += seals_.damping(velocity_);
  }
  if (kind_ == PlantKind::ehs) {
    const bool beyond = value_of(position_) > value_of(stroke_);
    if (beyond || value_of(position_) < 0.0) {
      force -= mass_ * (kStopRate * kStopRate) * (beyond ? position_ - stroke_ : position_);
      damping += mass_ * kStopRate;
    }
  }
  // m (v+ - v-) / h = force - damping (v+ + v-) / 2
  const Scalar inertia = mass_ * (1.0 / h_);
  const Scalar half = damping * 0.5;
  return (velocity_ * (inertia - half) + force) / (inertia + half);
}

template <class Scalar>
void ServoPlant<Scalar>::advance_pressures(const Scalar& spool, const Scalar& middle_position) {
  Scalar opening = spool;
  each([&](const auto& effect) { put(opening, effect.opening(opening)); });
  const Scalar open_pa = edges_.area(opening - overlap_pa_);
  const Scalar open_bt = edges_.area(opening - overlap_bt_);
  const Scalar open_at = edges_.area(-opening - overlap_at_);
  const Scalar open_pb = edges_.area(-opening - overlap_pb_);
  const Scalar inverse_a = 1.0 / (dead_a_ + area_a_ * middle_position);
  const Scalar inverse_b = 1.0 / (dead_b_ + area_b_ * (stroke_ - middle_position));
  const Scalar swept_a = area_a_ * velocity_;
  const Scalar swept_b = area_b_ * velocity_;

  struct Rates {
    Pressures value;  // Pa/s
    Pressures slope;  // of each over its own pressure, 1/s
    Scalar stiff_a, stiff_b;
  };
  const auto rates = [&](const Pressures& p, auto with_slope) {
    constexpr bool kSlope = decltype(with_slope)::value;
    const Flow<Scalar> pa = edges_.template flow<kSlope>(open_pa, p.supply - p.a);
    const Flow<Scalar> at = edges_.template flow<kSlope>(open_at, p.a - tank_);
    const Flow<Scalar> pb = edges_.template flow<kSlope>(open_pb, p.supply - p.b);
    const Flow<Scalar> bt = edges_.template flow<kSlope>(open_bt, p.b - tank_);
    Scalar into_a = pa.rate - at.rate - swept_a;
    Scalar into_b = pb.rate - bt.rate + swept_b;
    each([&](const auto& effect) { leak(into_a, into_b, effect.leakage(p.a, p.b, tank_)); });
    const Scalar stiff_a = stiffness(p.a, inverse_a);
    const Scalar stiff_b = stiffness(p.b, inverse_b);
    Rates r{};
    r.stiff_a = stiff_a;
    r.stiff_b = stiff_b;
    r.value.a = stiff_a * into_a;
    r.value.b = stiff_b * into_b;
    if constexpr (kSlope) {
      r.slope.a = -(stiff_a * (pa.slope + at.slope));
      r.slope.b = -(stiff_b * (pb.slope + bt.slope));
    }
    if (line_) {
      r.value.supply =
          ((source_ - p.supply) * inverse_resistance_ - pa.rate - pb.rate) * inverse_capacitance_;
      if constexpr (kSlope) {
        r.slope.supply = -((inverse_resistance_ + pa.slope + pb.slope) * inverse_capacitance_);
      }
    }
    return r;
  };
  const auto floored = [](const Scalar& p) { return value_of(p) < kVapour ? Scalar(kVapour) : p; };

  // (1 - g h J) k1 = f(p),  (1 - g h J) k2 = f(p + h k1) - 2 k1,  p <- p + h (3 k1 + k2) / 2,
  // J the diagonal of the Jacobian: the order does not depend on what J leaves out.
  const Rates first = rates(pressure_, std::true_type{});
  const Scalar a = 1.0 / (1.0 - first.slope.a * (kGamma * h_));
  const Scalar b = 1.0 / (1.0 - first.slope.b * (kGamma * h_));
  const Scalar k1_a = first.value.a * a;
  const Scalar k1_b = first.value.b * b;
  Pressures ahead{floored(pressure_.a + k1_a * h_), floored(pressure_.b + k1_b * h_),
                  pressure_.supply};
  Scalar s;
  Scalar k1_s;
  if (line_) {
    s = 1.0 / (1.0 - first.slope.supply * (kGamma * h_));
    k1_s = first.value.supply * s;
    ahead.supply = floored(pressure_.supply + k1_s * h_);
  }
  const Rates second = rates(ahead, std::false_type{});
  const auto step = [&](const Scalar& p, const Scalar& k1, const Scalar& rate,
                        const Scalar& inverse) {
    const Scalar k2 = (rate - k1 * 2.0) * inverse;
    return p + (k1 * 3.0 + k2) * (0.5 * h_);
  };
  pressure_.a = with_cavity(step(pressure_.a, k1_a, second.value.a, a),
                            first.value.a * h_ / first.stiff_a, first.stiff_a, cavity_a_);
  pressure_.b = with_cavity(step(pressure_.b, k1_b, second.value.b, b),
                            first.value.b * h_ / first.stiff_b, first.stiff_b, cavity_b_);
  if (line_) {
    pressure_.supply = floored(step(pressure_.supply, k1_s, second.value.supply, s));
  }
}

template <class Scalar>
double ServoPlant<Scalar>::fastest_rate() const {
  double stiffness_n_m = value_of(seals_.stiffness());
  if (kind_ == PlantKind::ehs) {
    const auto oil = [&](double from_cap) {
      const double a = value_of(area_a_) * value_of(area_a_) /
                       (value_of(dead_a_) + value_of(area_a_) * from_cap);
      const double b = value_of(area_b_) * value_of(area_b_) /
                       (value_of(dead_b_) + value_of(area_b_) * (value_of(stroke_) - from_cap));
      return value_of(bulk_modulus_) * (a + b);
    };
    // Stiffest at one of the ends: each term is convex in the position.
    const double ends[] = {oil(0.0), oil(value_of(stroke_))};
    stiffness_n_m += ends[0] > ends[1] ? ends[0] : ends[1];
  }
  return std::sqrt(stiffness_n_m / value_of(mass_));
}

template <class Scalar>
Outputs<Scalar> ServoPlant<Scalar>::sample(double command_v) {
  Scalar command = command_v / rated_command_;
  each([&](auto& effect) { put(command, effect.command(command)); });
  commands_.push(command);

  Outputs<Scalar> outputs{};
  const double share = 1.0 / substeps_;
  for (int i = 0; i < substeps_; ++i) {
    const double now = static_cast<double>(sample_) + i * share;
    // Half steps: the spool is wanted in the middle, where the flows are taken.
    const Scalar first = commands_.mean(now, 0.5 * share);
    const Scalar later = commands_.mean(now + 0.5 * share, 0.5 * share);
    Scalar drive;
    Scalar drive_before;
    if (kind_ == PlantKind::ehs) {
      drive = pressure_.a * area_a_ - pressure_.b * area_b_ - atmosphere_force_;
      drive_before = drive;
    } else {
      const Scalar current = (first + later) * 0.5 * force_gain_;
      drive_before = drive_before_;
      drive = (drive_before + current) * 0.5;
      drive_before_ = current;
    }
    if (i == 0) {
      outputs = observe(drive_before);
    }
    velocity_ = accelerate(drive);
    const Scalar moved = velocity_ * h_;
    if (kind_ == PlantKind::ehs) {
      const Scalar spool = spool_.advance(first);
      advance_pressures(spool, position_ + moved * 0.5);
      spool_.advance(later);
    }
    if (seals_.active()) {
      seals_.advance(velocity_, friction(absolute<Scalar>(velocity_)), h_);
    }
    position_ += moved;
    reading_ = position_;
    each([&](auto& effect) { put(reading_, effect.sense(reading_, h_)); });
  }
  ++sample_;
  return outputs;
}

}  // namespace ehsid::plant
