// SPDX-License-Identifier: MIT
#include "bindings.hpp"

namespace ehsid::bindings {
namespace {

/// The policy, or a ValueError that shows what was asked for.
template <class Policy>
Policy checked(Policy policy, const std::string& shown) {
  if (!policy.valid()) {
    throw py::value_error(shown + ": a parameter is outside its range, see help() of the class");
  }
  return policy;
}

std::string show(double value) { return py::repr(py::float_(value)).cast<std::string>(); }

std::string show(const Constant<double>& p) { return "Constant(lambda_=" + show(p.lambda) + ")"; }
std::string show(const Exponential<double>& p) {
  return "Exponential(lambda0=" + show(p.lambda0) + ", lambda_initial=" + show(p.lambda_initial) +
         ")";
}
std::string show(const ErrorDriven<double>& p) {
  return "ErrorDriven(memory=" + show(p.memory) + ", lambda_min=" + show(p.lambda_min) +
         ", noise_variance=" + show(p.noise_variance) + ")";
}
std::string show(const FRatio<double>& p) {
  return "FRatio(eta=" + show(p.eta) + ", critical_ratio=" + show(p.critical_ratio) + ")";
}
std::string show(const Directional<double>& p) {
  return "Directional(lambda_=" + show(p.lambda) + ", epsilon=" + show(p.epsilon) + ")";
}
std::string show(const RandomWalkSettings& p) {
  return "RandomWalk(drift=" + py::repr(py::cast(p.drift)).cast<std::string>() + ")";
}

RandomWalkSettings checked_random_walk(RandomWalkSettings settings) {
  for (const double value : settings.drift) {
    RandomWalk<double, 1> one;
    one.drift[0] = value;
    static_cast<void>(checked(one, show(settings)));
  }
  if (settings.drift.empty()) {
    throw py::value_error("RandomWalk: drift is empty; expected one value, or one a parameter");
  }
  return settings;
}

template <class Policy>
py::class_<Policy> bind_policy(py::module_& m, const char* name, const char* doc) {
  const std::string text = std::string(doc) +
                           "\n\nRaises\n------\nValueError\n"
                           "    Where an argument is outside its range.";
  return py::class_<Policy>(m, name, text.c_str()).def("__repr__", [](const Policy& p) {
    return show(p);
  });
}

}  // namespace

void bind_forgetting(py::module_& m) {
  const Constant<double> constant;
  bind_policy<Constant<double>>(m, "Constant",
                                R"(Constant forgetting factor (Eq. 13 with a fixed lambda).

Parameters
----------
lambda_ : float in (0, 1]
    Memory is 1 / (1 - lambda_) samples; 1 is ordinary least squares.)")
      .def(py::init([](double lambda) {
             Constant<double> p;
             p.lambda = lambda;
             return checked(p, show(p));
           }),
           py::arg("lambda_") = constant.lambda)
      .def_readonly("lambda_", &Constant<double>::lambda);

  const Exponential<double> exponential;
  bind_policy<Exponential<double>>(
      m, "Exponential",
      R"(Forgetting factor that tends to one: lambda(k) = lambda0 lambda(k-1) + (1 - lambda0), Eq. (15).

Parameters
----------
lambda0 : float in (0, 1]
    Rate at which lambda goes to one.
lambda_initial : float in (0, 1]
    lambda(0).)")
      .def(py::init([](double lambda0, double lambda_initial) {
             Exponential<double> p;
             p.lambda0 = lambda0;
             p.lambda_initial = lambda_initial;
             return checked(p, show(p));
           }),
           py::arg("lambda0") = exponential.lambda0,
           py::arg("lambda_initial") = exponential.lambda_initial)
      .def_readonly("lambda0", &Exponential<double>::lambda0)
      .def_readonly("lambda_initial", &Exponential<double>::lambda_initial);

  const ErrorDriven<double> error_driven;
  bind_policy<ErrorDriven<double>>(
      m, "ErrorDriven",
      R"(Constant-information forgetting (Fortescue, Kershenbaum, Ydstie, Automatica 17(6), 1981).

Parameters
----------
memory : float >= 1
    N0, the memory in the steady state, samples.
lambda_min : float in (0, 1]
    Forgetting never goes below this.
noise_variance : float >= 0
    sigma0^2 in squared units of the output as the recursion sees it (scaled in a ServoEstimator);
    0 takes the estimator's own residual variance.)")
      .def(py::init([](double memory, double lambda_min, double noise_variance) {
             ErrorDriven<double> p;
             p.memory = memory;
             p.lambda_min = lambda_min;
             p.noise_variance = noise_variance;
             return checked(p, show(p));
           }),
           py::arg("memory") = error_driven.memory, py::arg("lambda_min") = error_driven.lambda_min,
           py::arg("noise_variance") = error_driven.noise_variance)
      .def_readonly("memory", &ErrorDriven<double>::memory)
      .def_readonly("lambda_min", &ErrorDriven<double>::lambda_min)
      .def_readonly("noise_variance", &ErrorDriven<double>::noise_variance);

  const FRatio<double> f_ratio;
  bind_policy<FRatio<double>>(
      m, "FRatio",
      R"(Forgetting by the F-ratio of short- and long-window errors (Mohseni, Bernstein, ACC 2022).

Windows of 10 and 100 samples. critical_ratio = 1 is the RMS-ratio form of Bruce, Goel, Bernstein (2020).

Parameters
----------
eta : float >= 0
    Aggressiveness: lambda = 1 / (1 + eta g).
critical_ratio : float >= 1
    Ratio of mean squares above which something has changed.)")
      .def(py::init([](double eta, double critical_ratio) {
             FRatio<double> p;
             p.eta = eta;
             p.critical_ratio = critical_ratio;
             return checked(p, show(p));
           }),
           py::arg("eta") = f_ratio.eta, py::arg("critical_ratio") = f_ratio.critical_ratio)
      .def_readonly("eta", &FRatio<double>::eta)
      .def_readonly("critical_ratio", &FRatio<double>::critical_ratio);

  const Directional<double> directional;
  bind_policy<Directional<double>>(
      m, "Directional",
      R"(Directional forgetting, SIFt (Lai, Bernstein, arXiv 2404.10844): only excited directions forget.

Parameters
----------
lambda_ : float in (0, 1]
    Memory looks like n / (1 - lambda_) samples.
epsilon : float > 0
    Samples with phi' phi below this carry no information (scaled units in a ServoEstimator).)")
      .def(py::init([](double lambda, double epsilon) {
             Directional<double> p;
             p.lambda = lambda;
             p.epsilon = epsilon;
             return checked(p, show(p));
           }),
           py::arg("lambda_") = directional.lambda, py::arg("epsilon") = directional.epsilon)
      .def_readonly("lambda_", &Directional<double>::lambda)
      .def_readonly("epsilon", &Directional<double>::epsilon);

  const RandomWalkSettings random_walk;
  bind_policy<RandomWalkSettings>(
      m, "RandomWalk",
      R"(Kalman filter for parameters that wander: P grows by Q = diag(drift) a step.

Parameters
----------
drift : float or sequence of n floats, each >= 0
    Variance a step in units of sigma^2 (of the scaled parameters in a ServoEstimator).)")
      .def(py::init([](double drift) { return checked_random_walk({{drift}}); }),
           py::arg("drift") = random_walk.drift[0])
      .def(py::init(
               [](std::vector<double> drift) { return checked_random_walk({std::move(drift)}); }),
           py::arg("drift"))
      .def_readonly("drift", &RandomWalkSettings::drift);
}

}  // namespace ehsid::bindings
