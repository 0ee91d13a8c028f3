// SPDX-License-Identifier: MIT
#include "any_servo_estimator.hpp"

namespace ehsid::bindings {
namespace {

/// ServoEstimators with the same settings, one for each axis.
class PyServoBank {
 public:
  PyServoBank(const ServoEstimatorOptions<double>& options, int axes, bool single) {
    for (int i = 0; i < axes; ++i) {
      owned_.push_back(std::make_unique<AnyServoEstimator>(options, single));
      axes_.push_back(owned_.back().get());
    }
  }

  const Axes& axes() const { return axes_; }
  py::ssize_t size() const { return static_cast<py::ssize_t>(axes_.size()); }
  bool single() const { return axes_.front()->single(); }

  /// Calls `what` with each number and its ServoEstimator.
  template <class Scalar, class What>
  void each(What what) const {
    for (std::size_t i = 0; i < axes_.size(); ++i) {
      require_free(*axes_[i]);
      what(static_cast<py::ssize_t>(i), axes_[i]->template held<Scalar>());
    }
  }

 private:
  std::vector<std::unique_ptr<AnyServoEstimator>> owned_;
  Axes axes_;
};

template <class Scalar>
py::array step(const PyServoBank& self, const py::object& command_in,
               const py::object& position_in) {
  const auto command = real_array<Scalar>("command", command_in);
  const auto position = real_array<Scalar>("position", position_in);
  require_exactly("command", command, py::make_tuple(self.size()));
  require_exactly("position", position, py::make_tuple(self.size()));
  py::array_t<std::uint8_t> status(self.size());
  std::uint8_t* outcome = status.mutable_data();
  self.each<Scalar>([&](py::ssize_t i, auto& estimator) {
    outcome[i] = static_cast<std::uint8_t>(estimator.step(command.data()[i], position.data()[i]));
  });
  return status;
}

template <class Scalar>
TrackedServos servo(const PyServoBank& self) {
  TrackedArrays<Scalar> told({self.size()});
  self.each<Scalar>([&](py::ssize_t i, const auto& estimator) { told.put(i, estimator.servo()); });
  return told.told();
}

template <class Scalar>
TrackedRun run(const PyServoBank& self, const py::object& command_in,
               const py::object& position_in) {
  const auto command = real_array<Scalar>("command", command_in);
  const auto position = real_array<Scalar>("position", position_in);
  require_shape("command", command, 2, self.size());
  require_exactly("position", position, command.attr("shape"));
  return run_axes<Scalar>(self.axes(), command, position);
}

}  // namespace

void bind_servo_bank(py::module_& m) {
  const ServoEstimatorOptions<double> defaults;
  py::class_<PyServoBank>(m, "ServoBank",
                          R"(A ServoEstimator for each of many axes, all with the same settings.

Each tells the same bits as if it were alone, and a bad sample of one axis touches no other. It saves the
loop in Python, not the work of the estimators (docs/bank.md).

Parameters
----------
dt_s : float > 0
    Sampling time in s.
axes : int >= 1
    How many.
delay, drift, tolerance, dtype
    As of ServoEstimator.

Raises
------
ValueError
    Where an argument is outside its range.)")
      .def(py::init([](double dt_s, int axes, int delay, double drift, double tolerance,
                       const py::object& dtype) {
             require_range("axes", axes, 1, 1000000);
             require_range("delay", delay, 1, kMaxDelay);
             return std::make_unique<PyServoBank>(
                 ServoEstimatorOptions<double>{dt_s, delay, drift, tolerance}, axes,
                 is_single(dtype));
           }),
           py::arg("dt_s"), py::arg("axes"), py::kw_only(), py::arg("delay") = defaults.delay,
           py::arg("drift") = defaults.drift, py::arg("tolerance") = defaults.tolerance,
           py::arg("dtype") = "float32")
      .def("__len__", &PyServoBank::size)
      .def(
          "__getitem__",
          [](const PyServoBank& self, py::ssize_t index) {
            if (index < -self.size() || index >= self.size()) {
              throw py::index_error("axis " + std::to_string(index) + " of a bank of " +
                                    std::to_string(self.size()));
            }
            return self.axes()[static_cast<std::size_t>(index < 0 ? index + self.size() : index)];
          },
          py::arg("index"), py::return_value_policy::reference_internal,
          "The ServoEstimator of this axis itself: what it is told or restores, the bank knows.")
      .def(
          "step",
          [](const PyServoBank& self, const py::object& command, const py::object& position) {
            return self.single() ? step<float>(self, command, position)
                                 : step<double>(self, command, position);
          },
          py::arg("command"), py::arg("position"),
          R"(Takes one sample of every axis.

Parameters
----------
command, position : array_like, shape (axes,)
    NaN for an axis that was not measured: its status is then invalid_input.

Returns
-------
array, shape (axes,)
    Numbers of Status, uint8, as ServoEstimator.step gives them.)")
      .def(
          "servo",
          [](const PyServoBank& self) {
            return self.single() ? servo<float>(self) : servo<double>(self);
          },
          "What is known of all axes now, as TrackedServos.")
      .def(
          "run",
          [](const PyServoBank& self, const py::object& command, const py::object& position) {
            return self.single() ? run<float>(self, command, position)
                                 : run<double>(self, command, position);
          },
          py::arg("command"), py::arg("position"),
          R"(Takes samples of every axis in order, as step() would. Releases the GIL.

Parameters
----------
command, position : array_like, shape (N, axes)

Returns
-------
TrackedRun
    Of arrays of shape (N, axes).

Raises
------
TypeError, ValueError
    Not real numbers, or shapes that do not fit; no sample was taken.)");
}

}  // namespace ehsid::bindings
