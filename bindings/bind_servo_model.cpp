// SPDX-License-Identifier: MIT
#include "bindings.hpp"

#include <ehsid/servo_model.hpp>

namespace ehsid::bindings {
namespace {

using Parameters = ServoParameters<double>;
using Servo = ContinuousServo<double>;
using Reading = ServoReading<double>;

std::string number(double value) { return py::repr(py::float_(value)).cast<std::string>(); }

/// The status in words: what is wrong and what may mend it.
const char* describe(ServoReadingStatus status) {
  switch (status) {
    case ServoReadingStatus::ok:
      return "theta reads as a servo under zero-order hold";
    case ServoReadingStatus::not_finite:
      return "theta, covariance or dt_s holds NaN or infinity";
    case ServoReadingStatus::invalid_argument:
      return "dt_s is not positive, or the covariance has a negative variance";
    case ServoReadingStatus::no_integrator:
      return "no real pole at z = 1 within its uncertainty: the output is not the integral of a "
             "velocity (spring load, velocity measured instead of position, trend removed), or "
             "noise has moved the pole";
    case ServoReadingStatus::poles_not_separable:
      return "the uncertainty of the integrator pole reaches the next pole: longer sampling "
             "period, "
             "richer command or more data needed";
    case ServoReadingStatus::pole_near_zero:
      return "a pole is zero within its uncertainty: it decays within one sampling period, so its "
             "rate is not in the data; shorter sampling period or a lower order needed";
    case ServoReadingStatus::negative_real_pole:
      return "a pole is real and negative: no continuous model of this order samples to that; "
             "noise fitted, or sampled too slowly";
    case ServoReadingStatus::unstable_pole:
      return "a pole other than the integrator lies on or outside the unit circle: damping would "
             "be zero or negative";
    case ServoReadingStatus::aliasing:
      return "the natural frequency is at or above half the sampling rate: the poles' angle "
             "reaches "
             "pi within its uncertainty, or b is that of such a servo; shorter sampling period "
             "needed";
    case ServoReadingStatus::no_gain:
      return "b1, b2 and b3 are all zero: the command does not move the output";
    case ServoReadingStatus::numerical_limit:
      return "a result or its standard deviation is not finite; is the covariance positive "
             "semidefinite?";
  }
  return "unknown status";
}

Servo to_continuous(const Parameters& parameters) {
  Servo servo{};
  const Status status = continuous_servo(parameters, servo);
  if (status == Status::invalid_argument) {
    throw py::value_error(
        "continuous_servo: k_v, k_q, a_p, v_t, beta_e, m_t must be finite and > 0, k_c and c_p "
        "finite and >= 0");
  }
  if (status != Status::ok) {
    throw py::value_error("continuous_servo: gain, omega_n or xi overflows; check the units (SI)");
  }
  return servo;
}

py::array_t<double> to_theta(const Servo& servo, double dt_s) {
  Vector<double, 6> theta;
  const std::string given = "discretise: gain " + number(servo.gain) + ", omega_n " +
                            number(servo.omega_n) + ", xi " + number(servo.xi) + ", dt_s " +
                            number(dt_s) + ": ";
  switch (discretise(servo, dt_s, theta)) {
    case Status::ok:
      return py::array_t<double>(6, theta.data());
    case Status::invalid_input:
      throw py::value_error(given + "all must be finite");
    case Status::out_of_range:
      throw py::value_error(given +
                            "omega_n * dt_s must be at least 1e-6, and omega_n * dt_s and "
                            "2 * xi * omega_n * dt_s at most 1024");
    case Status::numerical_limit:
      throw py::value_error(given + "a coefficient overflows");
    default:
      throw py::value_error(given + "expected omega_n > 0, xi >= 0 and dt_s > 0");
  }
}

template <int kSize>
Reading from_theta(const InputArray<double>& theta, const InputArray<double>& covariance,
                   double dt_s) {
  require_exactly("covariance", covariance, py::make_tuple(kSize, kSize));
  using RowMajor = Eigen::Matrix<double, kSize, kSize, Eigen::RowMajor>;
  const Vector<double, kSize> theta_copy = Eigen::Map<const Vector<double, kSize>>(theta.data());
  const SquareMatrix<double, kSize> covariance_copy = Eigen::Map<const RowMajor>(covariance.data());
  if constexpr (kSize == 5) {
    return identify_integrating_servo(theta_copy, covariance_copy, dt_s);
  } else {
    return identify_servo(theta_copy, covariance_copy, dt_s);
  }
}

Reading read_servo(const InputArray<double>& theta, const InputArray<double>& covariance,
                   double dt_s) {
  if (theta.ndim() == 1 && theta.shape(0) == 5) {
    return from_theta<5>(theta, covariance, dt_s);
  }
  require_exactly("theta", theta, py::make_tuple(6));
  return from_theta<6>(theta, covariance, dt_s);
}

void bind_forwards(py::module_& m) {
  py::class_<Parameters>(m, "ServoParameters", R"(Physical parameters of Eqs. (1)-(4), SI.

Parameters
----------
k_v : float > 0
    Spool displacement per volt, m/V.
k_q : float > 0
    Flow gain, m^2/s (m^3/s per m of spool).
k_c : float >= 0
    Flow-pressure coefficient, m^3/(s Pa).
c_p : float >= 0
    Leakage coefficient, m^3/(s Pa).
a_p : float > 0
    Piston area, m^2.
v_t : float > 0
    Total volume under compression, m^3.
beta_e : float > 0
    Effective bulk modulus, Pa.
m_t : float > 0
    Moved mass, kg.)")
      .def(py::init([](double k_v, double k_q, double k_c, double c_p, double a_p, double v_t,
                       double beta_e, double m_t) {
             return Parameters{k_v, k_q, k_c, c_p, a_p, v_t, beta_e, m_t};
           }),
           py::kw_only(), py::arg("k_v"), py::arg("k_q"), py::arg("k_c"), py::arg("c_p"),
           py::arg("a_p"), py::arg("v_t"), py::arg("beta_e"), py::arg("m_t"))
      .def_readonly("k_v", &Parameters::k_v, "Spool displacement per volt, m/V.")
      .def_readonly("k_q", &Parameters::k_q, "Flow gain, m^2/s.")
      .def_readonly("k_c", &Parameters::k_c, "Flow-pressure coefficient, m^3/(s Pa).")
      .def_readonly("c_p", &Parameters::c_p, "Leakage coefficient, m^3/(s Pa).")
      .def_readonly("a_p", &Parameters::a_p, "Piston area, m^2.")
      .def_readonly("v_t", &Parameters::v_t, "Total volume under compression, m^3.")
      .def_readonly("beta_e", &Parameters::beta_e, "Effective bulk modulus, Pa.")
      .def_readonly("m_t", &Parameters::m_t, "Moved mass, kg.")
      .def("__repr__", [](const py::object& self) {
        return show_properties(self, {"k_v", "k_q", "k_c", "c_p", "a_p", "v_t", "beta_e", "m_t"});
      });

  py::class_<Servo>(m, "ContinuousServo",
                    R"(Y(s)/U(s) = K omega_n^2 / (s (s^2 + 2 xi omega_n s + omega_n^2)), Eq. (5).

Parameters
----------
gain : float
    Velocity gain K, m/(s V).
omega_n : float > 0
    Undamped natural frequency, rad/s.
xi : float >= 0
    Damping ratio; above 1 the two poles are real.)")
      .def(
          py::init([](double gain, double omega_n, double xi) { return Servo{gain, omega_n, xi}; }),
          py::kw_only(), py::arg("gain"), py::arg("omega_n"), py::arg("xi"))
      .def_readonly("gain", &Servo::gain, "Velocity gain K, m/(s V).")
      .def_readonly("omega_n", &Servo::omega_n, "Undamped natural frequency, rad/s.")
      .def_readonly("xi", &Servo::xi, "Damping ratio.")
      .def("__repr__", [](const Servo& s) {
        return "ContinuousServo(gain=" + number(s.gain) + ", omega_n=" + number(s.omega_n) +
               ", xi=" + number(s.xi) + ")";
      });

  m.def("continuous_servo", &to_continuous, py::arg("parameters"),
        R"(Continuous model (5) from the physical parameters.

K = k_q k_v / a_p, omega_n = a_p sqrt(4 beta_e / (v_t m_t)),
xi = sqrt(4 beta_e m_t / v_t) (k_c + c_p) / (2 a_p).

Parameters
----------
parameters : ServoParameters

Returns
-------
ContinuousServo

Raises
------
ValueError
    A parameter is outside its range, or the result is not finite.)");

  m.def("discretise", &to_theta, py::arg("servo"), py::arg("dt_s"),
        R"(Zero-order hold of the continuous model, Eq. (6).

Parameters
----------
servo : ContinuousServo
dt_s : float > 0
    Sampling period, s. 1e-6 <= omega_n dt_s and omega_n dt_s max(1, 2 xi) <= 1024.

Returns
-------
numpy.ndarray, shape (6,)
    theta = (a1, a2, a3, b1, b2, b3); a without unit, b in m/V.

Raises
------
ValueError
    A number is outside its range.)");
}

void bind_backwards(py::module_& m) {
  using Code = ServoReadingStatus;
  py::native_enum<Code>(m, "ServoReadingStatus", "enum.IntEnum",
                        "Whether theta can be read as a servo, and if not, why.")
      .value("ok", Code::ok, describe(Code::ok))
      .value("not_finite", Code::not_finite, describe(Code::not_finite))
      .value("invalid_argument", Code::invalid_argument, describe(Code::invalid_argument))
      .value("no_integrator", Code::no_integrator, describe(Code::no_integrator))
      .value("poles_not_separable", Code::poles_not_separable, describe(Code::poles_not_separable))
      .value("pole_near_zero", Code::pole_near_zero, describe(Code::pole_near_zero))
      .value("negative_real_pole", Code::negative_real_pole, describe(Code::negative_real_pole))
      .value("unstable_pole", Code::unstable_pole, describe(Code::unstable_pole))
      .value("aliasing", Code::aliasing, describe(Code::aliasing))
      .value("no_gain", Code::no_gain, describe(Code::no_gain))
      .value("numerical_limit", Code::numerical_limit, describe(Code::numerical_limit))
      .finalize();

  py::class_<Reading>(m, "ServoReading",
                      "What theta says about the servo, made by ArxEstimator.servo() and "
                      "identify_servo(). Numbers that "
                      "were not determined are NaN. gain is also told where only omega_n and xi "
                      "cannot be read.")
      .def_readonly("status", &Reading::status, "ServoReadingStatus.")
      .def_property_readonly(
          "description", [](const Reading& r) { return describe(r.status); },
          "The status in words: what is wrong and what may mend it.")
      .def_readonly("gain", &Reading::gain, "Velocity gain K, m/(s V).")
      .def_readonly("omega_n", &Reading::omega_n, "Undamped natural frequency, rad/s.")
      .def_readonly("xi", &Reading::xi, "Damping ratio.")
      .def_readonly("gain_std", &Reading::gain_std, "Standard deviation of gain, m/(s V).")
      .def_readonly("omega_n_std", &Reading::omega_n_std, "Standard deviation of omega_n, rad/s.")
      .def_readonly("xi_std", &Reading::xi_std, "Standard deviation of xi.")
      .def_property_readonly(
          "covariance",
          [](const Reading& r) { return py::array_t<double>({3, 3}, r.covariance.data()); },
          "Covariance of (gain, omega_n, xi), shape (3, 3).")
      .def_readonly("integrator_pole", &Reading::integrator_pole, "The real pole nearest to z = 1.")
      .def_readonly("integrator_pole_std", &Reading::integrator_pole_std, "Its standard deviation.")
      .def_readonly("integrator_distance", &Reading::integrator_distance,
                    "Its distance from z = 1.")
      .def_readonly(
          "zoh_mismatch", &Reading::zoh_mismatch,
          "|b - b_implied| / |b|: b of theta against the b that (gain, omega_n, xi) imply "
          "under zero-order hold.")
      .def_readonly(
          "zoh_mismatch_chi2", &Reading::zoh_mismatch_chi2,
          "Squared distance of b from b_implied in its own covariance; chi-squared with 2 "
          "degrees of freedom where the model holds (99 % below 9.21).")
      .def_property_readonly("trusted", &Reading::trusted,
                             "True where the estimator has converged and theta is a servo. Only "
                             "ArxEstimator.servo() can tell.")
      .def_readonly(
          "reason", &Reading::reason,
          "TrustReason.trusted, or why it is not. identify_servo() knows no residuals and "
          "says starting.")
      .def_readonly("residual_std", &Reading::residual_std,
                    "Standard deviation of the residuals, units of the position; NaN from "
                    "identify_servo().")
      .def("__repr__", [](const Reading& r) {
        if (r.status != Code::ok) {
          return "ServoReading(" + py::str(py::cast(r.status).attr("name")).cast<std::string>() +
                 ": " + describe(r.status) + ")";
        }
        return "ServoReading(gain=" + number(r.gain) + " +- " + number(r.gain_std) +
               ", omega_n=" + number(r.omega_n) + " +- " + number(r.omega_n_std) +
               ", xi=" + number(r.xi) + " +- " + number(r.xi_std) + ")";
      });

  m.def("identify_servo", &read_servo, py::arg("theta"), py::arg("covariance"), py::arg("dt_s"),
        R"(Reads an estimated third-order model as a servo, Eq. (6) back to Eq. (5).

Parameters
----------
theta : array_like, shape (6,)
    (a1, a2, a3, b1, b2, b3); a without unit, b in m/V. Or, shape (5,), (a1, a2, b1, b2, b3) of an estimator with
    integrator=True.
covariance : array_like, shape (6, 6) or (5, 5)
    Covariance of theta, sigma^2 P; symmetric, positive semidefinite. Zeros where it is unknown: the
    standard deviations then only hold the rounding of theta.
dt_s : float > 0
    Sampling period, s.

Returns
-------
ServoReading
    With standard deviations by the delta method. A theta that is no servo is not an error: see
    its status and description.

Raises
------
ValueError
    theta or covariance has another shape.)");
}

}  // namespace
}  // namespace ehsid::bindings

void bind_servo_model(pybind11::module_& m) {
  ehsid::bindings::bind_forwards(m);
  ehsid::bindings::bind_backwards(m);
}
