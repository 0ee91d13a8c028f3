// SPDX-License-Identifier: MIT
#include "bindings.hpp"

#include <ehsid/servo_estimator.hpp>

#include <memory>
#include <utility>
#include <variant>

namespace ehsid::bindings {
namespace {

constexpr int kMaxDelay = 20;

using Value = TrackedValue<double>;
using Tracked = TrackedServo<double>;

template <class Scalar>
Value in_double(const TrackedValue<Scalar>& from) {
  return {static_cast<double>(from.value), static_cast<double>(from.half_width), from.trusted,
          from.reason};
}

/// One of the values over the samples of a run, as numpy arrays.
struct ValueSeries {
  py::array value;
  py::array half_width;
  py::array trusted;
  py::array reason;
};

struct TrackedRun {
  ValueSeries gain;
  ValueSeries omega_n;
  ValueSeries xi;
  py::array status;
};

/// A ServoEstimator in either precision.
class AnyServoEstimator : public OneThread {
 public:
  AnyServoEstimator(const ServoEstimatorOptions<double>& options, bool single) : options_(options) {
    if (single) {
      start<float>();
    } else {
      start<double>();
    }
  }

  bool single() const { return std::holds_alternative<Held<float>>(held_); }
  const ServoEstimatorOptions<double>& options() const { return options_; }

  Status step(double command, double position) {
    return std::visit(
        [command, position](auto& estimator) {
          using Scalar = typename std::decay_t<decltype(*estimator)>::Scalar;
          return estimator->step(static_cast<Scalar>(command), static_cast<Scalar>(position));
        },
        held_);
  }

  Tracked servo() const {
    return std::visit(
        [](const auto& estimator) {
          const auto told = estimator->servo();
          return Tracked{in_double(told.gain), in_double(told.omega_n), in_double(told.xi)};
        },
        held_);
  }

  /// The coefficients of Eq. (6) and their covariance; of NaN before there are values.
  py::tuple model() const {
    Vector<double, 6> theta = Vector<double, 6>::Constant(std::numeric_limits<double>::quiet_NaN());
    SquareMatrix<double, 6> covariance =
        SquareMatrix<double, 6>::Constant(std::numeric_limits<double>::quiet_NaN());
    const Status status = std::visit(
        [&](const auto& estimator) { return estimator->model(theta, covariance); }, held_);
    if (is_error(status)) {
      throw py::value_error("ServoEstimator.model: a coefficient of Eq. (6) is not finite");
    }
    return py::make_tuple(py::array_t<double>(6, theta.data()),
                          py::array_t<double>({6, 6}, covariance.data()));
  }

  bool resting() const {
    return std::visit([](const auto& estimator) { return estimator->resting(); }, held_);
  }
  int resets() const {
    return std::visit([](const auto& estimator) { return int{estimator->resets()}; }, held_);
  }
  int delay() const {
    return std::visit([](const auto& estimator) { return int{estimator->delay()}; }, held_);
  }

  std::string save() const {
    return std::visit(
        [](const auto& estimator) {
          std::string bytes(estimator->snapshot_bytes(), '\0');
          estimator->save(reinterpret_cast<std::uint8_t*>(bytes.data()));
          return bytes;
        },
        held_);
  }
  SnapshotFault restore(const std::string& bytes) {
    return std::visit(
        [&bytes](auto& estimator) {
          const auto* from = reinterpret_cast<const std::uint8_t*>(bytes.data());
          const SnapshotFault fault = estimator->check(from, bytes.size());
          if (fault == SnapshotFault::none) {
            static_cast<void>(estimator->restore(from, bytes.size()));
          }
          return fault;
        },
        held_);
  }

  template <class Scalar>
  TrackedRun run(const py::object& command_in, const py::object& position_in) {
    const auto command = real_array<Scalar>("command", command_in);
    const auto position = real_array<Scalar>("position", position_in);
    require_shape("command", command, 1, -1);
    require_shape("position", position, 1, command.shape(0));
    const py::ssize_t rows = command.shape(0);
    std::array<Columns<Scalar>, 3> columns{Columns<Scalar>(rows), Columns<Scalar>(rows),
                                           Columns<Scalar>(rows)};
    py::array_t<std::uint8_t> status(rows);
    const Scalar* u = command.data();
    const Scalar* y = position.data();
    std::uint8_t* outcome = status.mutable_data();
    {
      const Run released(*this);
      auto& estimator = *std::get<Held<Scalar>>(held_);
      for (py::ssize_t k = 0; k < rows; ++k) {
        outcome[k] = static_cast<std::uint8_t>(estimator.step(u[k], y[k]));
        const auto told = estimator.servo();
        columns[0].put(k, told.gain);
        columns[1].put(k, told.omega_n);
        columns[2].put(k, told.xi);
      }
    }
    return {columns[0].series(), columns[1].series(), columns[2].series(), status};
  }

