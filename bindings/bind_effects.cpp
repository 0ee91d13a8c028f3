// SPDX-License-Identifier: MIT
#include "bind_effects.hpp"

#include <ehsid/plant/description.hpp>
#include <ehsid/plant/parameters.hpp>

#include <pybind11/typing.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace ehsid::bindings {
namespace {

using plant::EffectDescription;
using plant::MachineScale;
using plant::SizeVector;

using Texts = py::typing::Tuple<py::str, py::ellipsis>;
using SizesByName = py::typing::Dict<py::str, py::float_>;
using OptionalText = py::typing::Optional<py::str>;

struct ShownParameter {
  std::string name;
  plant::ParameterInfo info;
};

const char* name_of(plant::Subsystem subsystem) {
  switch (subsystem) {
    case plant::Subsystem::valve:
      return "valve";
    case plant::Subsystem::hydraulics:
      return "hydraulics";
    case plant::Subsystem::mechanics:
      return "mechanics";
    case plant::Subsystem::sensor:
      return "sensor";
    case plant::Subsystem::timing:
      return "timing";
  }
  return "";
}

const char* name_of(plant::Need need) {
  switch (need) {
    case plant::Need::command_reversals:
      return "command_reversals";
    case plant::Need::motion_reversals:
      return "motion_reversals";
    case plant::Need::slow_motion:
      return "slow_motion";
    case plant::Need::wide_travel:
      return "wide_travel";
    case plant::Need::large_commands:
      return "large_commands";
    case plant::Need::commands_about_null:
      return "commands_about_null";
    case plant::Need::resting_commands:
      return "resting_commands";
    case plant::Need::fast_commands:
      return "fast_commands";
    case plant::Need::varying_pressures:
      return "varying_pressures";
    case plant::Need::long_record:
      return "long_record";
    case plant::Need::high_pressures:
      return "high_pressures";
    case plant::Need::low_pressures:
      return "low_pressures";
    case plant::Need::chamber_pressures:
      return "chamber_pressures";
    case plant::Need::another_output:
      return "another_output";
  }
  return "";
}

const char* name_of(plant::Reach reach) {
  switch (reach) {
    case plant::Reach::all:
      return "all";
    case plant::Reach::begins_at:
      return "begins_at";
    case plant::Reach::within:
      return "within";
    case plant::Reach::sensor_noise:
      return "sensor_noise";
    case plant::Reach::high_pressures:
      return "high_pressures";
    case plant::Reach::positions:
      return "positions";
  }
  return "";
}

const char* name_of(plant::LogPlace place) {
  switch (place) {
    case plant::LogPlace::none:
      return "none";
    case plant::LogPlace::command:
      return "command";
    case plant::LogPlace::command_of_axis:
      return "command_of_axis";
    case plant::LogPlace::position:
      return "position";
    case plant::LogPlace::pressures:
      return "pressures";
  }
  return "";
}

SizesByName by_name(const EffectDescription& effect, const SizeVector& sizes) {
  SizesByName all;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    all[effect.parameters[i].name] = sizes[i];
  }
  return all;
}

SizeVector in_order(const EffectDescription& effect, const SizesByName& sizes) {
  SizeVector all;
  for (const plant::ParameterInfo& parameter : effect.parameters) {
    if (!sizes.contains(parameter.name)) {
      throw py::value_error(std::string(effect.info.id) + ": the parameter '" + parameter.name +
                            "' is missing");
    }
    all.push_back(py::cast<double>(sizes[parameter.name]));
  }
  return all;
}

OptionalText text_or_none(const char* text) {
  return text == nullptr ? py::object(py::none()) : py::object(py::str(text));
}

/// The description of the effect that `effect` contains; ValueError where it contains none.
EffectDescription simpler_of(const EffectDescription& effect) {
  if (effect.contains != nullptr) {
    for (EffectDescription& other : plant::effect_descriptions()) {
      if (std::strcmp(other.info.id, effect.contains) == 0) {
        return std::move(other);
      }
    }
  }
  throw py::value_error(std::string(effect.info.id) + " contains no simpler effect");
}

