// SPDX-License-Identifier: MIT
// The servo: command path, what drives the rod, mass with friction, load and end stops, sensor; with every effect of
// the catalogue.
//
//   m y'' = force(drive) - b y' - friction - load - end stops
//
// A part of the mass may hang on the rest by a spring (hanging_mass.hpp); m is then what is left.
// Tables add terms to its equations (tables.hpp). A force over the velocity counts as damping where it rises, so that a
// steep one is stable. Disturbances add nothing but derivatives (disturbances.hpp).
//
// A mass over the position is that of a mechanism with one degree of freedom, whose kinetic energy is m(y) v^2 / 2.
// Lagrange's equation for it:
//   m(y) y'' + m'(y) y'^2 / 2 = force
//
// Integration: positions and pressures at whole steps, velocity at half steps (leapfrog, second order, no
// damping of its own).
#pragma once

#include <ehsid/plant/catalogue.hpp>
#include <ehsid/plant/command_path.hpp>
#include <ehsid/plant/disturbances.hpp>
#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/hanging_mass.hpp>
#include <ehsid/plant/hydraulics.hpp>
#include <ehsid/plant/linear_servo.hpp>
#include <ehsid/plant/rig.hpp>
#include <ehsid/plant/seals.hpp>
#include <ehsid/plant/spool.hpp>
#include <ehsid/plant/tables.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace ehsid::plant {

/// What drives the rod: a cylinder behind a valve, a motor (force = gain u), or the linear model (1)-(4).
enum class PlantKind { ehs, axis, linear };

/// What a record of the plant can hold; NaN for what the plant does not have.
template <class Scalar>
struct Outputs {
  Scalar position;         // m, as the sensor shows it
  Scalar velocity;         // m/s, of the rod
  Scalar pressure_a;       // Pa, as the sensor shows it
  Scalar pressure_b;       // the same
  Scalar supply_pressure;  // Pa
  Scalar spool;            // fraction of rated command, before null bias
};

/// The outputs in the order in which they are named, and their names in a record.
inline constexpr std::array kOutputNames{"position_m",    "velocity_m_s",       "pressure_a_pa",
                                         "pressure_b_pa", "supply_pressure_pa", "spool"};
template <class Scalar>
std::array<Scalar, kOutputNames.size()> in_order(const Outputs<Scalar>& o) {
  return {o.position, o.velocity, o.pressure_a, o.pressure_b, o.supply_pressure, o.spool};
}

/// Numbers of a state: position, velocity, pressures at the cap and at the rod, as Initial.
inline constexpr std::size_t kStates = static_cast<std::size_t>(Initial::count);

/// Tables leave at least this share of the mass. A quarter turns every oscillation twice as fast: the leapfrog is still
/// stable with steps that suit the whole mass.
inline constexpr double kLeastMass = 0.25;

/// The fastest oscillation turns by at most this angle in a step, rad: about 0.1 % of its frequency.
inline constexpr double kRadiansPerStep = 1.0 / 3.0;

// One object a run: what its members leave between them does not matter.
template <class Scalar>
class ServoPlant {  // NOLINT(clang-analyzer-optin.performance.Padding)
 public:
  /// Values in the order of plant_parameters() (parameters.hpp). dt: sampling time of the command, s;
  /// substeps: steps of integration a sample; samples: how many will come, for the memory. It starts at the initial
  /// position and velocity, the valve closed, pressures as given, or else in balance with the load. tables: their values
  /// follow those of the parameters.
  ServoPlant(PlantKind kind, const std::vector<Scalar>& values, double dt, int substeps,
             std::size_t samples, const std::vector<TableShape>& tables = {},
             Disturbances<Scalar> disturbances = {});

  /// The rod is at a measured or estimated state from here on; what is NaN, and all else, goes on. The sensor and what
  /// hangs on the rod move along.
  void align(const std::array<double, kStates>& state);

  /// Outputs at this sample; the next command is not in them.
  Outputs<Scalar> read() const;

