// SPDX-License-Identifier: MIT
// Base of the effects of the catalogue: the places of the simulation where an effect can act, and how it describes
// itself (effect_info.hpp) where it does not say otherwise.
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect_info.hpp>

#include <array>
#include <cstddef>

namespace ehsid::plant {

/// Flows of a leakage, m^3/s: out of chamber A and out of chamber B.
template <class Scalar>
struct Leakage {
  Scalar from_a{};
  Scalar from_b{};
};

/// Share of the way from x to `ahead` that lies beyond `edge`; all of it where x is beyond it already.
template <class Scalar>
Scalar share_beyond(const Scalar& x, const Scalar& ahead, const Scalar& edge) {
  if (value_of(x) > value_of(edge)) {
    return Scalar(1.0);
  }
  return value_of(ahead) > value_of(edge) ? (ahead - edge) / (ahead - x) : Scalar(0.0);
}

/// Linear dynamics of the spool; a bandwidth of zero means none.
template <class Scalar>
struct SpoolLag {
  Scalar bandwidth_hz{};
  Scalar damping{};
};

/// How far the spool moves from null before an edge opens, fractions of rated command, >= 0.
template <class Scalar>
struct Overlap {
  Scalar extending{};   // of the edges that extend: supply to A, B to tank
  Scalar retracting{};  // of those that retract: supply to B, A to tank

  Overlap& operator+=(const Overlap& other) {
    extending += other.extending;
    retracting += other.retracting;
    return *this;
  }
};

/// Supply line: resistance to the pump, and the volume behind the valve; a resistance of zero means none.
template <class Scalar>
struct SupplyLine {
  Scalar resistance{};   // Pa s/m^3
  Scalar capacitance{};  // m^3/Pa
};

/// Valves at the working ports that hold back returning oil; a pressure of zero means none.
template <class Scalar>
struct Counterbalance {
  Scalar pressure{};  // at which one opens without its pilot, Pa
  Scalar pilot_ratio{};

  /// Share of its opening that a valve has at rest, at the pressure of its own chamber and of the other one.
  Scalar share(const Scalar& own, const Scalar& other) const {
    constexpr double kWide = 0.2;  // of the pressure, from closed to wide open
    return clamp<Scalar>((own + pilot_ratio * other - pressure) / (pressure * kWide), Scalar(0.0),
                         Scalar(1.0));
  }
};

/// How the rod moves on its seals.
template <class Scalar>
struct Sliding {
  Scalar speed;  // m/s, >= 0
  bool extends;
  Scalar from_middle;  // distance from mid-stroke, m
};

/// Absolute pressures of the chambers, or readings of them, Pa.
template <class Scalar>
struct ChamberPressures {
  Scalar a{};
  Scalar b{};
};

/// Oil that swings between the supply and the valve; a frequency of zero means none.
template <class Scalar>
struct PressureLine {
  Scalar frequency_hz{};
  Scalar damping{};
  Scalar volume_m3{};  // in front of the valve
};

/// Part of the mass that hangs on the rod; a share of zero means none.
template <class Scalar>
struct HangingLoad {
  Scalar mass_share{};
  Scalar frequency_hz{};  // with the rod fixed
  Scalar damping{};
};

/// Something elastic that the rod meets at a position; a stiffness of zero means nothing.
template <class Scalar>
struct Contact {
  Scalar position{};   // m
  Scalar stiffness{};  // N/m

  /// Against extension, N.
  Scalar force(const Scalar& y) const {
    return value_of(y) > value_of(position) ? stiffness * (y - position) : Scalar(0.0);
  }
};

/// How a reading lags behind the position and plays about it.
template <class Scalar>
struct SensorError {
  Scalar lag_s{};
  Scalar half_play_m{};
};

/// Answer of an effect that does not act at a place.
struct Nothing {};

template <class Value>
void add(Value& sum, const Value& term) {
  sum += term;
}
template <class Value>
void add(Value& /*sum*/, Nothing /*term*/) {}

template <class Value>
void put(Value& place, const Value& value) {
  place = value;
}
template <class Value>
void put(Value& /*place*/, Nothing /*value*/) {}

/// Base of all effects: every place where an effect can act, with nothing happening. An effect hides the places it
/// acts at with its own functions; the plant asks all active effects, in the order of the catalogue. Every effect has
/// besides
///   kInfo        EffectInfo;
///   kParameters  std::array<ParameterInfo, N>, and their values, `parameters`;
///   starts(m)    std::array<Sizes<N>, K>: sizes at which a fit starts on a machine of scale m, mostly a small and a
///                large one, so that one of them is within a factor of two or three of any relevant size. The cost of a
///                fit has no gradient with respect to an effect that is off. K = 0: the record shows it without a fit;
///   matters(sizes, m)  whether it is more than a servo without it has anyway: kInfo.least_size says what that is.
template <class Scalar>
struct Effect {
  /// False where all parameters are zero and none is varied: the plant then passes the effect over.
  bool active = true;