py::tuple parameters_of(const EffectDescription& effect) {
  py::list all;
  for (const plant::ParameterInfo& info : effect.parameters) {
    all.append(shown_parameter(info.name, info));
  }
  return py::tuple(all);
}

py::typing::List<SizesByName> starts(const EffectDescription& effect, const MachineScale& machine) {
  py::list all;
  for (const SizeVector& sizes : effect.starts(machine)) {
    all.append(by_name(effect, sizes));
  }
  return all;
}

py::typing::Tuple<py::typing::Tuple<py::str, py::str>, py::ellipsis> not_below(
    const EffectDescription& effect) {
  py::list all;
  for (const auto& pair : effect.not_below) {
    all.append(py::make_tuple(effect.parameters[pair[0]].name, effect.parameters[pair[1]].name));
  }
  return py::tuple(all);
}

Texts names_of_needs(const EffectDescription& effect) {
  py::list all;
  for (const plant::Need need : effect.needs) {
    all.append(name_of(need));
  }
  return py::tuple(all);
}

Texts does_not_commute(const EffectDescription& effect) {
  py::list all;
  for (const char* const other : effect.does_not_commute) {
    all.append(other);
  }
  return py::tuple(all);
}

/// The terms that the effects add to the equations of the servo, at given values of all parameters.
class EffectTerms {
 public:
  explicit EffectTerms(const InputArray<double>& values)
      : effects_(checked(values), plant::kFirstOfEffects) {}

  double delay_s() const { return effects_.delay(); }
  std::pair<double, double> overlap() const {
    const plant::Overlap<double> overlap = effects_.overlap();
    return {overlap.extending, overlap.retracting};
  }
  std::pair<double, double> spool_lag() const {
    const plant::SpoolLag<double> lag = effects_.spool_lag();
    return {lag.bandwidth_hz, lag.damping};
  }
  std::pair<double, double> supply_line() const {
    const plant::SupplyLine<double> line = effects_.supply_line();
    return {line.resistance, line.capacitance};
  }
  std::tuple<double, double, double> pressure_line() const {
    const plant::PressureLine<double> line = effects_.pressure_line();
    return {line.frequency_hz, line.damping, line.volume_m3};
  }
  std::tuple<double, double, double> hanging_load() const {
    const plant::HangingLoad<double> load = effects_.hanging_load();
    return {load.mass_share, load.frequency_hz, load.damping};
  }
  std::pair<double, double> counterbalance() const {
    const plant::Counterbalance<double> valve = effects_.counterbalance();
    return {valve.pressure, valve.pilot_ratio};
  }
  std::pair<double, double> contact() const {
    const plant::Contact<double> contact = effects_.contact();
    return {contact.position, contact.stiffness};
  }
  std::pair<double, double> sensor_error() const {
    const plant::SensorError<double> error = effects_.sensor_error();
    return {error.lag_s, error.half_play_m};
  }

