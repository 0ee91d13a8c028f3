// SPDX-License-Identifier: MIT
#include "bindings.hpp"

#include <ehsid/tracked_servo.hpp>

namespace ehsid::bindings {

bool is_single(const py::object& dtype) {
  py::dtype wanted;
  try {
    wanted = py::dtype::from_args(dtype);
  } catch (const py::error_already_set&) {
    throw py::value_error("dtype must be float32 or float64, got " +
                          py::repr(dtype).cast<std::string>());
  }
  if (wanted.is(py::dtype::of<float>())) {
    return true;
  }
  if (wanted.is(py::dtype::of<double>())) {
    return false;
  }
  throw py::value_error("dtype must be float32 or float64, got " +
                        py::str(wanted).cast<std::string>());
}

void require_range(const char* name, int value, int first, int last) {
  if (value < first || value > last) {
    throw py::value_error(std::string(name) + " must be in " + std::to_string(first) + ".." +
                          std::to_string(last) + ", got " + std::to_string(value));
  }
}

void require_shape(const char* name, const py::array& array, py::ssize_t dimensions,
                   py::ssize_t length) {
  if (array.ndim() == dimensions && (length < 0 || array.shape(dimensions - 1) == length)) {
    return;
  }
  const std::string shape = py::str(array.attr("shape")).cast<std::string>();
  const std::string last = length < 0 ? "N" : std::to_string(length);
  throw py::value_error(std::string(name) + " has shape " + shape + ", expected " +
                        (dimensions == 1 ? "(" + last + ",)" : "(N, " + last + ")"));
}

void require_free(const OneThread& object) {
  if (object.running) {
    throw std::runtime_error(
        "another thread is inside run() of this object, which works in one thread at a time: wait "
        "for the end of that run, or make an object for each thread");
  }
}

void refuse_masked(const char* name, py::handle values) {
  if (py::isinstance<py::array>(values) &&
      py::isinstance(values, py::module_::import("numpy.ma").attr("MaskedArray"))) {
    throw py::type_error(
        std::string(name) +
        " is a masked array, and its mask would be lost; expected an array without "
        "mask: fill the masked entries, e.g. .filled(numpy.nan), or leave them out");
  }
}

void require_exactly(const char* name, const py::array& array, const py::tuple& shape) {
  const py::object given = array.attr("shape");
  if (!given.equal(shape)) {
    throw py::value_error(std::string(name) + " has shape " + py::str(given).cast<std::string>() +
                          ", expected " + py::str(shape).cast<std::string>());
  }
}

std::string refusal(SnapshotFault fault) {
  const auto reason = [fault]() -> std::string {
    switch (fault) {
      case SnapshotFault::none:
        break;
      case SnapshotFault::not_a_snapshot:
        return "the bytes are not a saved state of this class; give the bytes that save() returned";
      case SnapshotFault::other_version:
        return "the state was saved by another version of ehsid; save it anew with this version";
      case SnapshotFault::damaged:
        return "the bytes are damaged or incomplete (length or checksum is wrong); use another "
               "copy "
               "of the state";
      case SnapshotFault::other_model:
        return "the state is of an estimator with another model; expected the same orders, delay, "
               "offset, dtype and forgetting policy";
      case SnapshotFault::other_configuration:
        return "the state is of an estimator with another configuration; expected the same "
               "scaling, "
               "settings, limits and start values as when it was saved";
      case SnapshotFault::impossible:
        return "the checksum is right, but no estimator has such a state; use bytes that save() "
               "returned";
    }
    return "no reason";
  };
  return "restore: " + reason() + "; nothing was changed";
}

std::string show_properties(const py::object& self, std::initializer_list<const char*> names) {
  std::string text = py::str(py::type::of(self).attr("__name__")).cast<std::string>();
  const char* before = "(";
  for (const char* name : names) {
    text += before + std::string(name) + "=" + py::repr(self.attr(name)).cast<std::string>();
    before = ", ";
  }
  return text + ")";
}

py::array_t<double> as_vector_array(const std::vector<double>& values) {
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

py::array_t<double> as_matrix_array(const std::vector<double>& values, int n) {
  return py::array_t<double>({n, n}, values.data());
}

void bind_types(py::module_& m) {
  py::native_enum<Status>(m, "Status", "enum.IntEnum",
                          "Outcome of a step. From invalid_input on, the step was refused.")
      .value("ok", Status::ok, "step taken, estimate updated")
      .value("filling", Status::filling, "not enough past samples yet")
      .value("no_information", Status::no_information,
             "sample carries no information, estimate kept")
      .value("disabled", Status::disabled, "estimation is switched off")
      .value("reset", Status::reset, "step taken; plant change detected, P and lambda restarted")
      .value("invalid_input", Status::invalid_input, "NaN or Inf, refused")
      .value("out_of_range", Status::out_of_range, "beyond the plausible range, refused")
      .value("numerical_limit", Status::numerical_limit,
             "result not finite or not positive, refused")
      .value("invalid_argument", Status::invalid_argument, "configuration or snapshot refused")
      .finalize();
  py::native_enum<TrustReason>(m, "TrustReason", "enum.IntEnum", "Why a value is not trusted.")
      .value("trusted", TrustReason::trusted)
      .value("starting", TrustReason::starting)
      .value("resting", TrustReason::resting)
      .value("single_sine", TrustReason::single_sine)
      .value("change_suspected", TrustReason::change_suspected)
      .value("model_does_not_fit", TrustReason::model_does_not_fit)
      .value("not_precise", TrustReason::not_precise)
      .finalize();
  m.def("is_error", &is_error, py::arg("status"),
        "True where the step was refused: the estimate is then as it was before.");

  py::class_<Trajectory>(m, "Trajectory", R"(What a run() did, one row a sample.

Arrays are of the estimator's dtype unless said otherwise. Units are those of the estimator that ran:
of the signals for an ArxEstimator, of phi and y for an Rls.)")
      .def_readonly("theta", &Trajectory::theta,
                    "theta_hat after each sample, shape (N, n), in the units of theta_hat.")
      .def_readonly(
          "standard_deviation", &Trajectory::standard_deviation,
          "Standard deviations after each sample, shape (N, n), in the units of theta_hat.")
      .def_readonly(
          "innovation", &Trajectory::innovation,
          "Measured minus predicted, shape (N,), in the units of the output; NaN where nothing "
          "was estimated.")
      .def_readonly("forgetting_factor", &Trajectory::forgetting_factor,
                    "lambda of the last kept step, shape (N,), in (0, 1].")
      .def_readonly("residual_variance", &Trajectory::residual_variance,
                    "Estimate of sigma^2, shape (N,), in squared units of the output.")
      .def_readonly("status", &Trajectory::status, "Values of Status, uint8, shape (N,).")
      .def_readonly("converged", &Trajectory::converged,
                    "Convergence flag, bool, shape (N,); None from Rls.run().");
}

}  // namespace ehsid::bindings
