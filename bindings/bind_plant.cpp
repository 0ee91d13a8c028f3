// SPDX-License-Identifier: MIT
#include "bindings.hpp"

#include <ehsid/plant/parameters.hpp>
#include <ehsid/plant/play.hpp>
#include <ehsid/plant/simulate.hpp>

#include <algorithm>
#include <atomic>
#include <thread>

namespace ehsid::bindings {
namespace {

using plant::PlantKind;

struct ShownParameter {
  std::string name, unit, meaning;
  double minimum, maximum, typical;
};

ShownParameter shown(const std::string& name, const plant::ParameterInfo& info) {
  return {name, info.unit, info.meaning, info.minimum, info.maximum, info.typical};
}

struct ShownEffect {
  std::string id, subsystem, equation, source, excitation;
  py::tuple parameters;
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

py::tuple effects() {
  py::list all;
  plant::for_each_effect([&](const plant::EffectInfo& info, const auto& parameters) {
    py::list shown_parameters;
    for (const plant::ParameterInfo& parameter : parameters) {
      shown_parameters.append(shown(parameter.name, parameter));
    }
    all.append(ShownEffect{info.id, name_of(info.subsystem), info.equation, info.source,
                           info.excitation, py::tuple(shown_parameters)});
  });
  return py::tuple(all);
}

py::tuple parameters() {
  py::list all;
  for (const plant::PlantParameter& parameter : plant::plant_parameters()) {
    all.append(shown(parameter.name, parameter.info));
  }
  return py::tuple(all);
}

PlantKind kind_of(const std::string& name) {
  if (name == "ehs") {
    return PlantKind::ehs;
  }
  if (name == "axis") {
    return PlantKind::axis;
  }
  if (name == "linear") {
    return PlantKind::linear;
  }
  throw py::value_error("plant must be 'ehs', 'axis' or 'linear', got '" + name + "'");
}

void require_finite(const char* name, const InputArray<double>& array) {
  const double* const values = array.data();
  for (py::ssize_t i = 0; i < array.size(); ++i) {
    if (!is_finite(values[i])) {
      throw py::value_error(std::string(name) + " must be finite, entry " + std::to_string(i) +
                            " is not");
    }
  }
}

void require_sampling_time(double dt_s) {
  if (!is_finite(dt_s) || !(dt_s > 0.0)) {
    throw py::value_error("dt_s must be finite and > 0");
  }
}

/// The runs of one call, handed out to as many threads as are worth it.
void run_all(const std::vector<plant::Simulation>& runs, const double* command,
             const double* aligned, std::size_t samples, double* outputs, double* sensitivities,
             std::size_t threads) {
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < runs.size(); i = next++) {
      const std::size_t size = samples * plant::kOutputs;
      double* const partials =
          sensitivities == nullptr ? nullptr : sensitivities + i * size * runs[i].varied.size();
      plant::simulate(runs[i], command, aligned, samples, outputs + i * size, partials);
    }
  };
  std::vector<std::thread> others;
  for (std::size_t i = 1; i < std::min(threads, runs.size()); ++i) {
    others.emplace_back(work);
  }
  work();
  for (std::thread& other : others) {
    other.join();
  }
}

py::tuple simulate(const std::string& kind, const InputArray<double>& values, const py::object& u,
                   double dt_s, int substeps, const std::vector<std::size_t>& varied,
                   const py::object& aligned, std::size_t threads) {
  const std::size_t count = plant::plant_parameters().size();
  require_shape("values", values, 2, static_cast<py::ssize_t>(count));
  const auto command = real_array<double>("command", u);
  require_shape("command", command, 1, -1);
  require_finite("command", command);
  const py::ssize_t samples = command.shape(0);
  InputArray<double> targets;
  if (!aligned.is_none()) {
    targets = real_array<double>("aligned", aligned);
    require_exactly("aligned", targets, py::make_tuple(samples, plant::kStates));
  }
  require_sampling_time(dt_s);
  require_range("substeps", substeps, 1, 1000);
  for (const std::size_t index : varied) {
    if (index >= count) {
      throw py::value_error("varied: " + std::to_string(index) + " is not below " +
                            std::to_string(count) + ", the number of parameters");
    }
  }
  const py::ssize_t sets = values.shape(0);
  std::vector<plant::Simulation> runs;
  for (py::ssize_t i = 0; i < sets; ++i) {
    const double* const first = values.data(i, 0);
    runs.push_back({kind_of(kind), dt_s, substeps, {first, first + count}, varied});
  }
  const auto columns = static_cast<py::ssize_t>(plant::kOutputs);
  const auto wanted = static_cast<py::ssize_t>(varied.size());
  py::array_t<double> outputs({sets, samples, columns});
  py::array_t<double> sensitivities({sets, samples, wanted, columns});
  double* const out = outputs.mutable_data();
  double* const partials = wanted > 0 ? sensitivities.mutable_data() : nullptr;
  const double* const commands = command.data();
  const double* const positions = aligned.is_none() ? nullptr : targets.data();
  if (threads == 0) {
    threads = std::max(1U, std::thread::hardware_concurrency());
  }
  {
    const py::gil_scoped_release release;
    run_all(runs, commands, positions, static_cast<std::size_t>(samples), out, partials, threads);
  }
  return py::make_tuple(outputs, sensitivities);
}

py::array_t<double> play(const py::object& u, double half_width, double start) {
  const auto signal = real_array<double>("signal", u);
  require_shape("signal", signal, 1, -1);
  if (!is_finite(half_width) || half_width < 0.0) {
    throw py::value_error("half_width must be finite and >= 0");
  }
  const double* const values = signal.data();
  py::array_t<double> output(signal.size());
  double* const out = output.mutable_data();
  double held = start;
  for (py::ssize_t k = 0; k < signal.size(); ++k) {
    held = plant::play(held, values[k], half_width);
    out[k] = held;
  }
  return output;
}

/// A plant that somebody else clocks: a controller, a target.
class SteppedPlant {
 public:
  SteppedPlant(const std::string& kind, const InputArray<double>& values, double dt_s, int substeps)
      : plant_(kind_of(kind), checked_values(values), checked_time(dt_s),
               checked_substeps(substeps), 0) {}