  py::array_t<double> command(const InputArray<double>& u, double dt_s) const {
    plant::Effects<double> memory = effects_;
    return each(u, [&](double now) { return memory.command(now, dt_s); });
  }
  py::array_t<double> sensor(const InputArray<double>& position, double dt_s) const {
    plant::Effects<double> memory = effects_;
    if (position.size() > 0) {
      memory.start_sensor(*position.data());
    }
    return each(position, [&](double now) { return memory.store(memory.sense(now, dt_s)); });
  }
  py::array_t<double> position_of(const InputArray<double>& reading) const {
    return each(reading, [&](double now) { return effects_.position_of(now); });
  }
  py::tuple pressure_sensors(const InputArray<double>& p_a, const InputArray<double>& p_b,
                             double dt_s) const {
    require_shape("pressure_a", p_a, 1, -1);
    require_shape("pressure_b", p_b, 1, p_a.shape(0));
    plant::Effects<double> memory = effects_;
    py::array_t<double> a(p_a.shape(0));
    py::array_t<double> b(p_a.shape(0));
    for (py::ssize_t k = 0; k < p_a.shape(0); ++k) {
      const plant::ChamberPressures<double> now{p_a.at(k), p_b.at(k)};
      const auto read =
          k == 0 ? memory.start_pressure_sensors(now) : memory.sense_pressures(now, dt_s);
      a.mutable_at(k) = read.a;
      b.mutable_at(k) = read.b;
    }
    return py::make_tuple(a, b);
  }
  py::array_t<double> opening(const InputArray<double>& x) const {
    return each(x, [&](double now) { return effects_.opening(now); });
  }
  py::array_t<double> flow_share(const InputArray<double>& time) const {
    return each(time, [&](double now) {
      double all = 1.0;
      effects_.flow_shares(now, [&](double share) { all *= share; });
      return all;
    });
  }
  py::array_t<double> friction(const InputArray<double>& velocity,
                               const InputArray<double>& from_middle) const {
    require_shape("velocity", velocity, 1, -1);
    require_shape("from_middle", from_middle, 1, velocity.shape(0));
    py::array_t<double> all(velocity.shape(0));
    for (py::ssize_t k = 0; k < velocity.shape(0); ++k) {
      const double v = velocity.at(k);
      all.mutable_at(k) = effects_.friction({std::abs(v), v >= 0.0, from_middle.at(k)});
    }
    return all;
  }
  py::array_t<double> load(const InputArray<double>& from_middle) const {
    return each(from_middle, [&](double now) { return effects_.load(now); });
  }
  py::array_t<double> bulk_modulus(double beta, const InputArray<double>& pressure) const {
    return each(pressure, [&](double now) { return effects_.bulk_modulus(beta, now); });
  }
  py::tuple leakage(const InputArray<double>& p_a, const InputArray<double>& p_b,
                    double p_tank) const {
    require_shape("pressure_a", p_a, 1, -1);
    require_shape("pressure_b", p_b, 1, p_a.shape(0));
    py::array_t<double> from_a(p_a.shape(0));
    py::array_t<double> from_b(p_a.shape(0));
    for (py::ssize_t k = 0; k < p_a.shape(0); ++k) {
      double& a = from_a.mutable_at(k) = 0.0;
      double& b = from_b.mutable_at(k) = 0.0;
      effects_.leakages(p_a.at(k), p_b.at(k), p_tank, [&](const plant::Leakage<double>& flows) {
        a += flows.from_a;
        b += flows.from_b;
      });
    }
    return py::make_tuple(from_a, from_b);
  }

 private:
  static std::vector<double> checked(const InputArray<double>& values) {
    require_shape("values", values, 1, static_cast<py::ssize_t>(plant::plant_parameters().size()));
    return {values.data(), values.data() + values.size()};
  }
  template <class Term>
  static py::array_t<double> each(const InputArray<double>& signal, Term term) {
    require_shape("signal", signal, 1, -1);
    py::array_t<double> all(signal.shape(0));
    std::transform(signal.data(), signal.data() + signal.size(), all.mutable_data(), term);
    return all;
  }

  plant::Effects<double> effects_;
};