  /// The command, V, of the first sample that has none yet: told ahead, it can be moved on to (CommandPath). Told or not,
  /// advance() needs that of its own sample.
  void foresee(double command_v) {
    commands_.push(effects_.command(command_v / rated_command_, h_ * substeps_));
  }

  /// On to the next sample, with the command of this one, V, which does not count where it was foreseen.
  void advance(double command_v);

  /// Largest angular frequency of the mass on oil and seals anywhere in the stroke, of what hangs on it, and of
  /// the pressure line, rad/s.
  double fastest_rate() const;

 private:
  static Scalar mass_of(PlantKind kind, const std::vector<Scalar>& values);
  static Scalar viscous_of(PlantKind kind, const std::vector<Scalar>& values);
  static Scalar rated_command_of(PlantKind kind, const std::vector<Scalar>& values);
  static Spool<Scalar> spool_of(PlantKind kind, const std::vector<Scalar>& values,
                                const Effects<Scalar>& effects, double h);

  /// Of the whole mass, what moves with the rod.
  Scalar rigid_mass(const Scalar& whole) const {
    return hanging_.active() ? whole - hanging_.mass() : whole;
  }

  Scalar load(const Scalar& position) const {
    return effects_.load(position - middle_) + contact_.force(position);
  }
  Scalar friction(const Sliding<Scalar>& now) const {
    // Lips of seals creep before they slide: friction comes up with the speed, from a share at rest,
    //   g (c + (1 - c) v / sqrt(v^2 + v_on^2)).
    using std::sqrt;
    constexpr double kAtRest = 0.1;
    const Scalar up = now.speed / sqrt(now.speed * now.speed + onset_ * onset_);
    return effects_.friction(now) * (kAtRest + (1.0 - kAtRest) * up);
  }
  /// At rest: the mean of both directions and of both ends of the stroke.
  Scalar friction_at_rest() const {
    const auto at = [&](const Scalar& from_middle) {
      return (friction({Scalar(0.0), true, from_middle}) +
              friction({Scalar(0.0), false, from_middle})) *
             0.5;
    };
    return (at(stroke_ * 0.5) + at(stroke_ * -0.5)) * 0.5;
  }
  Scalar opening(const Scalar& spool) const {
    const Scalar x = effects_.opening(spool + null_bias_);
    return added_to(Equation::spool) ? x + added(Equation::spool) : x;
  }

  /// Does a table or a disturbance add to this equation?
  bool added_to(Equation equation) const {
    return tables_.act_on(equation) || disturbances_.act_on(equation);
  }
  /// What they add.
  Scalar added(Equation equation) const {
    if (!tables_.act_on(equation)) {
      return disturbances_.at(equation);
    }
    const Scalar of_tables = tables_.at(equation, state()).value;
    return disturbances_.act_on(equation) ? of_tables + disturbances_.at(equation) : of_tables;
  }

  /// What tables are given over, at the whole step before; the velocity is that of the half step before.
  Variables<Scalar> state() const {
    const Pressures<Scalar>& pressure = hydraulics_.pressure();
    return {velocity_,  position_,       spool_.position(), pressure.a,
            pressure.b, pressure.supply, Scalar(time_)};
  }

  /// Flows by tables and disturbances into the chambers.
  Flows<Scalar> further_flows() const {
    if (!added_to(Equation::flow_a) && !added_to(Equation::flow_b)) {
      return {};
    }
    return {added(Equation::flow_a), added(Equation::flow_b)};
  }

  /// What the sensor, tables and disturbances make of the position.
  Scalar with_error(const Scalar& reading) const {
    return added_to(Equation::sensor) ? reading + added(Equation::sensor) : reading;
  }

  /// Mean of the command that arrives over [from, from + length), in samples.
  Scalar arriving(double from, double length) const {
    return added_to(Equation::delay)
               ? commands_.mean(from, length, added(Equation::delay), h_ * substeps_)
               : commands_.mean(from, length);
  }

