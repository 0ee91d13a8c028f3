// SPDX-License-Identifier: MIT
#include "bindings.hpp"

namespace ehsid::bindings {
namespace {

/// phi as a float64 vector of n numbers.
InputArray<double> regressor(const AnyRls& self, const py::object& values) {
  auto phi = real_array<double>("phi", values);
  require_shape("phi", phi, 1, self.n());
  require_free(self);
  return phi;
}

template <class Scalar>
Trajectory run(AnyRls& self, const py::object& phi_in, const py::object& y_in) {
  const auto phi = real_array<Scalar>("phi", phi_in);
  const auto y = real_array<Scalar>("y", y_in);
  require_shape("phi", phi, 2, self.n());
  require_shape("y", y, 1, phi.shape(0));
  TrajectoryView<Scalar> view{};
  Trajectory out = make_trajectory(y.shape(0), self.n(), false, view);
  const Scalar* phi_data = phi.data();
  const Scalar* y_data = y.data();
  const auto rows = static_cast<std::size_t>(y.shape(0));
  {
    const Run lasting(self);
    self.run(phi_data, y_data, rows, view);
  }
  return out;
}

}  // namespace

void bind_rls(py::module_& m) {
  const RlsOptions<double> defaults;
  py::class_<RlsOptions<double>>(m, "RlsOptions", R"(Guards against wind-up; dimensionless.

Parameters
----------
information_margin : float
    While some parameter is not excited, forgetting waits; after two and a half memories a sample is skipped
    where phi' P phi is below this many times what the policy forgets in one direction. 0 switches the rule
    off; negative (default) takes sqrt(n).
covariance_ceiling : float > 0
    The mean of P_ii / P0_ii never exceeds this; inf is not allowed, 1e30 never acts.

Raises
------
ValueError
    Where an argument is outside its range.)")
      .def(py::init([](double information_margin, double covariance_ceiling) {
             const RlsOptions<double> options{information_margin, covariance_ceiling};
             if (!options.valid()) {
               throw py::value_error(
                   "RlsOptions: information_margin must be finite, covariance_ceiling finite and > "
                   "0");
             }
             return options;
           }),
           py::kw_only(), py::arg("information_margin") = defaults.information_margin,
           py::arg("covariance_ceiling") = defaults.covariance_ceiling)
      .def_static(
          "textbook",
          [] {
            RlsOptions<double> options = RlsOptions<double>::textbook();
            // An estimator in float32 takes it, too.
            options.covariance_ceiling = std::numeric_limits<float>::max();
            return options;
          },
          "No guard: Eqs. (12)-(14) as they are printed, with the forgetting of the policy.")
      .def_readonly("information_margin", &RlsOptions<double>::information_margin)
      .def_readonly("covariance_ceiling", &RlsOptions<double>::covariance_ceiling)
      .def("__repr__", [](const py::object& self) {
        return show_properties(self, {"information_margin", "covariance_ceiling"});
      });

  py::class_<AnyRls> cls(
      m, "Rls", R"(Recursive least squares on UD factors, Eqs. (12)-(14), for any regressor.

Runs the C++ recursion that firmware runs; float32 results are bit for bit the same.
Use one object from one thread at a time.

Parameters
----------
n : int in 1..13
    Number of parameters.
forgetting : Forgetting
    Forgetting policy, see policies().
options : RlsOptions
    Guards against wind-up.
theta0 : array_like, shape (n,), optional
    Start values; zero by default.
variance0 : array_like, shape (n,), optional
    Diagonal of P0 in units of sigma^2, > 0; 1e6 by default.
dtype : float32 or float64
    Precision of the recursion.

Raises
------
ValueError
    Where an argument is outside its range.)");
  cls.def(py::init([](int n, const ForgettingSettings& forgetting,
                      const RlsOptions<double>& options, std::vector<double> theta0,
                      std::vector<double> variance0, const py::object& dtype) {
            require_range("n", n, 1, kMaxParameters);
            const RlsSettings settings{n, forgetting, options, std::move(theta0),
                                       std::move(variance0)};
            return is_single(dtype) ? make_rls<float>(settings) : make_rls<double>(settings);
          }),
          py::arg("n"), py::kw_only(),
          py::arg("forgetting") = PolicySettings<place_of_policy("constant")>{},
          py::arg_v("options", defaults, "RlsOptions()"), py::arg("theta0") = std::vector<double>{},
          py::arg("variance0") = std::vector<double>{}, py::arg("dtype") = "float64");
  bind_recursion(cls);
  cls.def("reset_all", &AnyRls::reset_all, "lambda, P and theta back to their start values.")
      .def(
          "start_from_covariance",
          [](AnyRls& self, const std::vector<double>& theta0, const py::object& p0_in) {
            const auto p0 = real_array<double>("p0", p0_in);
            require_exactly("p0", p0, py::make_tuple(self.n(), self.n()));
            const std::vector<double> values(p0.data(), p0.data() + p0.size());
            require_free(self);
            if (self.start_from_covariance(theta0, values) != Status::ok) {
              throw py::value_error(
                  "start_from_covariance: theta0 must be finite, p0 symmetric and positive "
                  "definite "
                  "in the precision of the estimator; nothing was changed");
            }
          },
          py::arg("theta0"), py::arg("p0"),
          R"(Starts from an estimate and its full covariance.

Parameters
----------
theta0 : array_like, shape (n,)
    Finite.
p0 : array_like, shape (n, n)
    In units of sigma^2; symmetric, positive definite.

Raises
------
TypeError, ValueError
    Not numbers, another shape, or not positive definite; nothing is changed.)")
      .def(
          "predict",
          [](const AnyRls& self, const py::object& phi) {
            return self.predict(regressor(self, phi).data());
          },
          py::arg("phi"),
          "phi' theta_hat for one regressor, shape (n,). TypeError or ValueError unless it is "
          "that.")
      .def(
          "update",
          [](AnyRls& self, const py::object& phi, double y) {
            return self.update(regressor(self, phi).data(), y);
          },
          py::arg("phi"), py::arg("y"),
          R"(Takes one sample of y = phi' theta + e, Eqs. (12)-(14).

Parameters
----------
phi : array_like, shape (n,)
y : float

Returns
-------
Status
    A sample that is not finite or not plausible is refused, without an exception: see is_error().

Raises
------
TypeError, ValueError
    phi does not hold real numbers, or has another shape.)")
      .def(
          "run",
          [](AnyRls& self, const py::object& phi, const py::object& y) {
            return self.single() ? run<float>(self, phi, y) : run<double>(self, phi, y);
          },
          py::arg("phi"), py::arg("y"),
          R"(Takes samples in order, as update() would. Releases the GIL.

Parameters
----------
phi : array_like, shape (N, n)
y : array_like, shape (N,)

Returns
-------
Trajectory

Raises
------
TypeError, ValueError
    Not real numbers, or shapes that do not fit; no sample was taken.)");
}

}  // namespace ehsid::bindings
