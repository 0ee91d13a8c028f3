// SPDX-License-Identifier: MIT
// What the binding files share: array types and the checks every entry point needs.
#pragma once

#include "any_estimator.hpp"

#include <pybind11/native_enum.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <initializer_list>
#include <string>

namespace ehsid::bindings {

namespace py = pybind11;

template <class Scalar>
using PlainArray = py::array_t<Scalar, py::array::c_style | py::array::forcecast>;

/// An array as Python gives it: every way from a Python object to one refuses masked arrays.
template <class Scalar>
struct InputArray : PlainArray<Scalar> {
  using PlainArray<Scalar>::PlainArray;
};

/// RuntimeError while a run() of this object goes on in another thread. Also asked behind a conversion of arguments, which
/// may let other threads work.
void require_free(const OneThread& object);

/// TypeError for a masked array of numpy: read as an array, its masked entries would pass for measured ones.
void refuse_masked(const char* name, py::handle values);

}  // namespace ehsid::bindings

template <class Scalar>
struct pybind11::detail::pyobject_caster<ehsid::bindings::InputArray<Scalar>> {
  using Array = ehsid::bindings::InputArray<Scalar>;
  PYBIND11_TYPE_CASTER(Array, handle_type_name<ehsid::bindings::PlainArray<Scalar>>::name);

  bool load(handle source, bool convert) {
    ehsid::bindings::refuse_masked("an argument", source);
    make_caster<ehsid::bindings::PlainArray<Scalar>> plain;
    if (!plain.load(source, convert)) {
      return false;
    }
    value = Array(cast_op<ehsid::bindings::PlainArray<Scalar>&>(plain));
    return true;
  }
};

/// Every use of such an object from Python passes here: a use beside its run() is refused, as both would change or read
/// the same memory at once.
template <class Type>
class pybind11::detail::type_caster<
    Type, std::enable_if_t<std::is_base_of_v<ehsid::bindings::OneThread, Type>>>
    : public type_caster_base<Type> {
 public:
  bool load(handle source, bool convert) {
    if (!type_caster_base<Type>::load(source, convert)) {
      return false;
    }
    if (this->value != nullptr) {
      ehsid::bindings::require_free(*static_cast<const Type*>(this->value));
    }
    return true;
  }
};

namespace ehsid::bindings {

/// While it lives no thread of Python may use this object.
struct Busy {
  explicit Busy(OneThread& one) : object(one) {
    require_free(object);
    object.running = true;
  }
  ~Busy() { object.running = false; }
  Busy(const Busy&) = delete;
  Busy& operator=(const Busy&) = delete;
  OneThread& object;
};

/// Around a run() of this object: lets the other threads of Python work, which may not use the object meanwhile.
class Run {
 public:
  explicit Run(OneThread& object) : mark_(object) {}