  /// On the rod at this whole step, N; a motor's is that of the command before.
  Scalar drive_force() const {
    switch (kind_) {
      case PlantKind::ehs:
        return hydraulics_.force();
      case PlantKind::linear:
        return linear_.force();
      case PlantKind::axis:
        break;
    }
    return motor_force_;
  }

  /// At this whole step: m a = force - damping v.
  struct Balance {
    Scalar force;    // N, but for what goes with the velocity
    Scalar damping;  // N s/m
  };
  Balance balance(const Scalar& drive) const;

  /// What moves with the rod at this whole step, kg, and its slope over the position, kg/m. It is never below
  /// kLeastMass of that without tables; there its slope is zero.
  Term<Scalar> inertia() const {
    if (!tables_.act_on(Equation::mass)) {
      return {mass_, Scalar(0.0)};
    }
    Term<Scalar> now = tables_.at(Equation::mass, state(), Variable::position);
    now.value += mass_;
    const Scalar least = mass_ * kLeastMass;
    if (!(value_of(now.value) > value_of(least))) {
      return {least, Scalar(0.0)};
    }
    return now;
  }

  /// Velocity half a step on, from the forces at this whole step.
  Scalar accelerate(const Scalar& drive) const;

  /// At this whole step: the mean of half a step ago and half a step on.
  Scalar velocity_now() const { return (velocity_ + accelerate(drive_force())) * 0.5; }

  /// The velocity half a step ago for which it is `velocity` now.
  void start_at(const Scalar& velocity);

  /// Of the mass on its end stop, rad/s: stiff, but no stiffer than the step can follow.
  double stop_rate() const { return (std::min)(1000.0, 0.5 / h_); }

  /// A contact that is no stiffer than the step can follow: above 2 / h the leapfrog is unstable.
  Contact<Scalar> softened(Contact<Scalar> contact) const {
    const double least = tables_.act_on(Equation::mass) ? kLeastMass : 1.0;
    const Scalar most = mass_ * (least / (h_ * h_));
    if (value_of(contact.stiffness) > value_of(most)) {
      contact.stiffness = most;
    }
    return contact;
  }

  /// The same of the mass on its seals before they slide. Above 2 / h the leapfrog is unstable: friction bounds the
  /// motion, but nothing bounds the sensitivities, which then say nothing. A third of a radian a step, as in
  /// recommended_substeps(), so that no run with the recommended steps is changed.
  double seal_rate() const { return kRadiansPerStep / h_; }

  /// The readings of the chamber pressures are these from here on, Pa; NaN leaves one as it is.
  void set_pressures(double a, double b);

  ChamberPressures<Scalar> chamber_pressures() const {
    const Pressures<Scalar>& pressure = hydraulics_.pressure();
    return {pressure.a, pressure.b};
  }

  PlantKind kind_;
  double h_;
  int substeps_;
  Effects<Scalar> effects_;
  bool sense_pressures_;
  Tables<Scalar> tables_;
  Disturbances<Scalar> disturbances_;
  Scalar onset_;
  HangingMass<Scalar> hanging_;
  Scalar rated_command_, mass_, viscous_, stroke_, middle_, force_gain_;
  Contact<Scalar> contact_;
  CommandPath<Scalar> commands_;
  Spool<Scalar> spool_;
  Hydraulics<Scalar> hydraulics_;
  LinearServo<Scalar> linear_;
  Seals<Scalar> seals_;
  Scalar motor_force_{};
  Scalar null_bias_;

  std::size_t sample_ = 0;
  double time_ = 0.0;  // s
  Scalar position_, velocity_, reading_;
  ChamberPressures<Scalar> pressures_read_{};
};

