// SPDX-License-Identifier: MIT
// ServoEstimator in either precision, alone and beside others: what Python sees as ServoEstimator and ServoBank.
#pragma once

#include "bindings.hpp"

#include <ehsid/servo_estimator.hpp>

#include <array>
#include <deque>
#include <memory>
#include <utility>
#include <variant>
#include <vector>

namespace ehsid::bindings {

constexpr int kMaxDelay = 20;

using Value = TrackedValue<double>;
using Tracked = TrackedServo<double>;

template <class Scalar>
Value in_double(const TrackedValue<Scalar>& from) {
  return {static_cast<double>(from.value), static_cast<double>(from.half_width), from.trusted,
          from.reason};
}

/// One of the values over the samples of a run, of all axes, or of both, as numpy arrays.
struct ValueSeries {
  py::array value;
  py::array half_width;
  py::array trusted;
  py::array reason;
};

struct TrackedServos {
  ValueSeries gain;
  ValueSeries omega_n;
  ValueSeries xi;
};

struct TrackedRun : TrackedServos {
  py::array status;
};

/// Arrays of this shape for what servo() tells, and where they lie in memory: while the GIL is released only these are used.
template <class Scalar>
class TrackedArrays {
 public:
  using Shape = std::vector<py::ssize_t>;

  explicit TrackedArrays(const Shape& shape)
      : columns_{Column(shape), Column(shape), Column(shape)} {}

  void put(py::ssize_t at, const TrackedServo<Scalar>& told) {
    columns_[0].put(at, told.gain);
    columns_[1].put(at, told.omega_n);
    columns_[2].put(at, told.xi);
  }

  TrackedServos told() const {
    return {columns_[0].series(), columns_[1].series(), columns_[2].series()};
  }

 private:
  class Column {
   public:
    explicit Column(const Shape& shape)
        : value_(shape),
          half_width_(shape),
          trusted_(shape),
          reason_(shape),
          to_value_(value_.mutable_data()),
          to_half_width_(half_width_.mutable_data()),
          to_trusted_(trusted_.mutable_data()),
          to_reason_(reason_.mutable_data()) {}

    void put(py::ssize_t at, const TrackedValue<Scalar>& told) {
      to_value_[at] = told.value;
      to_half_width_[at] = told.half_width;
      to_trusted_[at] = told.trusted;
      to_reason_[at] = static_cast<std::uint8_t>(told.reason);
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

  std::array<Column, 3> columns_;
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
  ServoEstimator<Scalar, kMaxDelay>& held() {
    return *std::get<Held<Scalar>>(held_);
  }

 private:
  template <class Scalar>
  using Held = std::unique_ptr<ServoEstimator<Scalar, kMaxDelay>>;

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
          "from 1 to 20 samples");
    }
    held_ = std::move(made);
  }

  ServoEstimatorOptions<double> options_;
  std::variant<Held<float>, Held<double>> held_;
};

using Axes = std::vector<AnyServoEstimator*>;

/// Runs estimators side by side, each as if it were alone: over signals of shape (N,) one, over (N, axes) as many.
template <class Scalar>
TrackedRun run_axes(const Axes& axes, const InputArray<Scalar>& command,
                    const InputArray<Scalar>& position) {
  const std::vector<py::ssize_t> shape(command.shape(), command.shape() + command.ndim());
  TrackedArrays<Scalar> told(shape);
  py::array_t<std::uint8_t> status(shape);
  const Scalar* u = command.data();
  const Scalar* y = position.data();
  std::uint8_t* outcome = status.mutable_data();
  {
    std::deque<Busy> busy;
    for (AnyServoEstimator* axis : axes) {
      busy.emplace_back(*axis);
    }
    const py::gil_scoped_release released;
    const auto count = static_cast<py::ssize_t>(axes.size());
    for (py::ssize_t i = 0; i < count; ++i) {
      auto& estimator = axes[static_cast<std::size_t>(i)]->template held<Scalar>();
      for (py::ssize_t at = i; at < shape[0] * count; at += count) {
        outcome[at] = static_cast<std::uint8_t>(estimator.step(u[at], y[at]));
        told.put(at, estimator.servo());
      }
    }
  }
  return {told.told(), status};
}

}  // namespace ehsid::bindings