void bind_descriptions(py::module_& m) {
  py::class_<ShownParameter>(m, "PlantParameter", "A parameter of the simulated plant, SI.")
      .def_readonly("name", &ShownParameter::name)
      .def_property_readonly(
          "unit", [](const ShownParameter& p) { return p.info.unit; }, "1 for a fraction.")
      .def_property_readonly("meaning", [](const ShownParameter& p) { return p.info.meaning; })
      .def_property_readonly(
          "minimum", [](const ShownParameter& p) { return p.info.minimum; },
          "Of the plausible range.")
      .def_property_readonly(
          "maximum", [](const ShownParameter& p) { return p.info.maximum; },
          "Of the plausible range.")
      .def_property_readonly("typical", [](const ShownParameter& p) { return p.info.typical; })
      .def_property_readonly(
          "power", [](const ShownParameter& p) { return p.info.power; },
          "Small changes of the outputs are proportional to c if it is proportional to c**power; 0 "
          "for the form of a law.")
      .def_property_readonly(
          "called", [](const ShownParameter& p) { return p.info.called; },
          "Name for people; empty where the words of `name` say enough.")
      .def_property_readonly(
          "neutral", [](const ShownParameter& p) { return p.info.neutral; },
          "Where an effect does nothing, besides zero: 1 for a gain, else 0.")
      .def_property_readonly(
          "share_of", [](const ShownParameter& p) { return p.info.share_of; },
          "Of what a value without a unit is a share; empty for no share.")
      .def_property_readonly(
          "sigma", [](const ShownParameter& p) { return p.info.prior.sigma; },
          "1-sigma of its prior in a fit, > 0: relative for a value of the rig, that of the "
          "logarithm "
          "for a logarithmic nuisance, else in its own unit.")
      .def_property_readonly(
          "logarithmic", [](const ShownParameter& p) { return p.info.prior.logarithmic; },
          "Whether the prior of a nuisance is one of its logarithm.")
      .def_property_readonly(
          "held", [](const ShownParameter& p) { return p.info.prior.held; },
          "Whether no fit moves it: it defines others, or is measured with a ruler.")
      .def_property_readonly(
          "fit_ends",
          [](const ShownParameter& p) {
            const plant::Prior& prior = p.info.prior;
            return py::typing::Tuple<double, double>(
                py::make_tuple(std::isnan(prior.low) ? p.info.minimum : prior.low,
                               std::isnan(prior.high) ? p.info.maximum : prior.high));
          },
          "Bounds in a fit: the plausible range, or less.")
      .def("__repr__",
           [](const py::object& self) { return show_properties(self, {"name", "unit"}); });
  py::class_<MachineScale>(m, "MachineScale",
                           R"(Largest values of a machine, the scales of its effects.

Parameters
----------
force_n : float
    Largest force of the drive, N.
rated_flow_m3_s : float
    Flow of the valve, m^3/s, from its data sheet.
full_flow_m3_s : float
    Its flow at rated command and half of the supply pressure across each metering edge, m^3/s.
pressure_pa : float
    Supply pressure, Pa.
stroke_m : float
    Stroke, m; NaN where it is unknown.
has_valve : bool
    False for a motor, whose force follows from its command.)")
      .def(py::init([](double force_n, double rated_flow_m3_s, double full_flow_m3_s,
                       double pressure_pa, double stroke_m, bool has_valve) {
             return MachineScale{force_n,     rated_flow_m3_s, full_flow_m3_s,
                                 pressure_pa, stroke_m,        has_valve};
           }),
           py::kw_only(), py::arg("force_n"), py::arg("rated_flow_m3_s"), py::arg("full_flow_m3_s"),
           py::arg("pressure_pa"), py::arg("stroke_m"), py::arg("has_valve"))
      .def_readonly("force_n", &MachineScale::force_n)
      .def_readonly("rated_flow_m3_s", &MachineScale::rated_flow_m3_s)
      .def_readonly("full_flow_m3_s", &MachineScale::full_flow_m3_s)
      .def_readonly("pressure_pa", &MachineScale::pressure_pa)
      .def_readonly("stroke_m", &MachineScale::stroke_m)
      .def_readonly("has_valve", &MachineScale::has_valve);

  using Text = const char* plant::EffectInfo::*;
  py::class_<EffectDescription> info(
      m, "EffectInfo",
      "An effect of the catalogue. Sizes are dictionaries by the names of its own parameters, SI.");
  const auto text = [&](const char* name, Text which, const char* doc) {
    info.def_property_readonly(
        name, [which](const EffectDescription& effect) { return effect.info.*which; }, doc);
  };
  text("id", &plant::EffectInfo::id, "Name in rigs, records and reports.");
  info.def_property_readonly(
      "subsystem", [](const EffectDescription& e) { return name_of(e.info.subsystem); },
      "valve, hydraulics, mechanics, sensor or timing.");
  text("equation", &plant::EffectInfo::equation, "Its law.");
  text("source", &plant::EffectInfo::source, "Where the law is published.");
  text("excitation", &plant::EffectInfo::excitation, "What shows the effect in a record.");
  text("sensors", &plant::EffectInfo::sensors, "The measurements that show it.");
  text("least_size", &plant::EffectInfo::least_size,
       "What every servo has anyway, so that a smaller effect does not get a name.");
  info.def_property_readonly("parameters", &parameters_of, "Tuple of PlantParameter; zero is off.")
      .def_property_readonly("needs", &names_of_needs,
                             "What a record must contain to show it, as words of Need.")
      .def_property_readonly(
          "reach", [](const EffectDescription& e) { return name_of(e.reach); },
          "What bounds the sizes that a record shows: all, begins_at, within, sensor_noise, "
          "high_pressures or positions.")
      .def_property_readonly(
          "contains", [](const EffectDescription& e) { return text_or_none(e.contains); },
          "Id of the simpler effect that it contains, or None.")
      .def_property_readonly(
          "together_with", [](const EffectDescription& e) { return text_or_none(e.together_with); },
          "Id of an effect that, together with the one it contains, acts nearly as it does, or "
          "None.")
      .def_property_readonly(
          "nuisance", [](const EffectDescription& e) { return text_or_none(e.nuisance); },
          "Full names of the nuisances that stand for it within tolerances, with spaces between "
          "them, or "
          "None.")
      .def_property_readonly(
          "not_below", &not_below,
          "Pairs of names of parameters of which the first must not be below the second.")
      .def_property_readonly(
          "log_place", [](const EffectDescription& e) { return name_of(e.log_place); },
          "Where it can be put into a log: none, command, command_of_axis, position or "
          "pressures.")
      .def_property_readonly("does_not_commute", &does_not_commute,
                             "Ids of the effects with which it does not commute in a log.")
      .def("starts", &starts, py::arg("machine"),
           "Sizes at which a fit starts: list of dict; empty where the record shows it without.")
      .def(
          "matters",
          [](const EffectDescription& effect, const SizesByName& sizes,
             const MachineScale& machine) {
            return effect.matters(in_order(effect, sizes), machine);
          },
          py::arg("sizes"), py::arg("machine"),
          "Whether this is more than a servo without the effect has anyway, see least_size.")
      .def(
          "simplified",
          [](const EffectDescription& effect, const SizesByName& sizes) {
            const EffectDescription simpler = simpler_of(effect);
            return by_name(simpler, effect.simplified(in_order(effect, sizes)));
          },
          py::arg("sizes"),
          "Sizes of the simpler effect that is nearest; ValueError where it contains none.")
      .def(
          "same",
          [](const EffectDescription& effect, const SizesByName& simple) {
            const EffectDescription simpler = simpler_of(effect);
            return by_name(effect, effect.same(in_order(simpler, simple)));
          },
          py::arg("simple"),
          "Sizes at which it acts as the simpler effect does; ValueError where it contains none.")
      .def(
          "grown",
          [](const EffectDescription& effect, const SizesByName& simple,
             const MachineScale& machine) {
            const EffectDescription simpler = simpler_of(effect);
            py::typing::List<SizesByName> all;
            for (const SizeVector& sizes : effect.grown(in_order(simpler, simple), machine)) {
              all.append(by_name(effect, sizes));
            }
            return all;
          },
          py::arg("simple"), py::arg("machine"),
          "Sizes at which a fit starts, from those of the simpler effect: list of dict; ValueError "
          "where it contains none.")
      .def("__repr__", [](const py::object& self) { return show_properties(self, {"id"}); });
  m.def(
      "effects", [] { return py::tuple(py::cast(plant::effect_descriptions())); },
      "The catalogue: a tuple of EffectInfo, in the order in which they act.");
}