template <class Scalar>
ServoPlant<Scalar>::ServoPlant(PlantKind kind, const std::vector<Scalar>& values, double dt,
                               int substeps, std::size_t samples,
                               const std::vector<TableShape>& tables,
                               Disturbances<Scalar> disturbances)
    : kind_(kind),
      h_(dt / substeps),
      substeps_(substeps),
      effects_(values, kFirstOfEffects),
      sense_pressures_(kind == PlantKind::ehs && effects_.sense_pressures()),
      tables_(tables, values, values.size() - table_values(tables)),
      disturbances_(std::move(disturbances)),
      onset_(value_at(values, Nuisance::sliding_onset)),
      hanging_(effects_.hanging_load(), mass_of(kind, values), kRadiansPerStep / h_, h_),
      rated_command_(rated_command_of(kind, values)),
      mass_(rigid_mass(mass_of(kind, values))),
      viscous_(viscous_of(kind, values)),
      stroke_(value_at(values, RigValue::stroke)),
      middle_(kind == PlantKind::ehs ? stroke_ * 0.5 : Scalar(0.0)),
      force_gain_(value_at(values, RigValue::force_per_volt)),
      contact_(softened(effects_.contact())),
      commands_(effects_.delay(), dt, samples, value_at(values, Nuisance::between_samples)),
      spool_(spool_of(kind, values, effects_, 0.5 * h_)),
      hydraulics_(values, effects_, load(value_at(values, Initial::position)),
                  kRadiansPerStep / h_),
      linear_(values, effects_.overlap(), load(value_at(values, Initial::position))),
      seals_(friction_at_rest(), value_at(values, Nuisance::presliding),
             mass_ * (seal_rate() * seal_rate())),
      null_bias_(kind == PlantKind::ehs ? value_at(values, Nuisance::null_bias) : Scalar(0.0)),
      position_(value_at(values, Initial::position)),
      velocity_(value_at(values, Initial::velocity)),
      reading_(position_) {
  reading_ = with_error(effects_.start_sensor(position_));
  if (sense_pressures_) {
    pressures_read_ = effects_.start_pressure_sensors(chamber_pressures());
  }
  hanging_.start(velocity_);
  start_at(velocity_);
}

template <class Scalar>
Scalar ServoPlant<Scalar>::mass_of(PlantKind kind, const std::vector<Scalar>& values) {
  switch (kind) {
    case PlantKind::axis:
      return value_at(values, RigValue::axis_mass);
    case PlantKind::linear:
      return value_at(values, RigValue::linear_mass);
    case PlantKind::ehs:
      break;
  }
  return value_at(values, RigValue::mass);
}

template <class Scalar>
Scalar ServoPlant<Scalar>::viscous_of(PlantKind kind, const std::vector<Scalar>& values) {
  switch (kind) {
    case PlantKind::axis:
      return value_at(values, RigValue::axis_viscous_friction);
    case PlantKind::linear:
      return Scalar(0.0);
    case PlantKind::ehs:
      break;
  }
  return value_at(values, RigValue::viscous_friction);
}

/// What counts as 1 of the command, V.
template <class Scalar>
Scalar ServoPlant<Scalar>::rated_command_of(PlantKind kind, const std::vector<Scalar>& values) {
  switch (kind) {
    case PlantKind::axis:
      return Scalar(1.0);
    case PlantKind::linear:
      return 1.0 / value_at(values, RigValue::linear_spool_gain);
    case PlantKind::ehs:
      break;
  }
  return value_at(values, RigValue::rated_command);
}

/// The lag of the effects, or else that of the hidden spool; by Eq. (1) a linear servo has none.
template <class Scalar>
Spool<Scalar> ServoPlant<Scalar>::spool_of(PlantKind kind, const std::vector<Scalar>& values,
                                           const Effects<Scalar>& effects, double h) {
  SpoolLag<Scalar> lag{};
  Scalar slew(0.0);
  if (kind == PlantKind::ehs) {
    slew = value_at(values, Nuisance::spool_slew);
    lag = {value_at(values, Nuisance::spool_bandwidth), value_at(values, Nuisance::spool_damping)};
  }
  return Spool<Scalar>(effects.spool_lag(lag), slew, h);
}

