// SPDX-License-Identifier: MIT
// Effects of the catalogue around a simulator of the user: an FMU by the addresses of its functions, or Python.
#include "bindings.hpp"

#include <ehsid/plant/fmu.hpp>
#include <ehsid/plant/outside.hpp>
#include <ehsid/plant/parameters.hpp>

#include <pybind11/pybind11.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace ehsid::bindings {
namespace {

constexpr std::array kInputNames{"command_v", "force_n", "supply_pressure_pa", "flow_a_m3_s",
                                 "flow_b_m3_s"};
constexpr std::array kOutsideOutputNames{"position_m",    "velocity_m_s",       "pressure_a_pa",
                                         "pressure_b_pa", "supply_pressure_pa", "supply_flow_m3_s"};
static_assert(kInputNames.size() == std::tuple_size_v<plant::OutsideInputs>);
static_assert(kOutsideOutputNames.size() == std::tuple_size_v<plant::OutsideOutputs>);

template <class Names>
std::size_t place_among(const Names& names, const std::string& name) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (name == names[i]) {
      return i;
    }
  }
  throw py::value_error("'" + name + "' is no input or output of a simulator");
}

/// Name, reference, scale, offset.
using PassedVariable = py::typing::Tuple<py::str, py::int_, py::float_, py::float_>;

template <class Names>
std::vector<plant::FmuVariable> variables_from(const Names& names,
                                               const std::vector<PassedVariable>& passed) {
  std::vector<plant::FmuVariable> variables;
  for (const PassedVariable& each : passed) {
    variables.push_back({place_among(names, each[0].cast<std::string>()),
                         each[1].cast<std::uint32_t>(), each[2].cast<double>(),
                         each[3].cast<double>()});
  }
  return variables;
}

/// A simulator in Python: functions for the outputs now and for a step.
class PythonSteps final : public plant::OutsideSimulator {
 public:
  PythonSteps(py::function read, py::function step, const std::vector<std::string>& inputs,
              const std::vector<std::string>& outputs)
      : read_(std::move(read)), step_(std::move(step)) {
    for (const std::string& name : inputs) {
      inputs_.push_back(place_among(kInputNames, name));
    }
    for (const std::string& name : outputs) {
      outputs_.push_back(place_among(kOutsideOutputNames, name));
    }
  }

  bool read(plant::OutsideOutputs& outputs) override {
    if (!stepped_) {
      take(read_());
    }
    outputs = now_;
    return true;
  }

  bool step(double /*time*/, double h, const plant::OutsideInputs& inputs) override {
    py::list passed(inputs_.size());
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      passed[i] = inputs[inputs_[i]];
    }
    take(step_(h, passed));
    stepped_ = true;
    return true;
  }

 private:
  void take(const py::object& given) {
    const auto values = given.cast<std::vector<double>>();
    if (values.size() != outputs_.size()) {
      throw py::value_error("the simulator gave " + std::to_string(values.size()) +
                            " outputs, expected " + std::to_string(outputs_.size()));
    }
    now_.fill(std::nan(""));
    for (std::size_t i = 0; i < values.size(); ++i) {
      now_[outputs_[i]] = values[i];
    }
  }

  py::function read_, step_;
  std::vector<std::size_t> inputs_, outputs_;
  plant::OutsideOutputs now_{};
  bool stepped_ = false;
};

struct Around {
  plant::OutsideRun run;
  InputArray<double> command;
  InputArray<double> measured;
  PlainArray<std::uint8_t> caught;
};

Around around(const InputArray<double>& values, const py::object& u, double dt_s, int substeps,
              const py::object& measured, const py::object& caught, double gain, double mass,
              const std::pair<double, double>& stiffness, const std::pair<double, double>& valve) {
  Around all;
  require_shape("values", values, 1, static_cast<py::ssize_t>(plant::plant_parameters().size()));
  all.command = real_array<double>("command", u);
  require_shape("command", all.command, 1, -1);
  const py::ssize_t samples = all.command.shape(0);
  all.measured = real_array<double>("measured", measured);
  require_shape("measured", all.measured, 1, samples);
  all.caught = caught.cast<PlainArray<std::uint8_t>>();
  if (all.caught.ndim() != 1 || all.caught.shape(0) != samples) {
    throw py::value_error("caught must have an entry for each sample");
  }
  if (!is_finite(dt_s) || !(dt_s > 0.0)) {
    throw py::value_error("dt_s must be finite and > 0");
  }
  require_range("substeps", substeps, 1, 1000);
  all.run.dt = dt_s;
  all.run.substeps = substeps;
  all.run.values.assign(values.data(), values.data() + values.size());
  all.run.gain = gain;
  all.run.mass = mass;
  all.run.stiffness_a = stiffness.first;
  all.run.stiffness_b = stiffness.second;
  all.run.valve = {valve.first, valve.second};
  return all;
}

py::tuple run_around(plant::OutsideSimulator& simulator, const Around& all, bool python) {
  const py::ssize_t samples = all.command.shape(0);
  py::array_t<double> outputs({samples, static_cast<py::ssize_t>(plant::kOutputs)});
  double* const out = outputs.mutable_data();
  const double* const command = all.command.data();
  const double* const measured = all.measured.data();
  const std::uint8_t* const caught = all.caught.data();
  bool whole = false;
  const auto go = [&] {
    whole = plant::run_outside(simulator, all.run, command, measured, caught,
                               static_cast<std::size_t>(samples), out);
  };
  if (python) {
    go();
  } else {
    const py::gil_scoped_release release;
    go();
  }
  return py::make_tuple(outputs, whole);
}

}  // namespace

