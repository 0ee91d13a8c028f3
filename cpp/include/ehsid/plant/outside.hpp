// SPDX-License-Identifier: MIT
// The effects of the catalogue around a simulator that is not ours: what they do to its command and to its
// readings, and what they do through inputs for a force, for flows into the chambers and for the supply pressure.
//
//   command -> delay, play, rest -> lag -> bias, saturation, overlap -> + feedback -> simulator -> sensor
//
// The state of such a simulator cannot be set. Where a sample is `caught`, the position error is fed back into the
// command, behind the effects, so that the simulator comes to the measured position:
//   u = u_effects + gain (y_measured - y)
#pragma once

#include <ehsid/plant/catalogue.hpp>
#include <ehsid/plant/command_path.hpp>
#include <ehsid/plant/rig.hpp>
#include <ehsid/plant/simulate.hpp>
#include <ehsid/plant/spool.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace ehsid::plant {

/// What a simulator takes, SI. A force extends the rod, flows go into the chambers.
enum class OutsideInput : std::size_t { command, force, supply_pressure, flow_a, flow_b, count };
/// What it gives, SI. The flow is what the valve takes from the supply.
enum class OutsideOutput : std::size_t {
  position,
  velocity,
  pressure_a,
  pressure_b,
  supply_pressure,
  supply_flow,
  count
};
using OutsideInputs = std::array<double, static_cast<std::size_t>(OutsideInput::count)>;
/// NaN for what a simulator does not give.
using OutsideOutputs = std::array<double, static_cast<std::size_t>(OutsideOutput::count)>;

/// A simulator that somebody else wrote, at its start.
class OutsideSimulator {
 public:
  OutsideSimulator() = default;
  OutsideSimulator(const OutsideSimulator&) = delete;
  OutsideSimulator& operator=(const OutsideSimulator&) = delete;
  virtual ~OutsideSimulator() = default;

  /// Outputs now; false where it fails, after which it is not asked again.
  virtual bool read(OutsideOutputs& outputs) = 0;
  /// On by h seconds from a time, s, with these inputs held.
  virtual bool step(double time, double h, const OutsideInputs& inputs) = 0;
};

/// What a run needs to know besides the command.
struct OutsideRun {
  double dt = 1e-3;  // sampling time, s
  int substeps = 1;  // communication steps a sample
  std::vector<double>
      values;  // as plant_parameters(); of them rated command, stroke, supply, tank, null bias, effects
  SpoolLag<double> valve;  // of the simulator's own valve; a bandwidth of zero is unknown
  double gain = 0.0;       // of the feedback, V/m
  double mass = 0.0;       // that the force moves within a step, kg
  double stiffness_a =
      0.0;  // rise of a chamber's pressure over the volume that flows into it, Pa/m^3
  double stiffness_b = 0.0;
};

/// The command behind the effects of the command path, V, as means over each communication step.
///
/// The nonlinear effects of a valve lie behind its lag, and a wrapper in front of it. Where the lag of the simulator's own
/// valve is known, the effects act on the command behind such a lag, and what they change goes through its inverse:
///   u = x + e + (2 zeta / w) e' + e'' / w^2,   e = f(r) - r,   r = lag(x)
inline std::vector<double> outside_command(const OutsideRun& run, const double* command,
                                           std::size_t samples) {
  Effects<double> effects(run.values, kFirstOfEffects);
  const double rated = value_at(run.values, RigValue::rated_command);
  const double bias = value_at(run.values, Nuisance::null_bias);
  const double unequal = value_at(run.values, Nuisance::edge_gain_direction);
  const Overlap<double> overlap = effects.overlap();
  const double share = 1.0 / run.substeps;
  const double h = run.dt * share;
  CommandPath<double> path(effects.delay(), run.dt, samples);
  for (std::size_t k = 0; k < samples; ++k) {
    path.push(effects.command(command[k] / rated, run.dt));
  }
  Spool<double> lag(effects.spool_lag(), 0.0, 0.5 * h);
  Spool<double> own(run.valve, 0.0, 0.5 * h);
  const auto count = samples * static_cast<std::size_t>(run.substeps);
  std::vector<double> sent(count);
  std::vector<double> change(count);
  for (std::size_t j = 0; j < count; ++j) {
    const double now = static_cast<double>(j) * share;
    const double x = path.mean(now, share);
    // The mean of a step is that of its middle.
    sent[j] = lag.advance(x);
    lag.advance(x);
    const double r = own.advance(sent[j]);
    own.advance(sent[j]);
    double opening = effects.opening(r + bias);
    opening = opening > overlap.extending     ? opening - overlap.extending
              : opening < -overlap.retracting ? opening + overlap.retracting
                                              : 0.0;
    opening *= opening > 0.0 ? 1.0 + unequal : 1.0 - unequal;
    effects.flow_shares(now * run.dt, [&](double flow) { opening *= flow; });
    change[j] = opening - r;
  }
  constexpr double kTwoPi = 6.283185307179586;
  const double w = kTwoPi * run.valve.bandwidth_hz;
  const double first = w > 0.0 ? run.valve.damping / (w * h) : 0.0;  // of a central difference
  const double second = w > 0.0 ? 1.0 / (w * w * h * h) : 0.0;
  for (std::size_t j = 0; j < count; ++j) {
    const double before = change[j > 0 ? j - 1 : 0];
    const double after = change[j + 1 < count ? j + 1 : j];
    sent[j] += change[j] + first * (after - before) + second * (after - 2.0 * change[j] + before);
    sent[j] *= rated;
  }
  return sent;
}

