// SPDX-License-Identifier: MIT
#include "bind_effects.hpp"

#include <ehsid/plant/parameters.hpp>
#include <ehsid/plant/simulate.hpp>

#include <pybind11/typing.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace ehsid::bindings {
namespace {

using plant::PlantKind;

py::tuple parameters() {
  py::list all;
  for (const plant::PlantParameter& parameter : plant::plant_parameters()) {
    all.append(shown_parameter(parameter.name, parameter.info));
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

/// Position of a name among others.
template <std::size_t kCount>
std::size_t place_of(const char* what, const std::array<const char*, kCount>& names,
                     const std::string& name) {
  std::string all;
  for (std::size_t i = 0; i < kCount; ++i) {
    if (name == names[i]) {
      return i;
    }
    all += (i == 0 ? "" : ", ") + std::string(names[i]);
  }
  throw py::value_error(std::string(what) + " must be one of " + all + ", got '" + name + "'");
}

using PassedTable = py::typing::Tuple<py::str, py::str, py::object>;

std::vector<plant::TableShape> tables_from(const std::vector<PassedTable>& passed) {
  std::vector<plant::TableShape> tables;
  for (const PassedTable& each : passed) {
    if (each.size() != 3) {
      throw py::value_error("tables: expected (adds_to, of, knots)");
    }
    plant::TableShape table;
    table.adds_to = static_cast<plant::Equation>(
        place_of("tables: adds_to", plant::kEquationNames, each[0].cast<std::string>()));
    table.of = static_cast<plant::Variable>(
        place_of("tables: of", plant::kVariableNames, each[1].cast<std::string>()));
    if (table.adds_to == plant::Equation::mass && table.of != plant::Variable::position) {
      throw py::value_error("tables: a mass is given over position_m only");
    }
    const auto knots = real_array<double>("knots", each[2]);
    require_shape("knots", knots, 1, -1);
    table.knots.assign(knots.data(), knots.data() + knots.size());
    const bool rise =
        std::adjacent_find(table.knots.begin(), table.knots.end(),
                           [](double a, double b) { return !(a < b); }) == table.knots.end();
    if (table.knots.size() < 2 || !rise || !is_finite(table.knots.front()) ||
        !is_finite(table.knots.back())) {
      throw py::value_error("tables: knots must be at least two finite numbers that rise");
    }
    tables.push_back(std::move(table));
  }
  return tables;
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

using PassedDisturbance = py::typing::Tuple<py::str, py::object>;

/// Equation and signal of each disturbance. `signals` holds the numbers to which the result points.
std::vector<plant::Disturbance> disturbances_from(const std::vector<PassedDisturbance>& passed,
                                                  py::ssize_t samples,
                                                  std::vector<InputArray<double>>& signals) {
  std::vector<plant::Disturbance> disturbances;
  for (const PassedDisturbance& each : passed) {
    if (each.size() != 2) {
      throw py::value_error("disturbances: expected (adds_to, signal)");
    }
    const auto equation = static_cast<plant::Equation>(
        place_of("disturbances: adds_to", plant::kEquationNames, each[0].cast<std::string>()));
    if (equation == plant::Equation::mass) {
      throw py::value_error("disturbances: a mass is no signal; expected another equation");
    }
    signals.push_back(real_array<double>("disturbances: signal", each[1]));
    require_shape("disturbances: signal", signals.back(), 1, samples);
    require_finite("disturbances: signal", signals.back());
    disturbances.push_back({equation, signals.back().data()});
  }
  return disturbances;
}

void require_sampling_time(double dt_s) {
  if (!is_finite(dt_s) || !(dt_s > 0.0)) {
    throw py::value_error("dt_s must be finite and > 0");
  }
}

/// The parts of all runs of one call, handed out to as many threads as are worth it.
void run_all(const std::vector<plant::Simulation>& runs, const double* command,
             const double* aligned, std::size_t samples, double* outputs, double* sensitivities,
             std::size_t threads) {
  if (runs.empty()) {
    return;
  }
  const std::size_t parts = plant::parts(runs.front(), threads / runs.size());
  const std::size_t size = samples * plant::kOutputs;
  const std::size_t partial_size =
      samples * plant::directions(runs.front()) * runs.front().watched.size();
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < runs.size() * parts; i = next++) {
      const std::size_t run = i / parts;
      double* const partials =
          sensitivities == nullptr ? nullptr : sensitivities + run * partial_size;
      plant::simulate_part(runs[run], i % parts, parts, command, aligned, samples,
                           outputs + run * size, partials);
    }
  };
  std::vector<std::thread> others;
  for (std::size_t i = 1; i < std::min(threads, runs.size() * parts); ++i) {
    others.emplace_back(work);
  }
  work();
  for (std::thread& other : others) {
    other.join();
  }
}

void require_places(const char* name, const std::vector<std::size_t>& places, std::size_t count,
                    const char* of_what) {
  for (const std::size_t place : places) {
    if (place >= count) {
      throw py::value_error(std::string(name) + ": " + std::to_string(place) + " is not below " +
                            std::to_string(count) + ", the number of " + of_what);
    }
  }
}

py::tuple simulate(const std::string& kind, const InputArray<double>& values, const py::object& u,
                   double dt_s, int substeps, const std::vector<std::size_t>& varied,
                   const std::optional<std::vector<std::size_t>>& watched,
                   const py::object& aligned, std::size_t threads,
                   const std::vector<PassedTable>& tables,
                   const std::vector<PassedDisturbance>& disturbances) {
  plant::Simulation shared;
  shared.tables = tables_from(tables);
  const std::size_t count = plant::plant_parameters().size() + plant::table_values(shared.tables);
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
  require_places("varied", varied, count, "parameters");
  shared.kind = kind_of(kind);
  shared.dt = dt_s;
  shared.substeps = substeps;
  shared.varied = varied;
  std::vector<InputArray<double>> signals;
  shared.disturbances = disturbances_from(disturbances, samples, signals);
  if (watched) {
    require_places("watched", *watched, plant::kOutputs, "outputs");
    shared.watched = *watched;
  }
  const py::ssize_t sets = values.shape(0);
  std::vector<plant::Simulation> runs(static_cast<std::size_t>(sets), shared);
  for (py::ssize_t i = 0; i < sets; ++i) {
    const double* const first = values.data(i, 0);
    runs[static_cast<std::size_t>(i)].values.assign(first, first + count);
  }
  const auto columns = static_cast<py::ssize_t>(plant::kOutputs);
  const auto wanted = static_cast<py::ssize_t>(plant::directions(shared));
  const auto shown = static_cast<py::ssize_t>(shared.watched.size());
  py::array_t<double> outputs({sets, samples, columns});
  // In memory one output after the other, so that each is one block for whoever takes it.
  py::array_t<double> by_output({sets, shown, samples, wanted});
  double* const out = outputs.mutable_data();
  double* const partials = wanted > 0 ? by_output.mutable_data() : nullptr;
  const double* const commands = command.data();
  const double* const positions = aligned.is_none() ? nullptr : targets.data();
  if (threads == 0) {
    threads = std::max(1U, std::thread::hardware_concurrency());
  }
  {
    const py::gil_scoped_release release;
    run_all(runs, commands, positions, static_cast<std::size_t>(samples), out, partials, threads);
  }
  return py::make_tuple(outputs, by_output.attr("transpose")(0, 2, 3, 1));
}

/// A plant that somebody else clocks: a controller, a target.
class SteppedPlant : public OneThread {
 public:
  SteppedPlant(const std::string& kind, const InputArray<double>& values, double dt_s, int substeps,
               const std::vector<PassedTable>& tables)
      : SteppedPlant(kind, values, dt_s, substeps, tables_from(tables)) {}

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
      const Run lasting(*this);
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
    const auto numbers = plant::in_order(now);
    std::copy(numbers.begin(), numbers.end(), out);
  }
  SteppedPlant(const std::string& kind, const InputArray<double>& values, double dt_s, int substeps,
               const std::vector<plant::TableShape>& tables)
      : plant_(kind_of(kind), checked_values(values, plant::table_values(tables)),
               checked_time(dt_s), checked_substeps(substeps), 0, tables) {}

  static std::vector<double> checked_values(const InputArray<double>& values, std::size_t more) {
    require_shape("values", values, 1,
                  static_cast<py::ssize_t>(plant::plant_parameters().size() + more));
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
  m.def(
      "plant_outputs",
      [] {
        py::typing::Tuple<py::str, py::ellipsis> names(plant::kOutputNames.size());
        for (std::size_t i = 0; i < names.size(); ++i) {
          names[i] = plant::kOutputNames[i];
        }
        return names;
      },
      "Names of the outputs in the order in which simulate_plant() and Plant return them.");
  m.def(
      "plant_tables",
      [] {
        const auto tuple_of = [](const auto& names) {
          py::typing::Tuple<py::str, py::ellipsis> all(names.size());
          for (std::size_t i = 0; i < names.size(); ++i) {
            all[i] = names[i];
          }
          return all;
        };
        return py::make_tuple(tuple_of(plant::kEquationNames), tuple_of(plant::kVariableNames));
      },
      "Names of the equations to which a table can add, and of the variables over which it can be "
      "given: two tuples.");
  m.def("plant_parameters", &parameters,
        "Everything the plant can be told: a tuple of PlantParameter in the order of `values`.");
  py::class_<SteppedPlant>(m, "Plant",
                           R"(The simulated plant, sample by sample: for a controller in the loop.

Parameters
----------
plant : "ehs", "axis" or "linear"
values : array_like, shape (P + T,)
    In the order of plant_parameters(), then the T values of the tables. Zero switches an effect off.
dt_s : float > 0
    Sampling time, s.
substeps : int in 1..1000
    Steps of integration a sample, see plant_substeps().
tables : sequence of (adds_to, of, knots)
    As simulate_plant() takes them.

Raises
------
ValueError
    A wrong shape, or a number outside its range.)")
      .def(py::init<const std::string&, const InputArray<double>&, double, int,
                    const std::vector<PassedTable>&>(),
           py::arg("plant"), py::arg("values"), py::kw_only(), py::arg("dt_s"),
           py::arg("substeps") = 2, py::arg("tables") = std::vector<PassedTable>{})
      .def("read", &SteppedPlant::read,
           "Outputs now, shape (6,), as simulate_plant(); the next command is not in them.")
      .def("advance", &SteppedPlant::advance, py::arg("command_v"),
           "On by one sample with this command, V, finite; ValueError otherwise.")
      .def("run", &SteppedPlant::run, py::arg("command"),
           "Reads and advances in turn: command of shape (N,), V, finite; outputs of shape (N, 6). "
           "Releases the GIL. ValueError for another command; no sample was taken.");
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
        py::arg("varied") = std::vector<std::size_t>{}, py::arg("watched") = py::none(),
        py::arg("aligned") = py::none(), py::arg("threads") = 0,
        py::arg("tables") = std::vector<PassedTable>{},
        py::arg("disturbances") = std::vector<PassedDisturbance>{},
        R"(Runs the plant on a logged command, each sample held until the next.

Releases the GIL and runs parameter sets side by side.

Parameters
----------
plant : "ehs", "axis" or "linear"
values : array_like, shape (M, P)
    M sets of parameters in the order of plant_parameters(), then the values of the tables. Zero switches an effect
    off.
command : array_like, shape (N,)
    V, finite.
dt_s : float > 0
    Sampling time, s.
substeps : int in 1..1000
    Steps of integration a sample, see plant_substeps().
varied : sequence of S int
    Positions in `values` of the parameters whose sensitivities are wanted.
watched : sequence of L int, optional
    Positions in plant_outputs() of the outputs whose sensitivities are wanted; all by default.
aligned : array_like, shape (N, 4), optional
    Position reading, velocity, pressures at the cap and at the rod: what is not NaN replaces the state at that
    sample; all else goes on.
threads : int >= 0
    0 takes as many as there are cores.
tables : sequence of (adds_to, of, knots)
    Terms that are added to an equation, linear between rising knots of a variable and constant beyond them; see
    plant_tables() for the names. Their values follow in `values`, one for each knot. A mass is given over the
    position; a quarter of the mass without tables always stays.
disturbances : sequence of D (adds_to, signal)
    Signals of shape (N,), finite, that could be added to an equation, in the unit of a table that adds to it, linear
    between samples. They add nothing: wanted are the derivatives by their sizes.

Returns
-------
outputs : shape (M, N, 6)
    In the order of plant_outputs(); NaN for what the plant does not have.
sensitivities : shape (M, N, S + D, L)
    Derivatives of the watched outputs by the varied parameters, then by the sizes of the disturbances, by dual numbers;
    for each output a contiguous block (N, S + D).

Raises
------
ValueError
    A wrong shape, a command that is not finite, or a number outside its range.
)");
}

}  // namespace ehsid::bindings