  py::array_t<double> read() const {
    py::array_t<double> row(static_cast<py::ssize_t>(plant::kOutputs));
    write(plant_.read(), row.mutable_data());
    return row;
  }

  py::array_t<double> run(const py::object& u) {
    const auto command = real_array<double>("command", u);
    require_shape("command", command, 1, -1);
    require_finite("command", command);
    const py::ssize_t samples = command.shape(0);
    py::array_t<double> outputs({samples, static_cast<py::ssize_t>(plant::kOutputs)});
    const double* const commands = command.data();
    double* const out = outputs.mutable_data();
    {
      const py::gil_scoped_release release;
      for (py::ssize_t k = 0; k < samples; ++k) {
        write(plant_.read(), out + k * static_cast<py::ssize_t>(plant::kOutputs));
        plant_.advance(commands[k]);
      }
    }
    return outputs;
  }

  void advance(double command_v) {
    if (!is_finite(command_v)) {
      throw py::value_error("command_v must be finite");
    }
    plant_.advance(command_v);
  }

 private:
  static void write(const plant::Outputs<double>& now, double* out) {
    const double numbers[] = {now.position,   now.velocity,        now.pressure_a,
                              now.pressure_b, now.supply_pressure, now.spool};
    std::copy(std::begin(numbers), std::end(numbers), out);
  }
  static std::vector<double> checked_values(const InputArray<double>& values) {
    require_shape("values", values, 1, static_cast<py::ssize_t>(plant::plant_parameters().size()));
    return {values.data(), values.data() + values.size()};
  }
  static double checked_time(double dt_s) {
    require_sampling_time(dt_s);
    return dt_s;
  }
  static int checked_substeps(int substeps) {
    require_range("substeps", substeps, 1, 1000);
    return substeps;
  }

  plant::ServoPlant<double> plant_;
};

int substeps_for(const std::string& kind, const InputArray<double>& values, double dt_s) {
  const auto count = static_cast<py::ssize_t>(plant::plant_parameters().size());
  require_shape("values", values, 1, count);
  require_sampling_time(dt_s);
  return plant::recommended_substeps(kind_of(kind), {values.data(), values.data() + count}, dt_s);
}

}  // namespace

