// SPDX-License-Identifier: MIT
// What an effect of the catalogue is: a description that people and programs read, and the places of the
// simulation where it acts.
#pragma once

namespace ehsid::plant {

/// Where an effect belongs.
enum class Subsystem { valve, hydraulics, mechanics, sensor, timing };

/// A parameter of an effect, SI. 0 switches it off, whatever its range.
struct ParameterInfo {
  const char* name;
  const char* unit;  // "1" for a fraction
  double minimum;    // of the plausible range
  double maximum;
  double typical;  // a size that shows in an ordinary record
  const char* meaning;
};

/// An effect in words.
struct EffectInfo {
  const char* id;
  Subsystem subsystem;
  const char* equation;
  const char* source;
  const char* excitation;  // what shows it
};

/// Flows of a leakage, m^3/s: out of chamber A and out of chamber B.
template <class Scalar>
struct Leakage {
  Scalar from_a{};
  Scalar from_b{};
};

/// Linear dynamics of the spool; a bandwidth of zero means none.
template <class Scalar>
struct SpoolLag {
  Scalar bandwidth_hz{};
  Scalar damping{};
};

/// Supply line: resistance to the pump, and the volume behind the valve; a resistance of zero means none.
template <class Scalar>
struct SupplyLine {
  Scalar resistance{};   // Pa s/m^3
  Scalar capacitance{};  // m^3/Pa
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
/// acts at with its own functions; the plant asks all active effects, in the order of the catalogue.
template <class Scalar>
struct Effect {
  /// False where all parameters are zero and none is varied: the plant then passes the effect over.
  bool active = true;

  /// Scalar: delay of the command path, s.
  Nothing delay() const { return {}; }
  /// Scalar: the sampled command, as a fraction of rated command. Called once a sample, in order.
  Nothing command(const Scalar& /*u*/) { return {}; }
  /// SpoolLag: in place of the hidden spool.
  Nothing spool_lag() const { return {}; }
  /// Scalar: opening from spool position, both fractions of rated command.
  Nothing opening(const Scalar& /*x*/) const { return {}; }
  /// Scalar: overlap of the metering edges, fraction of rated command, each side of null.
  Nothing overlap() const { return {}; }
  /// Scalar: effective bulk modulus from that of the fluid, at an absolute pressure, Pa.
  Nothing bulk_modulus(const Scalar& /*beta*/, const Scalar& /*pressure*/) const { return {}; }
  /// SupplyLine.
  Nothing supply_line() const { return {}; }
  /// Leakage, at absolute pressures, Pa.
  Nothing leakage(const Scalar& /*p_a*/, const Scalar& /*p_b*/, const Scalar& /*p_tank*/) const {
    return {};
  }
  /// Scalar: steady friction of the seals at a speed, N, >= 0.
  Nothing friction(const Scalar& /*speed*/) const { return {}; }
  /// Scalar: force against extension, N, at a distance from mid-stroke, m.
  Nothing load(const Scalar& /*from_middle*/) const { return {}; }
  /// The sensor has rested at this position.
  void start_sensor(const Scalar& /*position*/) {}
  /// Scalar: what the sensor makes of the position, m. Called once a step of h seconds, in order.
  Nothing sense(const Scalar& /*position*/, double /*h*/) { return {}; }
  /// The reading changes by this much from here on: the sensor's memory moves with it.
  void shift_sensor(const Scalar& /*change*/) {}
  /// Scalar: what the record stores of the reading, m.
  Nothing store(const Scalar& /*reading*/) const { return {}; }
};

}  // namespace ehsid::plant
