// SPDX-License-Identifier: MIT
#include "bindings.hpp"

#include <ehsid/arx_estimator.hpp>
#include <ehsid/servo_model.hpp>

namespace ehsid::bindings {
namespace {

/// What the template takes where nobody names a policy.
constexpr const char* kDefaultPolicy = ArxEstimator<float, 3, 3, 1>::Forgetting::kInfo.id;

template <class Options>
Options checked(const Options& options, const char* message) {
  if (!options.valid()) {
    throw py::value_error(message);
  }
  return options;
}

template <class Scalar>
Trajectory run(AnyEstimator& self, const py::object& u_in, const py::object& y_in) {
  const auto u = real_array<Scalar>("u", u_in);
  const auto y = real_array<Scalar>("y", y_in);
  require_shape("u", u, 1, -1);
  require_shape("y", y, 1, u.shape(0));
  TrajectoryView<Scalar> view{};
  Trajectory out = make_trajectory(y.shape(0), self.n(), true, view);
  const Scalar* u_data = u.data();
  const Scalar* y_data = y.data();
  const auto rows = static_cast<std::size_t>(y.shape(0));
  {
    const Run lasting(self);
    self.run(u_data, y_data, rows, view);
  }
  return out;
}

/// n * n numbers of a unit upper triangular matrix; ValueError unless it is one.
std::vector<double> unit_upper(const AnyEstimator& self, const py::object& u_in) {
  const auto u = real_array<double>("u", u_in);
  require_exactly("u", u, py::make_tuple(self.n(), self.n()));
  for (int i = 0; i < self.n(); ++i) {
    for (int j = 0; j <= i; ++j) {
      if (u.at(i, j) != (i == j ? 1.0 : 0.0)) {
        throw py::value_error("u must be upper triangular with ones on its diagonal");
      }
    }
  }
  require_free(self);
  return {u.data(), u.data() + u.size()};
}

void bind_options(py::module_& m) {
  const Scaling<double> scaling;
  py::class_<Scaling<double>>(m, "Scaling",
                              R"(Units out: the estimator sees (signal - offset) / scale.

Parameters
----------
command_scale, position_scale : float > 0
    Of the order of the signals' excursions, e.g. rated command and stroke.
command_offset, position_offset : float
    Near the signals' means.

Raises
------
ValueError
    Where an argument is outside its range.)")
      .def(py::init([](double command_scale, double position_scale, double command_offset,
                       double position_offset) {
             return checked(
                 Scaling<double>{command_scale, position_scale, command_offset, position_offset},
                 "Scaling: scales must be finite and > 0, and the squares of position_scale and of "
                 "position_scale / "
                 "command_scale, too; offsets finite");
           }),
           py::kw_only(), py::arg("command_scale") = scaling.command_scale,
           py::arg("position_scale") = scaling.position_scale,
           py::arg("command_offset") = scaling.command_offset,
           py::arg("position_offset") = scaling.position_offset)
      .def_readonly("command_scale", &Scaling<double>::command_scale)
      .def_readonly("position_scale", &Scaling<double>::position_scale)
      .def_readonly("command_offset", &Scaling<double>::command_offset)
      .def_readonly("position_offset", &Scaling<double>::position_offset)
      .def("__repr__", [](const py::object& self) {
        return show_properties(
            self, {"command_scale", "position_scale", "command_offset", "position_offset"});
      });

  using Reset = RmseResetOptions<double>;
  const Reset reset;
  py::class_<Reset>(m, "RmseResetOptions",
                    R"(Reset on a change of the plant: short- against long-window RMSE (Fig. 4).

Parameters
----------
short_window, long_window : float
    Samples, 1 <= short_window < long_window.
trigger_ratio, release_ratio : float
    Ratios of RMSE, 1 <= release_ratio < trigger_ratio.
cool_down : int >= 0
    Samples after a reset without another.
floor : float >= 0
    An RMSE below this, in scaled units of the output, is never a change.

Raises
------
ValueError
    Where an argument is outside its range.)")
      .def(py::init([](double short_window, double long_window, double trigger_ratio,
                       double release_ratio, std::int32_t cool_down, double floor) {
             return checked(
                 Reset{short_window, long_window, trigger_ratio, release_ratio, cool_down, floor},
                 "RmseResetOptions: needs 1 <= short_window < long_window, 1 <= release_ratio < "
                 "trigger_ratio, cool_down >= 0, floor >= 0, all finite");
           }),
           py::kw_only(), py::arg("short_window") = reset.short_window,
           py::arg("long_window") = reset.long_window,
           py::arg("trigger_ratio") = reset.trigger_ratio,
           py::arg("release_ratio") = reset.release_ratio, py::arg("cool_down") = reset.cool_down,
           py::arg("floor") = reset.floor)
      .def_readonly("short_window", &Reset::short_window)
      .def_readonly("long_window", &Reset::long_window)
      .def_readonly("trigger_ratio", &Reset::trigger_ratio)
      .def_readonly("release_ratio", &Reset::release_ratio)
      .def_readonly("cool_down", &Reset::cool_down)
      .def_readonly("floor", &Reset::floor)
      .def("__repr__", [](const py::object& self) {
        return show_properties(self, {"short_window", "long_window", "trigger_ratio",
                                      "release_ratio", "cool_down", "floor"});
      });

  using Convergence = ConvergenceOptions<double>;
  const Convergence convergence;
  py::class_<Convergence>(m, "ConvergenceOptions",
                          R"(When an estimate counts as settled, by its covariance.

Parameters
----------
tolerance : float > 0
    Largest standard deviation relative to its parameter.
magnitude : float > 0
    Scaled parameters smaller than this are judged as if they were this.
hold : int >= 1
    Informative samples in a row.

Raises
------
ValueError
    Where an argument is outside its range.)")
      .def(py::init([](double tolerance, double magnitude, std::int32_t hold) {
             return checked(
                 Convergence{tolerance, magnitude, hold},
                 "ConvergenceOptions: tolerance and magnitude must be finite and > 0, hold >= 1");
           }),
           py::kw_only(), py::arg("tolerance") = convergence.tolerance,
           py::arg("magnitude") = convergence.magnitude, py::arg("hold") = convergence.hold)
      .def_readonly("tolerance", &Convergence::tolerance)
      .def_readonly("magnitude", &Convergence::magnitude)
      .def_readonly("hold", &Convergence::hold)
      .def("__repr__", [](const py::object& self) {
        return show_properties(self, {"tolerance", "magnitude", "hold"});
      });
}

void bind_gradient_options(py::module_& m) {
  using Gradient = GradientOptions<double>;
  const Gradient gradient;
  py::class_<Gradient>(m, "GradientOptions",
                       R"(Filters of the method "riv" of ArxEstimator.

Parameters
----------
settling : int in 1..1000000
    Samples at the start, and after a reset, in which the estimate is least squares on filtered signals.
start_pole : float in [0, 1)
    The filter of these samples is 1 / (1 - start_pole q^-1)^na: near the poles of the plant it takes most of the
    bias away.
fading : float in (0, 1)
    The poles of the running filter are `fading` times those of the estimate.
model_rate : float in (0, 1]
    Part of the way that the running model follows the estimate in a sample.

Raises
------
ValueError
    Where an argument is outside its range.)")
      .def(py::init([](std::int32_t settling, double start_pole, double fading, double model_rate) {
             return checked(Gradient{{}, settling, start_pole, fading, model_rate},
                            "GradientOptions: needs settling in 1..1000000, 0 <= start_pole < 1, "
                            "0 < fading < 1 and 0 < model_rate <= 1");
           }),
           py::kw_only(), py::arg("settling") = gradient.settling,
           py::arg("start_pole") = gradient.start_pole, py::arg("fading") = gradient.fading,
           py::arg("model_rate") = gradient.model_rate)
      .def_readonly("settling", &Gradient::settling)
      .def_readonly("start_pole", &Gradient::start_pole)
      .def_readonly("fading", &Gradient::fading)
      .def_readonly("model_rate", &Gradient::model_rate)
      .def("__repr__", [](const py::object& self) {
        return show_properties(self, {"settling", "start_pole", "fading", "model_rate"});
      });
}

/// The servo that the first kSize parameters are.
template <int kSize>
ServoReading<double> read_servo(const AnyEstimator& self, double dt_s) {
  const std::vector<double> all = self.theta_hat();
  const std::vector<double> spread_of_all = self.covariance();
  const auto n = static_cast<std::size_t>(self.n());
  Vector<double, kSize> theta;
  SquareMatrix<double, kSize> spread;
  for (int i = 0; i < kSize; ++i) {
    const auto row = static_cast<std::size_t>(i);
    theta[i] = all[row];
    for (int j = 0; j < kSize; ++j) {
      spread(i, j) = spread_of_all[n * row + static_cast<std::size_t>(j)];
    }
  }
  if constexpr (kSize == 5) {
    return identify_integrating_servo(theta, spread, dt_s);
  } else {
    return identify_servo(theta, spread, dt_s);
  }
}

ServoReading<double> servo_of(const AnyEstimator& self, double dt_s) {
  require_free(self);
  const ModelShape orders = self.orders();
  const bool integrates = self.integrates();
  if (!has_orders_of_servo(orders.na, orders.nb, orders.nk, integrates)) {
    throw py::value_error(
        "servo: the estimator has na = " + std::to_string(orders.na) +
        ", nb = " + std::to_string(orders.nb) + ", nk = " + std::to_string(orders.nk) +
        (integrates ? " beside the known integrator; expected na = 2, nb = 3 and nk >= 1: make it "
                      "with ArxEstimator(2, 3, 1, integrator=True)"
                    : "; a servo is of third order, expected na = 3, nb = 3 and nk >= 1: make it "
                      "with ArxEstimator(3, 3, 1)"));
  }
  ServoReading<double> reading = integrates ? read_servo<5>(self, dt_s) : read_servo<6>(self, dt_s);
  judge(reading, self.white(), self.settled(), self.converged(), self.residual_variance());
  return reading;
}

Method to_method(const std::string& name) {
  if (name == "rls") {
    return Method::rls;
  }
  if (name == "riv") {
    return Method::instrumental_variables;
  }
  throw py::value_error("method is '" + name + "'; expected 'rls' or 'riv'");
}

template <class Scalar>
std::unique_ptr<AnyEstimator> make_any(const EstimatorSettings& settings) {
  return settings.method == Method::rls ? make_estimator<Scalar>(settings)
                                        : make_instrumental_estimator<Scalar>(settings);
}

}  // namespace

void bind_arx_estimator(py::module_& m) {
  bind_options(m);
  bind_gradient_options(m);

  py::class_<AnyEstimator> cls(
      m, "ArxEstimator",
      R"(Online ARX identification: regressor, RLS, reset and convergence monitor.

Runs the C++ code that firmware runs; float32 results are bit for bit the same. Parameters are
(a1 .. a_na, b1 .. b_nb [, c]) of Eqs. (7)-(8), in the units of the signals about the offsets of the scaling.
Use one object from one thread at a time.

Parameters
----------
na, nb : int in 1..6
nk : int in 0..20
    Delay in samples.
offset : bool
    Append a constant term c.
forgetting : Forgetting
    Forgetting policy, see policies().
scaling : Scaling
    Scales and offsets of the signals.
rls : RlsOptions
    Guards against wind-up.
reset : RmseResetOptions or None
    None never resets. Not read by "riv", which begins anew by itself.
convergence : ConvergenceOptions
    When `settled` turns True.
theta0 : array_like, shape (n,), optional
    Start values in the units of the signals; zero by default.
variance0 : array_like, shape (n,), optional
    Diagonal of P0 in scaled units and units of sigma^2; 1e6 by default.
input_limit : float > 0, optional
    Largest plausible |scaled signal|; beyond it a sample is refused.
method : str
    "rls", least squares, right with white equation noise; "riv", instrumental variables, for a noisy
    position sensor, takes the policies Constant and Exponential only. See docs/which_estimator.md.
gradient : GradientOptions
    Filters of the method "riv".
integrator : bool
    For a plant that is known to integrate, as a servo is: A is that of y(k) - y(k-1), with na poles beside the
    integrator. servo() reads na = 2, nb = 3.
dtype : float32 or float64
    Precision of the recursion.

Raises
------
ValueError
    Where an argument is outside its range.)");
  cls.def(py::init([](int na, int nb, int nk, bool offset, const ForgettingSettings& forgetting,
                      const Scaling<double>& scaling, const RlsOptions<double>& rls,
                      const std::optional<RmseResetOptions<double>>& reset,
                      const ConvergenceOptions<double>& convergence, std::vector<double> theta0,
                      std::vector<double> variance0, std::optional<double> input_limit,
                      const std::string& method, const GradientOptions<double>& gradient,
                      bool integrator, const py::object& dtype) {
            require_range("na", na, 1, kMaxOrder);
            require_range("nb", nb, 1, kMaxOrder);
            require_range("nk", nk, 0, kMaxDelay);
            const EstimatorSettings settings{na,
                                             nb,
                                             nk,
                                             offset,
                                             forgetting,
                                             scaling,
                                             rls,
                                             reset,
                                             convergence,
                                             std::move(theta0),
                                             std::move(variance0),
                                             input_limit,
                                             to_method(method),
                                             gradient,
                                             integrator};
            return is_single(dtype) ? make_any<float>(settings) : make_any<double>(settings);
          }),
          py::arg("na"), py::arg("nb"), py::arg("nk"), py::kw_only(), py::arg("offset") = false,
          py::arg("forgetting") = PolicySettings<place_of_policy(kDefaultPolicy)>{},
          py::arg_v("scaling", Scaling<double>{}, "Scaling()"),
          py::arg_v("rls", RlsOptions<double>{}, "RlsOptions()"),
          py::arg_v("reset", RmseResetOptions<double>{}, "RmseResetOptions()"),
          py::arg_v("convergence", ConvergenceOptions<double>{}, "ConvergenceOptions()"),
          py::arg("theta0") = std::vector<double>{}, py::arg("variance0") = std::vector<double>{},
          py::arg("input_limit") = py::none(), py::arg("method") = "rls",
          py::arg_v("gradient", GradientOptions<double>{}, "GradientOptions()"),
          py::arg("integrator") = false, py::arg("dtype") = "float32");
  bind_recursion(cls);
  cls.def_property_readonly(
         "covariance",
         [](const AnyEstimator& self) { return as_matrix_array(self.covariance(), self.n()); },
         "Covariance of theta_hat, shape (n, n), in the units of the signals. It is larger by the "
         "factor 1 + whiteness where the residuals are not white. standard_deviation has the roots "
         "of its diagonal.")
      .def(
          "servo", &servo_of, py::arg("dt_s"),
          R"(Reads the estimate as a servo: K, omega_n and xi, with their deviations and what the residuals say.

It is identify_servo() of theta_hat and covariance, without the constant term where there is one.

Parameters
----------
dt_s : float > 0
    Sampling period, s.

Returns
-------
ServoReading
    An estimate that is no servo is not an error: see its status and description. trusted is True where it is one, and
    the estimator has converged; else reason says why not. With noise on the position sensor the residuals of least
    squares are not white, and reason is model_does_not_fit: take a ServoEstimator there.

Raises
------
ValueError
    The orders are not those of a servo: na = nb = 3, or with integrator=True na = 2 and nb = 3, and nk >= 1.

Examples
--------
>>> estimator = ehsid.ArxEstimator(3, 3, 1, offset=True)
>>> estimator.servo(0.005).trusted
False)")
      .def_property("enabled", &AnyEstimator::enabled, &AnyEstimator::enable,
                    "While False the sample history moves on and the estimate rests (bumpless).")
      .def_property_readonly("settled", &AnyEstimator::settled,
                             "True once every standard deviation of white residuals stays inside "
                             "the tolerance.")
      .def_property_readonly("converged", &AnyEstimator::converged,
                             "True where the estimate has settled and at least 300 samples say "
                             "that its residuals are white, so that its deviations hold.")
      .def_property_readonly(
          "residuals_white", &AnyEstimator::white,
          "False where the residuals can be predicted: theta is biased then, and "
          "standard_deviation, "
          "though enlarged by sqrt(1 + whiteness), may not hold. The noise is on the measured "
          "position, or the model lacks something. True before 100 samples.")
      .def_property_readonly(
          "whiteness", &AnyEstimator::whiteness,
          "Statistic of the test for white residuals: chi-squared with 6 degrees of freedom "
          "where they are white. False alarm level 22.458 (1e-3), release 12.592.")
      .def_property_readonly(
          "excitation", &AnyEstimator::excitation,
          "Share of about the last 100 samples during which every parameter was excited, 0 to 1.")
      .def_property_readonly("resets", &AnyEstimator::resets, "Plant changes detected so far.")
      .def(
          "seed",
          [](AnyEstimator& self, const std::vector<double>& theta, const py::object& u,
             const std::vector<double>& d, double noise_variance) {
            if (self.seed(theta, unit_upper(self, u), d, noise_variance) != Status::ok) {
              throw py::value_error(
                  "seed: theta, u, d and u diag(d) u' must be finite, d > 0, noise_variance >= 0, "
                  "and "
                  "theta and noise_variance so small that their squares are finite in the "
                  "precision "
                  "of the estimator; nothing was changed");
            }
          },
          py::arg("theta"), py::arg("u"), py::arg("d"), py::arg("noise_variance") = 0.0,
          R"(Starts anew from an estimate made elsewhere, e.g. offline.

Where noise_variance is known, errors far beyond it raise the reset from the first sample on. A reset, then or
later, goes back to variance0, not to this P: it says that the plant is not the one that was known.

Parameters
----------
theta : array_like, shape (n,)
    In the units of the signals.
u : array_like, shape (n, n)
    Unit upper triangular; P = u diag(d) u' in scaled units and units of sigma^2.
d : array_like, shape (n,)
    Greater than 0.
noise_variance : float >= 0
    sigma^2 in squared units of the position; 0 for unknown.

Raises
------
TypeError, ValueError
    Not numbers, another shape, or out of range; nothing is changed.)")
      .def("step", &AnyEstimator::step, py::arg("command"), py::arg("position"),
           R"(Takes one sample.

Parameters
----------
command, position : float
    In the units of the signals, e.g. V and m.

Returns
-------
Status
    A sample that is not finite or not plausible is refused, without an exception: see is_error().)")
      .def(
          "run",
          [](AnyEstimator& self, const py::object& u, const py::object& y) {
            return self.single() ? run<float>(self, u, y) : run<double>(self, u, y);
          },
          py::arg("u"), py::arg("y"),
          R"(Takes samples in order, as step() would. Releases the GIL.

Parameters
----------
u : array_like, shape (N,)
    Command, in the units of the signal.
y : array_like, shape (N,)
    Position, in the units of the signal.

Returns
-------
Trajectory

Raises
------
TypeError, ValueError
    Not real numbers, or shapes that do not fit; no sample was taken.)");
}

}  // namespace ehsid::bindings