template <class Scalar>
void ServoPlant<Scalar>::align(const std::array<double, kStates>& state) {
  const auto [position, velocity, pressure_a, pressure_b] = state;
  if (hanging_.active() && !std::isnan(velocity)) {
    hanging_.shift(velocity - velocity_now());
  }
  if (!std::isnan(position)) {
    const Scalar change = position - reading_;
    position_ += effects_.shift_sensor(change);
    reading_ = Scalar(position);
  }
  set_pressures(pressure_a, pressure_b);
  if (!std::isnan(velocity)) {
    start_at(Scalar(velocity));
  }
}

template <class Scalar>
void ServoPlant<Scalar>::set_pressures(double a, double b) {
  if (!sense_pressures_) {
    hydraulics_.set_pressures(a, b);
    return;
  }
  const auto missing = [](double measured, const Scalar& reading) {
    return std::isnan(measured) ? Scalar(0.0) : measured - reading;
  };
  const ChamberPressures<Scalar> change = effects_.shift_pressure_sensors(
      {missing(a, pressures_read_.a), missing(b, pressures_read_.b)});
  const auto [before_a, before_b] = chamber_pressures();
  const auto changed = [](double measured, const Scalar& before, const Scalar& by) {
    return std::isnan(measured) ? Scalar(measured) : before + by;
  };
  hydraulics_.set_pressures(changed(a, before_a, change.a), changed(b, before_b, change.b));
  pressures_read_ = {std::isnan(a) ? pressures_read_.a : Scalar(a),
                     std::isnan(b) ? pressures_read_.b : Scalar(b)};
}

template <class Scalar>
void ServoPlant<Scalar>::start_at(const Scalar& velocity) {
  velocity_ = velocity;
  const Balance now = balance(drive_force());
  const Term<Scalar> mass = inertia();
  Scalar damping = now.damping;
  if (tables_.act_on(Equation::mass)) {
    damping += mass.slope * velocity * 0.5;
  }
  velocity_ = velocity - (now.force - damping * velocity) * (0.5 * h_) / mass.value;
}

template <class Scalar>
typename ServoPlant<Scalar>::Balance ServoPlant<Scalar>::balance(const Scalar& drive) const {
  Balance now{drive - load(position_), viscous_};
  if (seals_.active()) {
    now.force -= seals_.force();
    now.damping += seals_.damping(velocity_);
  }
  if (hanging_.active()) {
    now.force += hanging_.force();
    now.damping += hanging_.damping();
  }
  if (tables_.act_on(Equation::force)) {
    const Term<Scalar> term = tables_.at(Equation::force, state(), Variable::velocity);
    now.force -= term.value;
    if (value_of(term.slope) > 0.0) {
      now.force += term.slope * velocity_;
      now.damping += term.slope;
    }
  }
  if (disturbances_.act_on(Equation::force)) {
    now.force -= disturbances_.at(Equation::force);
  }
  if (kind_ == PlantKind::ehs) {
    const bool beyond = value_of(position_) > value_of(stroke_);
    if (beyond || value_of(position_) < 0.0) {
      const double rate = stop_rate();
      now.force -= mass_ * (rate * rate) * (beyond ? position_ - stroke_ : position_);
      now.damping += mass_ * rate;
    }
  }
  return now;
}

template <class Scalar>
Scalar ServoPlant<Scalar>::accelerate(const Scalar& drive) const {
  const Balance now = balance(drive);
  // m (v+ - v-) / h = force - damping (v+ + v-) / 2 - m' v+ v- / 2
  const Term<Scalar> mass = inertia();
  const Scalar per_step = mass.value * (1.0 / h_);
  const Scalar half = now.damping * 0.5;
  Scalar ahead = per_step + half;
  if (tables_.act_on(Equation::mass)) {
    ahead += mass.slope * velocity_ * 0.5;
  }
  return (velocity_ * (per_step - half) + now.force) / ahead;
}

