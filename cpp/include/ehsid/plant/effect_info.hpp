// SPDX-License-Identifier: MIT
// How an effect of the catalogue describes itself, beside its equation in code. The fits, the diagnosis, the rig
// checks, the injection into logs and the documents read it from here; no other place lists effects.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace ehsid::plant {

/// The part of the servo to which an effect belongs.
enum class Subsystem { valve, hydraulics, mechanics, sensor, timing };

/// How a fit may move a value: a normal prior and bounds.
struct Prior {
  /// Standard deviation: relative for a value of the rig, where its file says none; of a nuisance that of its logarithm
  /// or in its own unit.
  double sigma = 0.3;
  bool logarithmic = false;
  bool held = false;  // not moved: it defines others, or is measured with a ruler
  /// Bounds where the plausible range is too wide; NaN where it is not.
  double low = std::numeric_limits<double>::quiet_NaN();
  double high = std::numeric_limits<double>::quiet_NaN();
};

/// A parameter of the plant, SI. 0 switches an effect off, whatever its range.
struct ParameterInfo {
  const char* name;
  const char* unit;  // "1" for a fraction
  double minimum;    // of the plausible range
  double maximum;
  double typical;  // a size that shows in an ordinary record
  const char* meaning;
  /// Small changes of the outputs are proportional to c if the parameter is proportional to c^power; a power of zero
  /// is a parameter of the form of a law, which has no size.
  double power = 1.0;
  const char* called = "";    // for people, where the words of the name do not say enough
  const char* share_of = "";  // of what a value without a unit is a share
  Prior prior = {};
  double neutral = 0.0;  // where the law does nothing, too; not zero for a gain
};

/// Of what commands and openings of the valve are shares.
inline constexpr const char* kRatedCommand = "rated command";

/// An effect in words.
struct EffectInfo {
  const char* id;
  Subsystem subsystem;
  const char* equation;
  const char* source;
  const char* excitation;  // the motion or command that shows it
  const char* sensors;  // the measurements that show it, or that distinguish it from similar ones
  const char*
      least_size;  // what every servo has anyway, so that a smaller effect does not get a name
};

/// What a record must contain, so that it can show an effect.
enum class Need {
  command_reversals,
  motion_reversals,
  slow_motion,
  wide_travel,
  large_commands,
  commands_about_null,
  resting_commands,
  fast_commands,
  varying_pressures,
  long_record,
  high_pressures,
  low_pressures,
  chamber_pressures,  // both are measured
  another_output,     // another signal of the motion is measured besides the position
};

/// Where an effect can be put into a recorded log. An effect on the machine itself cannot: it changes the motion.
enum class LogPlace { none, command, command_of_axis, position, pressures };

/// Where a fitted size lies beyond what the records could show.
enum class Reach {
  all,             // every size shows
  begins_at,       // it begins where the command reaches its first parameter
  within,          // its parameters are widths that the command must leave
  sensor_noise,    // its first parameter must be above the noise of the position sensor
  high_pressures,  // it begins where a chamber reaches the pressure of its first parameter
  positions,       // it begins where the rod is at its first parameter
};

/// Largest values of a machine, the scales of its effects.
struct MachineScale {
  double force_n;          // of the drive
  double rated_flow_m3_s;  // of the valve, from its data sheet
  double
      full_flow_m3_s;  // at rated command and half of the supply pressure across each metering edge
  double pressure_pa;  // of the supply
  double stroke_m;     // NaN where unknown
  bool
      has_valve;  // forces of a cylinder are known from pressures, those of a motor from its command
};

/// The stroke, m, or `unknown` where it is not known.
inline double stroke_or(const MachineScale& machine, double unknown) {
  return std::isnan(machine.stroke_m) ? unknown : machine.stroke_m;
}

/// Values of the parameters of an effect, in their order.
template <std::size_t N>
using Sizes = std::array<double, N>;

}  // namespace ehsid::plant