void bind_plant(py::module_& m) {
  py::class_<ShownParameter>(m, "PlantParameter", "A parameter of the simulated plant, SI.")
      .def_readonly("name", &ShownParameter::name)
      .def_readonly("unit", &ShownParameter::unit, "1 for a fraction.")
      .def_readonly("meaning", &ShownParameter::meaning)
      .def_readonly("minimum", &ShownParameter::minimum, "Of the plausible range.")
      .def_readonly("maximum", &ShownParameter::maximum, "Of the plausible range.")
      .def_readonly("typical", &ShownParameter::typical)
      .def("__repr__",
           [](const py::object& self) { return show_properties(self, {"name", "unit"}); });
  py::class_<ShownEffect>(m, "EffectInfo", "An effect of the catalogue, in words.")
      .def_readonly("id", &ShownEffect::id)
      .def_readonly("subsystem", &ShownEffect::subsystem,
                    "valve, hydraulics, mechanics, sensor or timing.")
      .def_readonly("equation", &ShownEffect::equation)
      .def_readonly("source", &ShownEffect::source)
      .def_readonly("excitation", &ShownEffect::excitation, "What shows the effect in a record.")
      .def_readonly("parameters", &ShownEffect::parameters, "Tuple of PlantParameter; zero is off.")
      .def("__repr__", [](const py::object& self) { return show_properties(self, {"id"}); });
  m.def("effects", &effects,
        "The catalogue: a tuple of EffectInfo, in the order in which they act.");
  m.def("plant_parameters", &parameters,
        "Everything the plant can be told: a tuple of PlantParameter in the order of `values`.");
  py::class_<SteppedPlant>(m, "Plant",
                           R"(The simulated plant, sample by sample: for a controller in the loop.

Parameters
----------
plant : "ehs", "axis" or "linear"
values : array_like, shape (P,)
    In the order of plant_parameters(). Zero switches an effect off.
dt_s : float > 0
    Sampling time, s.
substeps : int in 1..1000
    Steps of integration a sample, see plant_substeps().

Raises
------
ValueError
    A wrong shape, or a number outside its range.)")
      .def(py::init<const std::string&, const InputArray<double>&, double, int>(), py::arg("plant"),
           py::arg("values"), py::kw_only(), py::arg("dt_s"), py::arg("substeps") = 2)
      .def("read", &SteppedPlant::read,
           "Outputs now, shape (6,), as simulate_plant(); the next command is not in them.")
      .def("advance", &SteppedPlant::advance, py::arg("command_v"),
           "On by one sample with this command, V, finite; ValueError otherwise.")
      .def("run", &SteppedPlant::run, py::arg("command"),
           "Reads and advances in turn: command of shape (N,), V, finite; outputs of shape (N, 6). "
           "Releases the GIL. ValueError for another command; no sample was taken.");
  m.def("play", &play, py::arg("signal"), py::arg("half_width"), py::kw_only(),
        py::arg("start") = 0.0,
        R"(Play operator, w = min(max(w, u - half_width), u + half_width), sample by sample.

Parameters
----------
signal : array_like, shape (N,)
    The input u.
half_width : float >= 0
    Half the width of the loop, in the unit of the signal.
start : float
    w before the first sample.

Returns
-------
shape (N,)

Raises
------
ValueError
    A wrong shape, or a half width outside its range.
)");
  m.def("plant_substeps", &substeps_for, py::arg("plant"), py::arg("values"), py::arg("dt_s"),
        R"(Steps of integration a sample that suit a plant.

The fastest oscillation (oil spring, seals before they slide) then turns by at most a third of a radian a step.

Parameters
----------
plant : "ehs", "axis" or "linear"
values : array_like, shape (P,)
    In the order of plant_parameters().
dt_s : float > 0
    Sampling time, s.

Returns
-------
int >= 2

Raises
------
ValueError
    A wrong shape, or a number outside its range.
)");
  m.def("simulate_plant", &simulate, py::arg("plant"), py::arg("values"), py::arg("command"),
        py::kw_only(), py::arg("dt_s"), py::arg("substeps") = 2,
        py::arg("varied") = std::vector<std::size_t>{}, py::arg("aligned") = py::none(),
        py::arg("threads") = 0,
        R"(Runs the plant on a logged command, each sample held until the next.

Releases the GIL and runs parameter sets side by side.

Parameters
----------
plant : "ehs", "axis" or "linear"
values : array_like, shape (M, P)
    M sets of parameters in the order of plant_parameters(). Zero switches an effect off.
command : array_like, shape (N,)
    V, finite.
dt_s : float > 0
    Sampling time, s.
substeps : int in 1..1000
    Steps of integration a sample, see plant_substeps().
varied : sequence of S int
    Positions in `values` of the parameters whose sensitivities are wanted.
aligned : array_like, shape (N, 4), optional
    Position reading, velocity, pressures at the cap and at the rod: what is not NaN replaces the state at that
    sample; all else goes on.
threads : int >= 0
    0 takes as many as there are cores.

Returns
-------
outputs : shape (M, N, 6)
    position_m, velocity_m_s, pressure_a_pa, pressure_b_pa, supply_pressure_pa, spool (fraction); NaN for what
    the plant does not have.
sensitivities : shape (M, N, S, 6)
    Derivatives of the outputs, by dual numbers.

Raises
------
ValueError
    A wrong shape, a command that is not finite, or a number outside its range.
)");
}

}  // namespace ehsid::bindings