  /// Scalar: delay of the command path, s.
  Nothing delay() const { return {}; }
  /// Scalar: the sampled command, as a fraction of rated command. Called once a sample of dt seconds, in order.
  Nothing command(const Scalar& /*u*/, double /*dt*/) { return {}; }
  /// SpoolLag: in place of the hidden spool.
  Nothing spool_lag() const { return {}; }
  /// Scalar: opening from spool position, both fractions of rated command.
  Nothing opening(const Scalar& /*x*/) const { return {}; }
  /// Overlap of the metering edges.
  Nothing overlap() const { return {}; }
  /// Scalar: share of the flow at the start of the record that an edge gives, s after it.
  Nothing flow_share(double /*time*/) const { return {}; }
  /// Scalar: effective bulk modulus from that of the fluid, at an absolute pressure, Pa.
  Nothing bulk_modulus(const Scalar& /*beta*/, const Scalar& /*pressure*/) const { return {}; }
  /// SupplyLine.
  Nothing supply_line() const { return {}; }
  /// PressureLine, behind the accumulator of the supply line.
  Nothing pressure_line() const { return {}; }
  /// Leakage, at absolute pressures, Pa.
  Nothing leakage(const Scalar& /*p_a*/, const Scalar& /*p_b*/, const Scalar& /*p_tank*/) const {
    return {};
  }
  /// Scalar, >= 0: mean slope of a steep leakage out of either chamber over its own pressure, on the way from p to the
  /// pressure `ahead`, m^3/(s Pa). It keeps the integration stable, however steep the leakage.
  Nothing leakage_slope(const Scalar& /*p*/, const Scalar& /*ahead*/,
                        const Scalar& /*p_tank*/) const {
    return {};
  }
  /// Counterbalance.
  Nothing counterbalance() const { return {}; }
  /// Scalar: steady friction of the seals, N, >= 0.
  Nothing friction(const Sliding<Scalar>& /*now*/) const { return {}; }
  /// Scalar: force against extension, N, at a distance from mid-stroke, m.
  Nothing load(const Scalar& /*from_middle*/) const { return {}; }
  /// Contact.
  Nothing contact() const { return {}; }
  /// HangingLoad.
  Nothing hanging_load() const { return {}; }
  /// Scalar: what the sensor makes of a position at which it has rested, m.
  Nothing start_sensor(const Scalar& /*position*/) { return {}; }
  /// Scalar: what the sensor makes of the position, m. Called once a step of h seconds, in order.
  Nothing sense(const Scalar& /*position*/, double /*h*/) { return {}; }
  /// Scalar: by how much the position must change, m, for what sense() makes of it to change by this much. The sensor's
  /// memory moves along. Called in reversed order.
  Nothing shift_sensor(const Scalar& /*change*/) { return {}; }
  /// Scalar: what the record stores of the reading, m.
  Nothing store(const Scalar& /*reading*/) const { return {}; }
  /// Scalar: position for which sense() would give a reading, where it has no memory.
  Nothing position_of(const Scalar& /*reading*/) const { return {}; }
  /// SensorError: how sense() is undone, nearly, on a measured position, where it has a memory.
  Nothing sensor_error() const { return {}; }

  /// ChamberPressures: what their sensors make of pressures at which they have rested.
  Nothing start_pressure_sensors(const ChamberPressures<Scalar>& /*p*/) { return {}; }
  /// ChamberPressures: what their sensors make of them. Called once a step of h seconds, in order.
  Nothing sense_pressures(const ChamberPressures<Scalar>& /*p*/, double /*h*/) { return {}; }
  /// ChamberPressures: as shift_sensor(), of the sensors of the pressures.
  Nothing shift_pressure_sensors(const ChamberPressures<Scalar>& /*change*/) { return {}; }

  /// All that a record needs in order to show the effect.
  static constexpr std::array<Need, 0> kNeeds{};
  static constexpr Reach kReach = Reach::all;
  /// Id of the simpler effect which this one becomes if a term is removed; then it has
  /// simplified(), same() and grown(), too.
  static constexpr const char* kContains = nullptr;
  /// Id of an effect that, together with the one of kContains, acts nearly as this one does.
  static constexpr const char* kTogetherWith = nullptr;
  /// The nuisance that stands for the effect within the tolerance of any servo; several with spaces between them.
  static constexpr const char* kNuisance = nullptr;
  /// Pairs of parameters of which the first must not be below the second, by their places.
  static constexpr std::array<std::array<std::size_t, 2>, 0> kNotBelow{};
  static constexpr LogPlace kLogPlace = LogPlace::none;
  /// Effects of the same machine with which it does not commute where it is put into a log.
  static constexpr std::array<const char*, 0> kDoesNotCommute{};
};

}  // namespace ehsid::plant