template <class Scalar>
double ServoPlant<Scalar>::fastest_rate() const {
  double stiffness_n_m = value_of(seals_.stiffness()) + value_of(effects_.contact().stiffness);
  if (kind_ == PlantKind::ehs) {
    stiffness_n_m += hydraulics_.stiffness();
  } else if (kind_ == PlantKind::linear) {
    stiffness_n_m += linear_.stiffness();
  }
  const double of_masses = hanging_.active() ? hanging_.fastest_rate(stiffness_n_m)
                                             : std::sqrt(stiffness_n_m / value_of(mass_));
  return kind_ == PlantKind::ehs ? (std::max)(of_masses, hydraulics_.line_rate()) : of_masses;
}

template <class Scalar>
Outputs<Scalar> ServoPlant<Scalar>::read() const {
  const Scalar none(std::numeric_limits<double>::quiet_NaN());
  Outputs<Scalar> now{reading_, velocity_now(), none, none, none, none};
  if (kind_ != PlantKind::axis) {
    now.spool = spool_.position();
  }
  if (kind_ == PlantKind::ehs) {
    const Pressures<Scalar>& pressure = hydraulics_.pressure();
    now.pressure_a = pressure.a;
    now.pressure_b = pressure.b;
    now.supply_pressure = pressure.supply;
    if (sense_pressures_) {
      now.pressure_a = pressures_read_.a;
      now.pressure_b = pressures_read_.b;
    }
  }
  now.position = effects_.store(now.position);
  return now;
}

template <class Scalar>
void ServoPlant<Scalar>::advance(double command_v) {
  if (commands_.size() <= sample_) {
    foresee(command_v);
  }

  const double share = 1.0 / substeps_;
  for (int i = 0; i < substeps_; ++i) {
    const double now = static_cast<double>(sample_) + i * share;
    // Half steps: the spool is wanted in the middle, where the flows are taken.
    time_ = now * h_ * substeps_;
    disturbances_.move_to(sample_, i * share);
    const Scalar first = arriving(now, 0.5 * share);
    const Scalar later = arriving(now + 0.5 * share, 0.5 * share);
    Scalar drive = drive_force();
    if (kind_ == PlantKind::axis) {
      // A force that jumps at the whole step counts by its mean over the half steps around it.
      motor_force_ = (first + later) * 0.5 * force_gain_;
      drive = (drive + motor_force_) * 0.5;
    }
    if (hanging_.active()) {
      const Scalar next = accelerate(drive);
      hanging_.advance(velocity_, next);
      velocity_ = next;
    } else {
      velocity_ = accelerate(drive);
    }
    const Scalar moved = velocity_ * h_;
    if (kind_ != PlantKind::axis) {
      const Scalar x_v = opening(spool_.advance(first));
      const double middle_time = time_ + 0.5 * h_;
      if (kind_ == PlantKind::ehs) {
        hydraulics_.advance(effects_, x_v, position_ + moved * 0.5, velocity_, middle_time, h_,
                            further_flows());
      } else {
        linear_.advance(effects_, x_v, velocity_, middle_time, h_);
      }
      spool_.advance(later);
    }
    if (seals_.active()) {
      const Sliding<Scalar> sliding{absolute<Scalar>(velocity_), value_of(velocity_) >= 0.0,
                                    position_ + moved * 0.5 - middle_};
      seals_.advance(velocity_, friction(sliding), h_);
    }
    position_ += moved;
    reading_ = with_error(effects_.sense(position_, h_));
    if (sense_pressures_) {
      pressures_read_ = effects_.sense_pressures(chamber_pressures(), h_);
    }
  }
  ++sample_;
}

/// Steps a sample of dt seconds for which the fastest oscillation (oil spring, seals before they slide) turns by at most
/// a third of a radian a step: about 0.1 % of its frequency. At least 2, at most 1000.
inline int recommended_substeps(PlantKind kind, const std::vector<double>& values, double dt) {
  const ServoPlant<double> plant(kind, values, dt, 1, 0);
  constexpr int kLeast = 2;
  constexpr int kMost = 1000;
  const double steps = std::ceil(plant.fastest_rate() * dt / kRadiansPerStep);
  return std::clamp(steps < kMost ? static_cast<int>(steps) : kMost, kLeast, kMost);
}

}  // namespace ehsid::plant