void bind_outside(py::module_& m) {
  m.def(
      "outside_command",
      [](const InputArray<double>& values, const py::object& u, double dt_s, int substeps,
         const std::pair<double, double>& valve) {
        const py::object none = py::array_t<double>(py::len(u));
        const Around all =
            around(values, u, dt_s, substeps, none, py::array_t<std::uint8_t>(py::len(u)), 0.0, 0.0,
                   {0.0, 0.0}, valve);
        const auto sent = plant::outside_command(all.run, all.command.data(),
                                                 static_cast<std::size_t>(all.command.shape(0)));
        return py::array_t<double>(static_cast<py::ssize_t>(sent.size()), sent.data());
      },
      py::arg("values"), py::arg("command"), py::kw_only(), py::arg("dt_s"),
      py::arg("substeps") = 1, py::arg("valve") = std::pair<double, double>{0.0, 0.0},
      R"(The command behind the effects of the command path, as a simulator of somebody else gets it.

Parameters
----------
values : array_like, shape (P,)
    In the order of plant_parameters().
command : array_like, shape (N,)
    V, finite; each sample is held until the next.
dt_s : float > 0
    Sampling time, s.
substeps : int in 1..1000
    Communication steps a sample.
valve : (bandwidth_hz, damping)
    Lag of the simulator's own valve, behind which the effects lie; a bandwidth of 0 is unknown.

Returns
-------
shape (N * substeps,), V

Raises
------
ValueError
    A wrong shape, or a number outside its range.)");
  m.def(
      "run_fmu",
      [](int major, std::uintptr_t instance, std::uintptr_t set_real, std::uintptr_t get_real,
         std::uintptr_t do_step, const std::vector<PassedVariable>& inputs,
         const std::vector<PassedVariable>& outputs, const InputArray<double>& values,
         const py::object& command, double dt_s, int substeps, const py::object& measured,
         const py::object& caught, double gain, double mass,
         const std::pair<double, double>& stiffness, const std::pair<double, double>& valve) {
        require_range("major", major, 2, 3);
        const Around all =
            around(values, command, dt_s, substeps, measured, caught, gain, mass, stiffness, valve);
        plant::Fmu fmu({major, instance, set_real, get_real, do_step},
                       variables_from(kInputNames, inputs),
                       variables_from(kOutsideOutputNames, outputs));
        return run_around(fmu, all, false);
      },
      py::arg("major"), py::arg("instance"), py::arg("set_real"), py::arg("get_real"),
      py::arg("do_step"), py::arg("inputs"), py::arg("outputs"), py::arg("values"),
      py::arg("command"), py::kw_only(), py::arg("dt_s"), py::arg("substeps"), py::arg("measured"),
      py::arg("caught"), py::arg("gain"), py::arg("mass"), py::arg("stiffness"), py::arg("valve"),
      R"(Runs an FMU, loaded and at its start, with the effects of the catalogue around it.

Parameters
----------
major : 2 or 3
    Of FMI.
instance, set_real, get_real, do_step : int
    Addresses of the instance, and of fmi2SetReal, fmi2GetReal, fmi2DoStep or their like in FMI 3. Nothing checks them.
inputs, outputs : sequence of (name, reference, scale, offset)
    Names of the contract, such as force_n and position_m, value references; value of the FMU = scale * SI + offset.
values : array_like, shape (P,)
    In the order of plant_parameters(): rated command, stroke, pressures of supply and tank, null bias, effects.
command : array_like, shape (N,)
    V, each sample held until the next.
dt_s : float > 0
    Sampling time, s.
substeps : int in 1..1000
    Communication steps a sample.
measured : array_like, shape (N,)
    Position, m.
caught : array_like, shape (N,)
    Not zero where the error of the position is fed back.
gain : float
    Of that feedback, V/m.
mass : float
    Moved by the force, kg; for friction only.
stiffness : (float, float)
    Rise of the pressure over the volume that flows into each chamber, Pa/m^3; for leakages only.
valve : (bandwidth_hz, damping)
    As outside_command() takes it.

Returns
-------
outputs : shape (N, 6)
    In the order of plant_outputs(); NaN for what the simulator does not give.
whole : bool
    False where the FMU failed; the outputs from there on are NaN.

Raises
------
ValueError
    A wrong shape, an unknown name, or a number outside its range.)");
  m.def(
      "run_steps",
      [](const py::function& read, const py::function& step, const std::vector<std::string>& inputs,
         const std::vector<std::string>& outputs, const InputArray<double>& values,
         const py::object& command, double dt_s, int substeps, const py::object& measured,
         const py::object& caught, double gain, double mass,
         const std::pair<double, double>& stiffness, const std::pair<double, double>& valve) {
        const Around all =
            around(values, command, dt_s, substeps, measured, caught, gain, mass, stiffness, valve);
        PythonSteps steps(read, step, inputs, outputs);
        return run_around(steps, all, true);
      },
      py::arg("read"), py::arg("step"), py::arg("inputs"), py::arg("outputs"), py::arg("values"),
      py::arg("command"), py::kw_only(), py::arg("dt_s"), py::arg("substeps"), py::arg("measured"),
      py::arg("caught"), py::arg("gain"), py::arg("mass"), py::arg("stiffness"), py::arg("valve"),
      R"(Runs a simulator in Python with the effects of the catalogue around it.

Parameters
----------
read : callable
    Returns the outputs at the start.
step : callable
    step(h, inputs) goes on by h seconds with the inputs held and returns the outputs.
inputs, outputs : sequence of str
    What they are, in their order: names of the contract, such as force_n and position_m; in SI.
values, command, dt_s, substeps, measured, caught, gain, mass, stiffness, valve
    As run_fmu() takes them.

Returns
-------
As run_fmu().

Raises
------
ValueError
    As run_fmu(); what the simulator raises passes.)");
}

}  // namespace ehsid::bindings
