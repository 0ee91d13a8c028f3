// SPDX-License-Identifier: MIT
#include "bindings.hpp"

#include <ehsid/growth_monitor.hpp>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

namespace ehsid::bindings {
namespace {

constexpr int kMostSignatures = 32;
constexpr int kMostGrowthTests = 8;
using Monitor = GrowthMonitor<float, up_to(kMostSignatures), up_to(kMostGrowthTests)>;
using Told = Growth<float>;

/// The monitor with the tables that it points to.
struct HeldGrowthMonitor : OneThread {
  Monitor::Tables tables{};
  Monitor monitor;

  void require_test(int test) const {
    if (test < 0 || test >= tables.tests) {
      throw py::index_error("test " + std::to_string(test) + ": expected 0 to " +
                            std::to_string(tables.tests - 1));
    }
  }
};

struct GrowthRun {
  py::array status;
  py::array innovation;
  py::array cell;
  py::array statistic;
  py::array alarmed;
};

template <class To>
void take_array(const char* name, const py::object& values, To& to) {
  const auto given = real_array<float>(name, values);
  require_shape(name, given, 1, static_cast<py::ssize_t>(to.size()));
  std::copy_n(given.data(), to.size(), to.begin());
}

std::unique_ptr<HeldGrowthMonitor> make_growth(
    const py::object& servo, const py::object& correction, int delay, int settle, int block,
    const py::object& command_edges, const py::object& acceleration_edges, const py::object& mean,
    const py::object& weight, const py::object& other, const py::object& signature,
    const std::vector<int>& effect, const std::vector<std::tuple<int, float, float>>& tests,
    float prior, float limit) {
  auto made = std::make_unique<HeldGrowthMonitor>();
  Monitor::Tables& t = made->tables;
  const auto signatures = real_array<float>("signature", signature);
  require_shape("signature", signatures, 2, -1);
  const auto count = static_cast<std::size_t>(signatures.shape(1));
  require_range("signatures", static_cast<int>(count), 1, kMostSignatures);
  require_range("tests", static_cast<int>(tests.size()), 1, kMostGrowthTests);
  require_range("effects", static_cast<int>(effect.size()), static_cast<int>(count),
                static_cast<int>(count));
  require_exactly("signature", signatures, py::make_tuple(kGrowthCells, count));
  const auto others = real_array<float>("other", other);
  require_exactly("other", others, py::make_tuple(kGrowthCells, kGrowthOthers));
  t.signatures = static_cast<std::int32_t>(count);
  t.tests = static_cast<std::int32_t>(tests.size());
  t.delay = delay;
  t.settle = settle;
  t.block = block;
  std::array<float, 7> numbers{};
  take_array("servo", servo, numbers);
  t.gain = numbers[0];
  t.s = numbers[1];
  t.w = numbers[2];
  t.e = numbers[3];
  t.i = numbers[4];
  t.decay = numbers[5];
  t.pull = numbers[6];
  take_array("correction", correction, t.correction);
  take_array("command_edges", command_edges, t.command_edges);
  take_array("acceleration_edges", acceleration_edges, t.acceleration_edges);
  std::array<float, kGrowthCells> means{};
  std::array<float, kGrowthCells> weights{};
  take_array("mean", mean, means);
  take_array("weight", weight, weights);
  for (std::size_t n = 0; n < t.cells.size(); ++n) {
    t.cells[n].mean = means[n];
    t.cells[n].weight = weights[n];
    std::copy_n(others.data() + n * kGrowthOthers, kGrowthOthers, t.cells[n].other.begin());
    std::copy_n(signatures.data() + n * count, count, t.cells[n].signature.begin());
  }
  std::copy(effect.begin(), effect.end(), t.effect.begin());
  for (std::size_t n = 0; n < tests.size(); ++n) {
    const auto& [of, trust, margin] = tests[n];
    t.asked[n] = {of, trust, margin};
  }
  t.prior = prior;
  t.limit = limit;
  if (is_error(made->monitor.configure(t))) {
    throw py::value_error(
        "GrowthMonitor: expected finite numbers; edges that rise; delay 1 to " +
        std::to_string(kGrowthMostDelay) +
        "; settle >= 0; block >= 10 (2 + signatures) + tests (signatures + 1); weights >= 0; "
        "signatures within 1000; "
        "trust, prior and limit > 0; margin 0 to 1; tests of signatures and effects of tests "
        "that there are");
  }
  return made;
}

GrowthRun run_growth(HeldGrowthMonitor& self, const py::object& command_in,
                     const py::object& position_in) {
  const auto command = real_array<float>("command", command_in);
  const auto position = real_array<float>("position", position_in);
  require_shape("command", command, 1, -1);
  require_shape("position", position, 1, command.shape(0));
  const py::ssize_t rows = command.shape(0);
  const auto tests = static_cast<py::ssize_t>(self.tables.tests);
  py::array_t<std::uint8_t> status(rows);
  py::array_t<float> innovation(rows);
  py::array_t<std::uint8_t> cell(rows);
  py::array_t<float> statistic({rows, tests});
  py::array_t<bool> alarmed({rows, tests});
  const float* u = command.data();
  const float* y = position.data();
  std::uint8_t* to_status = status.mutable_data();
  float* to_innovation = innovation.mutable_data();
  std::uint8_t* to_cell = cell.mutable_data();
  float* to_statistic = statistic.mutable_data();
  bool* to_alarmed = alarmed.mutable_data();
  {
    const Run lasting(self);
    for (py::ssize_t k = 0; k < rows; ++k) {
      to_status[k] = static_cast<std::uint8_t>(self.monitor.step(u[k], y[k]));
      const auto& state = self.monitor.state();
      to_innovation[k] = state.innovation;
      to_cell[k] = static_cast<std::uint8_t>(state.cell);
      for (std::size_t n = 0; n < static_cast<std::size_t>(tests); ++n) {
        *to_statistic++ = state.tests[n].statistic;
        *to_alarmed++ = state.tests[n].alarmed != 0;
      }
    }
  }
  return {status, innovation, cell, statistic, alarmed};
}

}  // namespace

void bind_growth_monitor(py::module_& m) {
  py::class_<Told>(m, "Growth", "What a test of a GrowthMonitor tells.")
      .def_readonly("alarmed", &Told::alarmed, "Whether the limit was passed since restart().")
      .def_readonly("statistic", &Told::statistic, "S, the logarithm of a likelihood ratio.")
      .def_readonly("size", &Told::size, "Growth since the test began, in unit sizes.")
      .def_readonly("deviation", &Told::deviation,
                    "Standard deviation of the size; 0 where nothing is known.")
      .def_readonly("blocks", &Told::blocks, "How many blocks ago the test began.");
  py::class_<GrowthRun>(m, "GrowthRun", "What a GrowthMonitor told after each of N samples.")
      .def_readonly("status", &GrowthRun::status, "Numbers of Status, uint8, shape (N,).")
      .def_readonly("innovation", &GrowthRun::innovation,
                    "Measured less predicted position, shape (N,).")
      .def_readonly("cell", &GrowthRun::cell, "Cell of the sample, uint8, shape (N,).")
      .def_readonly("statistic", &GrowthRun::statistic, "S of each test, shape (N, tests).")
      .def_readonly("alarmed", &GrowthRun::alarmed, "Alarms of each test, bool, shape (N, tests).");
  py::class_<HeldGrowthMonitor>(m, "GrowthMonitor",
                                R"(Tells which of a few effects grows, beside an estimator.

Runs the C++ code that firmware runs, in float32. `ehsid export --growth` makes the tables
(docs/growth.md). Use one object from one thread at a time.

Parameters
----------
servo : array_like, shape (7,)
    K dt, S, W, E, I, decay and pull of the linear servo over one period (servo_transition.hpp).
correction : array_like, shape (3,)
    What an innovation of 1 adds to position, velocity and acceleration of the observer.
delay : int in 1..8
    Samples from a command to the first position that shows it.
settle, block : int
    Samples left out behind a start or a refused sample; samples of a block.
command_edges, acceleration_edges : array_like, shape (7,) and (4,)
    Edges of the cells, rising.
mean, weight : array_like, shape (40,)
    Mean innovation of the quiet machine in each cell, and 1 / its deviation, 0 where it is not used.
other : array_like, shape (40, 2)
    Change of the mean by what is eliminated, in deviations.
signature : array_like, shape (40, signatures)
    Change of the mean by an effect of a size, in deviations; at most 32 signatures.
effect : list of int
    Test of the effect of each signature.
tests : list of (signature, trust, margin)
    What is tested, at most 8; trust > 0, 1 / variance of a block's score over its information;
    margin 0 to 1, the size that is no growth.
prior : float > 0
    Precision of what is eliminated.
limit : float > 0
    Alarm above this logarithm of a likelihood ratio.

Raises
------
ValueError
    Where an argument is outside its range.)")
      .def(py::init(&make_growth), py::kw_only(), py::arg("servo"), py::arg("correction"),
           py::arg("delay"), py::arg("settle"), py::arg("block"), py::arg("command_edges"),
           py::arg("acceleration_edges"), py::arg("mean"), py::arg("weight"), py::arg("other"),
           py::arg("signature"), py::arg("effect"), py::arg("tests"), py::arg("prior"),
           py::arg("limit"))
      .def(
          "step",
          [](HeldGrowthMonitor& self, float command, float position) {
            return self.monitor.step(command, position);
          },
          py::arg("command"), py::arg("position"),
          R"(Takes the command sent at t_k and the position measured at t_k.

Returns
-------
Status
    filling while the observer settles. A sample that is not finite or not plausible is refused without
    an exception: see is_error().)")
      .def("run", &run_growth, py::arg("command"), py::arg("position"),
           R"(Takes samples in order, as step() would. Releases the GIL.

Parameters
----------
command, position : array_like, shape (N,)

Returns
-------
GrowthRun

Raises
------
TypeError, ValueError
    Not real numbers, or shapes that do not fit; no sample was taken.)")
      .def(
          "told",
          [](const HeldGrowthMonitor& self, int test) {
            self.require_test(test);
            return self.monitor.told(test);
          },
          py::arg("test"), "What a test tells now, as a Growth.")
      .def(
          "restart", [](HeldGrowthMonitor& self) { self.monitor.restart(); },
          "Begins anew, e.g. behind a repair: forgets alarms and sums.")
      .def_property_readonly(
          "first", [](const HeldGrowthMonitor& self) { return self.monitor.first(); },
          "The test that gave the first alarm since the start; -1: none.")
      .def_property_readonly(
          "named", [](const HeldGrowthMonitor& self) { return self.monitor.named(); },
          "The test whose effect explains the first alarm; -1: none, or not told apart yet.");
}

}  // namespace ehsid::bindings
