// SPDX-License-Identifier: MIT
#include "bindings.hpp"

#include <algorithm>
#include <thread>

namespace ehsid::bindings {
namespace {

/// A bank and the Python objects it was made of.
struct PyBank : OneThread {
  std::vector<py::object> estimators;
  std::unique_ptr<AnyBank> bank;
  int n;
  bool single;
};

AnyEstimator& estimator_at(const PyBank& self, std::size_t index) {
  return self.estimators[index].cast<AnyEstimator&>();
}

template <class Scalar>
BankColumn<Scalar> column(const char* name, const InputArray<Scalar>& values, std::size_t count,
                          py::ssize_t rows) {
  const bool fits = values.ndim() == 1 ||
                    (values.ndim() == 2 && values.shape(1) == static_cast<py::ssize_t>(count));
  if (!fits || (rows >= 0 && values.shape(0) != rows)) {
    const std::string samples = rows >= 0 ? std::to_string(rows) : "samples";
    throw py::value_error(std::string(name) + " has shape " +
                          py::str(values.attr("shape")).template cast<std::string>() +
                          "; expected (" + samples + ", " + std::to_string(count) +
                          "), a column for each estimator, or (" + samples +
                          ",), the same for all");
  }
  return {values.data(), values.ndim() == 1};
}

template <class Scalar>
Trajectory run(PyBank& self, const py::object& u_in, const py::object& y_in, int every,
               unsigned threads) {
  const auto u = real_array<Scalar>("u", u_in);
  const auto y = real_array<Scalar>("y", y_in);
  const std::size_t count = self.bank->size();
  const auto commands = column("u", u, count, -1);
  const auto positions = column("y", y, count, u.shape(0));
  const auto samples = static_cast<std::size_t>(u.shape(0));
  BankView<Scalar> view{{}, static_cast<std::size_t>(every)};
  const auto rows = static_cast<py::ssize_t>(every > 0 ? samples / view.every : 0);
  Trajectory out = make_bank_trajectory(rows, static_cast<py::ssize_t>(count), self.n, view.to);
  {
    const Run lasting(self);
    self.bank->run(commands, positions, samples, threads, view);
  }
  return out;
}

}  // namespace

void bind_estimator_bank(py::module_& m) {
  py::class_<PyBank>(m, "EstimatorBank",
                     R"(Many ArxEstimators at once, several in each SIMD instruction.

Each runs on, bit for bit, as it would alone; how much faster says docs/bank.md.
Use one object from one thread at a time.

Parameters
----------
estimators : sequence of ArxEstimator
    At least one, all with the same na, nb, nk, offset, dtype and kind of forgetting policy, and with method="rls".
    Every other setting, the start values and the state may differ. The bank takes their states over;
    the objects themselves stay as they are until bank[i] asks for one.
instructions : str, optional
    "baseline", "avx2" or "avx512"; by default the best that this machine has. The results are the same.

Raises
------
ValueError
    Where the estimators are none, the same object twice, or not alike, or the machine lacks the instructions.)")
      .def(py::init(
               [](const std::vector<AnyEstimator*>& estimators, const std::string& instructions) {
                 auto self = std::make_unique<PyBank>();
                 for (AnyEstimator* one : estimators) {
                   if (one == nullptr) {
                     throw py::type_error("estimators[" + std::to_string(self->estimators.size()) +
                                          "] is None; expected an ArxEstimator");
                   }
                   self->estimators.push_back(py::cast(one, py::return_value_policy::reference));
                 }
                 if (estimators.empty()) {
                   throw py::value_error("estimators is empty; expected at least one ArxEstimator");
                 }
                 std::vector<AnyEstimator*> sorted = estimators;
                 std::sort(sorted.begin(), sorted.end());
                 if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) {
                   throw py::value_error(
                       "estimators holds the same object twice; make an estimator for each place");
                 }
                 self->n = estimators.front()->n();
                 self->single = estimators.front()->single();
                 self->bank = self->single ? make_bank<float>(estimators, instructions)
                                           : make_bank<double>(estimators, instructions);
                 return self;
               }),
           py::arg("estimators"), py::kw_only(), py::arg("instructions") = "")
      .def("__len__", [](const PyBank& self) { return self.estimators.size(); })
      .def(
          "__getitem__",
          [](const PyBank& self, py::ssize_t index) -> AnyEstimator& {
            const auto count = static_cast<py::ssize_t>(self.estimators.size());
            if (index < -count || index >= count) {
              throw py::index_error("estimator " + std::to_string(index) + " of a bank of " +
                                    std::to_string(count));
            }
            const auto at = static_cast<std::size_t>(index < 0 ? index + count : index);
            AnyEstimator& one = estimator_at(self, at);
            self.bank->get(at, one);
            return one;
          },
          py::arg("index"), py::return_value_policy::reference,
          "The ArxEstimator at this place, brought to the state of now: it reports, predicts and "
          "saves. Changes "
          "of it do not reach the bank before load().")
      .def(
          "load",
          [](PyBank& self) {
            for (std::size_t i = 0; i < self.estimators.size(); ++i) {
              self.bank->set(i, estimator_at(self, i));
            }
          },
          "Takes the states of all estimators over anew, after restore(), reset(), enable() or "
          "seed() of some. "
          "Ask for each by bank[i] before you change one, or what the bank has learned is lost.")
      .def_property_readonly(
          "instructions", [](const PyBank& self) { return self.bank->instructions(); },
          "What it runs: \"baseline\", \"avx2\" or \"avx512\".")
      .def(
          "run",
          [](PyBank& self, const py::object& u, const py::object& y, int every, int threads) {
            require_range("every", every, 0, 0x7fffffff);
            require_range("threads", threads, 0, 1024);
            const unsigned workers = threads > 0
                                         ? static_cast<unsigned>(threads)
                                         : std::max(1U, std::thread::hardware_concurrency());
            return self.single ? run<float>(self, u, y, every, workers)
                               : run<double>(self, u, y, every, workers);
          },
          py::arg("u"), py::arg("y"), py::kw_only(), py::arg("every") = 1, py::arg("threads") = 1,
          R"(Takes samples in order, each estimator as its own run() would. Releases the GIL.

Parameters
----------
u : array_like, shape (N, estimators) or (N,)
    Commands, in the units of each estimator's signal; one column serves all.
y : array_like, shape (N, estimators) or (N,)
    Positions, likewise.
every : int >= 0
    Rows of the trajectory: one for every `every`-th sample; 0 for none, which is fastest.
threads : int in 0..1024
    Share the estimators among this many threads, 64 at least in each; 0: as many as the machine has cores.

Returns
-------
Trajectory
    As of ArxEstimator.run, with a second axis for the estimators: theta and standard_deviation have the shape
    (N // every, estimators, n), everything else (N // every, estimators).

Raises
------
TypeError, ValueError
    Not real numbers, or shapes that do not fit; no sample was taken.)");
}

}  // namespace ehsid::bindings