void bind_terms(py::module_& m) {
  py::class_<EffectTerms>(
      m, "EffectTerms",
      R"(What the effects add to the equations of the servo, for measured signals.

Parameters
----------
values : array_like, shape (P,)
    In the order of plant_parameters(). Effects whose parameters are all zero add nothing.

Raises
------
ValueError
    A wrong shape; all methods, too.)")
      .def(py::init<const InputArray<double>&>(), py::arg("values"))
      .def_property_readonly("delay_s", &EffectTerms::delay_s, "Delay of the command path, s.")
      .def_property_readonly(
          "overlap", &EffectTerms::overlap,
          "Overlaps of the metering edges that extend and of those that retract, fractions "
          "of rated command.")
      .def_property_readonly("spool_lag", &EffectTerms::spool_lag,
                             "Bandwidth of the spool, Hz, and damping ratio; zeros for none.")
      .def_property_readonly("supply_line", &EffectTerms::supply_line,
                             "Resistance, Pa s/m^3, and capacitance, m^3/Pa; zeros for none.")
      .def_property_readonly("pressure_line", &EffectTerms::pressure_line,
                             "Frequency of the oil in the pressure line, Hz, damping ratio, and "
                             "volume in front of the valve, m^3; zeros for none.")
      .def_property_readonly("hanging_load", &EffectTerms::hanging_load,
                             "Share of the mass that hangs on the rod, its frequency with the rod "
                             "fixed, Hz, and damping ratio; zeros for none.")
      .def_property_readonly("counterbalance", &EffectTerms::counterbalance,
                             "Pressure, Pa, at which a counterbalance valve opens without its "
                             "pilot, and the ratio of its pilot; zeros for none.")
      .def_property_readonly("contact", &EffectTerms::contact,
                             "Position, m, from which on the rod presses on something, and its "
                             "stiffness, N/m; zeros for nothing.")
      .def_property_readonly("sensor_error", &EffectTerms::sensor_error,
                             "Lag, s, and half of the play, m, of the position sensor.")
      .def("command", &EffectTerms::command, py::arg("command"), py::arg("dt_s"),
           "The sampled command, fraction of rated command, as the spool follows it; from rest, "
           "shape (N,).")
      .def("sensor", &EffectTerms::sensor, py::arg("position_m"), py::arg("dt_s"),
           "What the record stores of a position, m, that rested before the first sample and runs "
           "straight from "
           "sample to sample, shape (N,).")
      .def("position_of", &EffectTerms::position_of, py::arg("reading_m"),
           "Position, m, for which the sensor gives a reading, but for its lag and its play, shape "
           "(N,).")
      .def("pressure_sensors", &EffectTerms::pressure_sensors, py::arg("pressure_a_pa"),
           py::arg("pressure_b_pa"), py::arg("dt_s"),
           "Readings of the chamber pressures, Pa, that rested before the first sample and run "
           "straight from sample to sample, shape (N,) each.")
      .def("opening", &EffectTerms::opening, py::arg("spool"),
           "Opening from the spool position, fractions, shape (N,).")
      .def("flow_share", &EffectTerms::flow_share, py::arg("time_s"),
           "Share of the flow at the start of the record that the edges give at times after it, "
           "shape (N,).")
      .def("friction", &EffectTerms::friction, py::arg("velocity_m_s"), py::arg("from_middle_m"),
           "Size of the steady friction, N, >= 0, at velocities and at distances from mid-stroke, "
           "shape (N,).")
      .def("load", &EffectTerms::load, py::arg("from_middle_m"),
           "Force against extension, N, at distances from mid-stroke, shape (N,).")
      .def("bulk_modulus", &EffectTerms::bulk_modulus, py::arg("beta_pa"), py::arg("pressure_pa"),
           "Bulk modulus, Pa, from that of the fluid, at absolute pressures, shape (N,).")
      .def("leakage", &EffectTerms::leakage, py::arg("pressure_a_pa"), py::arg("pressure_b_pa"),
           py::arg("tank_pressure_pa"),
           "Flows out of the chambers A and B, m^3/s, at absolute pressures, shape (N,) each.");
}

}  // namespace

py::object shown_parameter(const std::string& name, const plant::ParameterInfo& info) {
  return py::cast(ShownParameter{name, info});
}

void bind_effects(py::module_& m) {
  bind_descriptions(m);
  bind_terms(m);
}

}  // namespace ehsid::bindings
