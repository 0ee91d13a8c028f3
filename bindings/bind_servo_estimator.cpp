// SPDX-License-Identifier: MIT
#include "any_servo_estimator.hpp"

namespace ehsid::bindings {
namespace {

std::string shown(const Value& value) {
  const auto number = [](double x) {
    return py::str("{:.4g}").attr("format")(x).cast<std::string>();
  };
  return number(value.value) + " +- " + number(value.half_width) +
         (value.trusted ? ", trusted" : ", not trusted");
}

template <class Scalar>
TrackedRun run(AnyServoEstimator& self, const py::object& command_in,
               const py::object& position_in) {
  const auto command = real_array<Scalar>("command", command_in);
  const auto position = real_array<Scalar>("position", position_in);
  require_shape("command", command, 1, -1);
  require_shape("position", position, 1, command.shape(0));
  return run_axes<Scalar>({&self}, command, position);
}

}  // namespace

void bind_servo_estimator(py::module_& m) {
  py::class_<Value>(m, "TrackedValue",
                    "A value with the half of its 90 % interval, in the same unit.")
      .def_readonly("value", &Value::value, "NaN before there is any.")
      .def_readonly("half_width", &Value::half_width, "Half of the 90 % interval.")
      .def_readonly("trusted", &Value::trusted, "Whether a controller may use the value.")
      .def_readonly("reason", &Value::reason, "TrustReason.trusted, or why it is not.")
      .def("__repr__", [](const Value& self) { return "<TrackedValue " + shown(self) + ">"; });
  py::class_<Tracked>(m, "TrackedServo",
                      R"(The servo K omega_n^2 / (s (s^2 + 2 xi omega_n s + omega_n^2)), Eq. (5).

gain is in units of the position per s and unit of the command, omega_n in rad/s.)")
      .def_readonly("gain", &Tracked::gain)
      .def_readonly("omega_n", &Tracked::omega_n)
      .def_readonly("xi", &Tracked::xi)
      .def("__repr__", [](const Tracked& self) {
        return "<TrackedServo K = " + shown(self.gain) + "; omega_n = " + shown(self.omega_n) +
               "; xi = " + shown(self.xi) + ">";
      });
  py::class_<ValueSeries>(m, "TrackedSeries",
                          "A tracked value over a run, of all axes of a ServoBank, or over both.")
      .def_readonly("value", &ValueSeries::value)
      .def_readonly("half_width", &ValueSeries::half_width)
      .def_readonly("trusted", &ValueSeries::trusted)
      .def_readonly("reason", &ValueSeries::reason, "Numbers of TrustReason, uint8.");
  py::class_<TrackedServos>(m, "TrackedServos",
                            "The servos of a ServoBank; arrays of shape (axes,).")
      .def_readonly("gain", &TrackedServos::gain)
      .def_readonly("omega_n", &TrackedServos::omega_n)
      .def_readonly("xi", &TrackedServos::xi);
  py::class_<TrackedRun, TrackedServos>(
      m, "TrackedRun",
      "What was told after each sample of a run: arrays of shape (N,), of a ServoBank (N, axes).")
      .def_readonly("status", &TrackedRun::status, "Numbers of Status, uint8.");

  const ServoEstimatorOptions<double> defaults;
  py::class_<AnyServoEstimator> estimator(
      m, "ServoEstimator",
      R"(K, omega_n and xi of a servo while it runs, each with a word on trust.

A Kalman filter on the physical parameters, for a servo with an integrator and noise on its position
sensor (docs/which_estimator.md). Runs the C++ code that firmware runs. Any units will do. Use one
object from one thread at a time.

Parameters
----------
dt_s : float > 0
    Sampling time in s.
delay : int in 1..20
    Samples from a command to the first position that shows it. One more is found by itself.
drift : float >= 0
    How fast K and omega_n may wander: standard deviation of their logarithms in 1 s.
tolerance : float > 0
    K is trusted where the half of its 90 % interval is below this share of K; omega_n and xi at 1.5
    times this.
dtype : float32 or float64
    Precision.

Raises
------
ValueError
    Where an argument is outside its range.)");
  bind_snapshot(estimator);
  estimator
      .def(py::init([](double dt_s, int delay, double drift, double tolerance,
                       const py::object& dtype) {
             require_range("delay", delay, 1, kMaxDelay);
             return std::make_unique<AnyServoEstimator>(
                 ServoEstimatorOptions<double>{dt_s, delay, drift, tolerance}, is_single(dtype));
           }),
           py::arg("dt_s"), py::kw_only(), py::arg("delay") = defaults.delay,
           py::arg("drift") = defaults.drift, py::arg("tolerance") = defaults.tolerance,
           py::arg("dtype") = "float32")
      .def("step", &AnyServoEstimator::step, py::arg("command"), py::arg("position"),
           R"(Takes the command sent at t_k and the position measured at t_k.

Returns
-------
Status
    filling before the first motion, no_information at rest, reset where all begins anew. A sample that
    is not finite or not plausible is refused without an exception: see is_error().)")
      .def("servo", &AnyServoEstimator::servo, "What is known now, as a TrackedServo.")
      .def(
          "model", &AnyServoEstimator::model,
          R"(The discrete model of servo(): Eq. (6), the coefficients of an ArxEstimator of order 3, 3.

Returns
-------
theta : array, shape (6,)
    a1, a2, a3, b1, b2, b3, where b1 belongs to the command of `delay` samples ago. float64. NaN before
    there are values.
covariance : array, shape (6, 6)
    J P J', of rank 3: K, omega_n and xi decide all six. Its intervals are those of servo(), and
    identify_servo() reads them again.)")
      .def(
          "run",
          [](AnyServoEstimator& self, const py::object& command, const py::object& position) {
            return self.single() ? run<float>(self, command, position)
                                 : run<double>(self, command, position);
          },
          py::arg("command"), py::arg("position"),
          R"(Takes samples in order, as step() would. Releases the GIL.

Parameters
----------
command, position : array_like, shape (N,)

Returns
-------
TrackedRun

Raises
------
TypeError, ValueError
    Not real numbers, or shapes that do not fit; no sample was taken.)")
      .def_property_readonly("resting", &AnyServoEstimator::resting,
                             "Whether the servo stands still: the parameters wait.")
      .def_property_readonly("resets", &AnyServoEstimator::resets, "How often all began anew.")
      .def_property_readonly("delay", &AnyServoEstimator::delay,
                             "Delay in samples that was found: the stated one, or one more.")
      .def_property_readonly(
          "dt_s", [](const AnyServoEstimator& self) { return self.options().dt_s; },
          "Sampling time in s.")
      .def_property_readonly(
          "dtype",
          [](const AnyServoEstimator& self) {
            return self.single() ? py::dtype::of<float>() : py::dtype::of<double>();
          },
          "Precision, float32 or float64.")
      .def("__repr__", [](const py::object& self) {
        return show_properties(self, {"dt_s", "delay", "dtype"});
      });
}

}  // namespace ehsid::bindings