 private:
  Busy mark_;  // set before the GIL is released, cleared after it is taken again
  py::gil_scoped_release released_;
};

/// A run, as numpy arrays of the estimator's precision.
struct Trajectory {
  py::array theta;
  py::array standard_deviation;
  py::array innovation;
  py::array forgetting_factor;
  py::array residual_variance;
  py::array status;
  py::object converged;  // None where the recursion ran alone
};

/// Arrays for `rows` samples of n parameters, and where they lie in memory.
template <class Scalar>
Trajectory make_trajectory(py::ssize_t rows, py::ssize_t n, bool with_converged,
                           TrajectoryView<Scalar>& view) {
  py::array_t<Scalar> theta({rows, n});
  py::array_t<Scalar> deviation({rows, n});
  py::array_t<Scalar> innovation(rows);
  py::array_t<Scalar> factor(rows);
  py::array_t<Scalar> variance(rows);
  py::array_t<std::uint8_t> status(rows);
  py::object converged = py::none();
  bool* converged_data = nullptr;
  if (with_converged) {
    py::array_t<bool> flags(rows);
    converged_data = flags.mutable_data();
    converged = flags;
  }
  view = {theta.mutable_data(),  deviation.mutable_data(), innovation.mutable_data(),
          factor.mutable_data(), variance.mutable_data(),  status.mutable_data(),
          converged_data};
  return {theta, deviation, innovation, factor, variance, status, converged};
}

/// The same for a bank: `rows` samples of each of `estimators` estimators.
template <class Scalar>
Trajectory make_bank_trajectory(py::ssize_t rows, py::ssize_t estimators, py::ssize_t n,
                                TrajectoryView<Scalar>& view) {
  py::array_t<Scalar> theta({rows, estimators, n});
  py::array_t<Scalar> deviation({rows, estimators, n});
  py::array_t<Scalar> innovation({rows, estimators});
  py::array_t<Scalar> factor({rows, estimators});
  py::array_t<Scalar> variance({rows, estimators});
  py::array_t<std::uint8_t> status({rows, estimators});
  py::array_t<bool> converged({rows, estimators});
  view = {theta.mutable_data(),    deviation.mutable_data(), innovation.mutable_data(),
          factor.mutable_data(),   variance.mutable_data(),  status.mutable_data(),
          converged.mutable_data()};
  return {theta, deviation, innovation, factor, variance, status, converged};
}

/// True for float32, false for float64, ValueError for anything else.
bool is_single(const py::object& dtype);

/// ValueError unless first <= value <= last.
void require_range(const char* name, int value, int first, int last);

/// ValueError unless `array` has the wanted number of dimensions and, where given, length.
void require_shape(const char* name, const py::array& array, py::ssize_t dimensions,
                   py::ssize_t length);

/// ValueError unless `array` has the wanted shape.
void require_exactly(const char* name, const py::array& array, const py::tuple& shape);

/// `values` as an array in the precision of the estimator; TypeError unless it holds real numbers, none of them masked.
template <class Scalar>
InputArray<Scalar> real_array(const char* name, const py::object& values) {
  refuse_masked(name, values);
  const py::array given(values);
  if (std::string("biuf").find(given.dtype().kind()) == std::string::npos) {
    throw py::type_error(std::string(name) + " must hold real numbers, got dtype " +
                         py::str(given.dtype()).cast<std::string>());
  }
  return InputArray<Scalar>(given);
}

/// Why restore() refuses a saved state, and what to do.
std::string refusal(SnapshotFault fault);

/// "Scaling(command_scale=10.0, ...)": type and the properties named, as Python shows them.
std::string show_properties(const py::object& self, std::initializer_list<const char*> names);

py::array_t<double> as_vector_array(const std::vector<double>& values);
py::array_t<double> as_matrix_array(const std::vector<double>& values, int n);

/// save() and restore() of an estimator.
template <class Class>
void bind_snapshot(Class& cls) {
  using Any = typename Class::type;
  cls.def(
         "save", [](const Any& self) { return py::bytes(self.save()); },
         "Whole state as bytes, for restore() of an estimator made with the same arguments, here "
         "or "
         "in C++ and C (docs/linking.md).")
      .def(
          "restore",
          [](Any& self, const py::bytes& state) {
            const SnapshotFault fault = self.restore(state);
            if (fault != SnapshotFault::none) {
              throw py::value_error(refusal(fault));
            }
          },
          py::arg("state"),
          "Takes over a saved state. ValueError, and nothing changed, where the bytes are damaged "
          "or "
          "were saved by another version, or by an estimator made with other arguments.");
}

/// Properties and methods that Rls and ArxEstimator share.
template <class Class>
void bind_recursion(Class& cls) {
  using Any = typename Class::type;
  cls.def_property_readonly("n", &Any::n, "Number of parameters.")
      .def_property_readonly(
          "dtype",
          [](const Any& self) {
            return self.single() ? py::dtype::of<float>() : py::dtype::of<double>();
          },
          "Precision the recursion runs in, float32 or float64.")
      .def_property_readonly(
          "theta_hat", [](const Any& self) { return as_vector_array(self.theta_hat()); },
          "Estimated parameters, shape (n,).")
      .def_property_readonly(
          "standard_deviation",
          [](const Any& self) { return as_vector_array(self.standard_deviation()); },
          "Standard deviations, shape (n,), in the units of theta_hat.")
      .def_property_readonly(
          "gain", [](const Any& self) { return as_vector_array(self.gain()); },
          "Gain K(k) of the last kept step, shape (n,); of the scaled signals in an ArxEstimator.")
      .def_property_readonly(
          "P", [](const Any& self) { return as_matrix_array(self.P(), self.n()); },
          "Covariance in units of sigma^2, shape (n, n), formed from the factors; of the scaled "
          "parameters in an ArxEstimator.")
      .def_property_readonly(
          "innovation", &Any::innovation,
          "Measured minus predicted, Eq. (12), of the last sample estimated, in units of "
          "the output.")
      .def_property_readonly("forgetting_factor", &Any::forgetting_factor,
                             "lambda(k) of the last kept step, in (0, 1].")
      .def_property_readonly("residual_variance", &Any::residual_variance,
                             "Estimate of sigma^2, squared units of the output.")
      .def("reset", &Any::reset, "lambda and P back to their start values; theta stays (Fig. 4).");
  bind_snapshot(cls);
}

void bind_types(py::module_& m);
void bind_forgetting(py::module_& m);
void bind_rls(py::module_& m);
void bind_effects(py::module_& m);
void bind_plant(py::module_& m);
void bind_outside(py::module_& m);
void bind_arx_estimator(py::module_& m);
void bind_estimator_bank(py::module_& m);
void bind_servo_estimator(py::module_& m);
void bind_servo_bank(py::module_& m);
void bind_growth_monitor(py::module_& m);

}  // namespace ehsid::bindings

void bind_servo_model(pybind11::module_& m);