/// What effects do at the inputs for force, flows and supply pressure.
class OutsidePorts {
 public:
  OutsidePorts(const OutsideRun& run, const Effects<double>& effects, double h)
      : run_(run),
        effects_(effects),
        h_(h),
        middle_(0.5 * value_at(run.values, RigValue::stroke)),
        source_(value_at(run.values, RigValue::supply_pressure)),
        tank_(value_at(run.values, RigValue::tank_pressure)),
        contact_(effects.contact()),
        line_(effects.supply_line()),
        supply_(source_) {}

  /// From the outputs at the start of a step, and the velocity there and a step before.
  void tell(const OutsideOutputs& now, double velocity, double before, OutsideInputs& inputs) {
    const double from_middle = at(now, OutsideOutput::position) - middle_;
    friction_ = friction(velocity, before, from_middle);
    put_at(
        inputs, OutsideInput::force,
        friction_ - effects_.load(from_middle) - contact_.force(at(now, OutsideOutput::position)));
    const double p_a = at(now, OutsideOutput::pressure_a);
    const double p_b = at(now, OutsideOutput::pressure_b);
    double from_a = 0.0;
    double from_b = 0.0;
    effects_.leakages(p_a, p_b, tank_, [&](const Leakage<double>& flows) {
      from_a += flows.from_a;
      from_b += flows.from_b;
    });
    put_at(inputs, OutsideInput::flow_a, -from_a * slowed(p_a, from_a, run_.stiffness_a));
    put_at(inputs, OutsideInput::flow_b, -from_b * slowed(p_b, from_b, run_.stiffness_b));
    if (line_.resistance > 0.0) {
      // Backward Euler: C p' = (source - p) / R - q
      const double rate = h_ / line_.capacitance;
      supply_ =
          (supply_ + rate * (source_ / line_.resistance - at(now, OutsideOutput::supply_flow))) /
          (1.0 + rate / line_.resistance);
    }
    put_at(inputs, OutsideInput::supply_pressure, supply_);
  }

 private:
  static double at(const OutsideOutputs& outputs, OutsideOutput which) {
    return outputs[static_cast<std::size_t>(which)];
  }
  static void put_at(OutsideInputs& inputs, OutsideInput which, double value) {
    inputs[static_cast<std::size_t>(which)] = value;
  }

  /// The force that would stop the mass within the step, as far as the seals can give it: positive extends. What else acts
  /// on the mass is what it was during the step before.
  double friction(double velocity, double before, double from_middle) const {
    const double to_stop = friction_ - run_.mass * (2.0 * velocity - before) / h_;
    const double most = effects_.friction({std::abs(velocity), to_stop < 0.0, from_middle});
    return std::clamp(to_stop, -most, most);
  }

  /// Share of a flow out of a chamber that is left over a step in which it changes the pressure: 1 / (1 + h S dq/dp).
  double slowed(double p, double flow, double stiffness) const {
    const double ahead = p - h_ * stiffness * flow;
    const double slope = effects_.leakage_slope(p, ahead, tank_);
    return 1.0 / (1.0 + h_ * stiffness * slope);
  }

  const OutsideRun& run_;
  const Effects<double>& effects_;
  double h_, middle_, source_, tank_;
  Contact<double> contact_;
  SupplyLine<double> line_;
  double friction_ = 0.0;
  double supply_;
};

/// Runs a simulator from its start over `samples` commands, V. measured: position, m, at each sample; caught: not zero
/// where the error is fed back over the sample. outputs: samples x kOutputs, in the order of kOutputNames; the spool is NaN.
/// Returns false where the simulator failed; the outputs from there on are NaN.
inline bool run_outside(OutsideSimulator& simulator, const OutsideRun& run, const double* command,
                        const double* measured, const std::uint8_t* caught, std::size_t samples,
                        double* outputs) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::fill(outputs, outputs + samples * kOutputs, kNone);
  const double h = run.dt / run.substeps;
  const std::vector<double> sent = outside_command(run, command, samples);
  Effects<double> effects(run.values, kFirstOfEffects);
  OutsidePorts ports(run, effects, h);
  OutsideOutputs now{};
  if (!simulator.read(now)) {
    return false;
  }
  const auto position = [&] { return now[static_cast<std::size_t>(OutsideOutput::position)]; };
  const auto given = [&] { return now[static_cast<std::size_t>(OutsideOutput::velocity)]; };
  double reading = effects.start_sensor(position());
  const auto pressures = [&]() -> ChamberPressures<double> {
    return {now[static_cast<std::size_t>(OutsideOutput::pressure_a)],
            now[static_cast<std::size_t>(OutsideOutput::pressure_b)]};
  };
  ChamberPressures<double> shown = effects.start_pressure_sensors(pressures());
  double velocity = std::isnan(given()) ? 0.0 : given();
  double before = velocity;
  std::size_t j = 0;
  for (std::size_t k = 0; k < samples; ++k) {
    double* const row = outputs + k * kOutputs;
    row[0] = effects.store(reading);
    row[1] = velocity;
    row[2] = shown.a;
    row[3] = shown.b;
    row[4] = now[static_cast<std::size_t>(OutsideOutput::supply_pressure)];
    for (int i = 0; i < run.substeps; ++i, ++j) {
      OutsideInputs inputs{};
      inputs[0] = sent[j];
      if (caught[k] != 0) {
        inputs[0] += run.gain * (measured[k] - reading);
      }
      ports.tell(now, velocity, before, inputs);
      const double position_before = position();
      if (!simulator.step(static_cast<double>(j) * h, h, inputs) || !simulator.read(now)) {
        return false;
      }
      before = velocity;
      velocity = std::isnan(given()) ? (position() - position_before) / h : given();
      reading = effects.sense(position(), h);
      shown = effects.sense_pressures(pressures(), h);
    }
  }
  return true;
}

}  // namespace ehsid::plant