 private:
  template <class Scalar>
  using Held = std::unique_ptr<ServoEstimator<Scalar, kMaxDelay>>;

  /// The arrays of one value, and where they lie in memory: while the GIL is released only these are used.
  template <class Scalar>
  class Columns {
   public:
    explicit Columns(py::ssize_t rows)
        : value_(rows),
          half_width_(rows),
          trusted_(rows),
          reason_(rows),
          to_value_(value_.mutable_data()),
          to_half_width_(half_width_.mutable_data()),
          to_trusted_(trusted_.mutable_data()),
          to_reason_(reason_.mutable_data()) {}

    void put(py::ssize_t row, const TrackedValue<Scalar>& told) {
      to_value_[row] = told.value;
      to_half_width_[row] = told.half_width;
      to_trusted_[row] = told.trusted;
      to_reason_[row] = static_cast<std::uint8_t>(told.reason);
    }

    ValueSeries series() const { return {value_, half_width_, trusted_, reason_}; }

   private:
    py::array_t<Scalar> value_;
    py::array_t<Scalar> half_width_;
    py::array_t<bool> trusted_;
    py::array_t<std::uint8_t> reason_;
    Scalar* to_value_;
    Scalar* to_half_width_;
    bool* to_trusted_;
    std::uint8_t* to_reason_;
  };

  template <class Scalar>
  void start() {
    auto made = std::make_unique<ServoEstimator<Scalar, kMaxDelay>>();
    ServoEstimatorOptions<Scalar> options;
    options.dt_s = static_cast<Scalar>(options_.dt_s);
    options.delay = options_.delay;
    options.drift = static_cast<Scalar>(options_.drift);
    options.tolerance = static_cast<Scalar>(options_.tolerance);
    if (made->configure(options) != Status::ok) {
      throw py::value_error(
          "ServoEstimator: dt_s and tolerance must be finite and > 0, drift finite and >= 0, delay "
          "from "
          "1 to 20 samples");
    }
    held_ = std::move(made);
  }

  ServoEstimatorOptions<double> options_;
  std::variant<Held<float>, Held<double>> held_;
};

std::string shown(const Value& value) {
  const auto number = [](double x) {
    return py::str("{:.4g}").attr("format")(x).cast<std::string>();
  };
  return number(value.value) + " +- " + number(value.half_width) +
         (value.trusted ? ", trusted" : ", not trusted");
}

}  // namespace

void bind_servo_estimator(py::module_& m) {
  py::native_enum<TrustReason>(m, "TrustReason", "enum.IntEnum", "Why a value is not trusted.")
      .value("trusted", TrustReason::trusted)
      .value("starting", TrustReason::starting)
      .value("resting", TrustReason::resting)
      .value("single_sine", TrustReason::single_sine)
      .value("change_suspected", TrustReason::change_suspected)
      .value("model_does_not_fit", TrustReason::model_does_not_fit)
      .value("not_precise", TrustReason::not_precise)
      .finalize();
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
  py::class_<ValueSeries>(m, "TrackedSeries", "A tracked value over a run; arrays of shape (N,).")
      .def_readonly("value", &ValueSeries::value)
      .def_readonly("half_width", &ValueSeries::half_width)
      .def_readonly("trusted", &ValueSeries::trusted)
      .def_readonly("reason", &ValueSeries::reason, "Numbers of TrustReason, uint8.");
  py::class_<TrackedRun>(m, "TrackedRun", "What a ServoEstimator told after each sample of a run.")
      .def_readonly("gain", &TrackedRun::gain)
      .def_readonly("omega_n", &TrackedRun::omega_n)
      .def_readonly("xi", &TrackedRun::xi)
      .def_readonly("status", &TrackedRun::status, "Numbers of Status, uint8, shape (N,).");

  const ServoEstimatorOptions<double> defaults;
  py::class_<AnyServoEstimator>(
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
    Where an argument is outside its range.)")
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
    J P J', of rank 3: K, omega_n and xi decide all six. Its intervals are those of servo().)")
      .def(
          "run",
          [](AnyServoEstimator& self, const py::object& command, const py::object& position) {
            return self.single() ? self.run<float>(command, position)
                                 : self.run<double>(command, position);
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
      .def(
          "save", [](const AnyServoEstimator& self) { return py::bytes(self.save()); },
          "Whole state as bytes, for restore() of an estimator made with the same arguments, here "
          "or "
          "in C++ and C.")
      .def(
          "restore",
          [](AnyServoEstimator& self, const py::bytes& state) {
            const SnapshotFault fault = self.restore(state);
            if (fault != SnapshotFault::none) {
              throw py::value_error(refusal(fault));
            }
          },
          py::arg("state"),
          "Takes over a saved state. ValueError, and nothing changed, where the bytes are damaged "
          "or "
          "were saved by another version, or by an estimator made with other arguments.")
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
