// SPDX-License-Identifier: MIT
// A ServoEstimator for each of many axes. A plain loop: the estimators branch at rests, outliers and starts of their own, so
// that SIMD lanes would wait for each other. What it costs: docs/bank.md.
#pragma once

#include <ehsid/servo_estimator.hpp>

#include <array>

namespace ehsid {

/// Static memory, no heap. Each axis tells the same bits as if it were alone, and a bad sample of one touches no other.
template <class Scalar_, int kAxes, int kMaxDelay = 4>
class ServoBank {
 public:
  static_assert(kAxes >= 1, "a bank has at least one axis");
  using Scalar = Scalar_;
  using Estimator = ServoEstimator<Scalar, kMaxDelay>;
  using Options = typename Estimator::Options;
  /// Something of every axis.
  template <class Type>
  using Each = std::array<Type, static_cast<std::size_t>(kAxes)>;

  /// Every axis takes the options and starts anew. invalid_argument leaves everything as it was.
  EHSID_RARE Status configure(const Options& options) {
    Status status = Status::ok;
    for (Estimator& axis : axes_) {
      status = axis.configure(options);
    }
    return status;
  }

  /// One sample of every axis; see ServoEstimator::step.
  Each<Status> step(const Each<Scalar>& commands, const Each<Scalar>& positions) {
    Each<Status> status{};
    for (std::size_t i = 0; i < axes_.size(); ++i) {
      status[i] = axes_[i].step(commands[i], positions[i]);
    }
    return status;
  }

  /// What is known of every axis now.
  Each<TrackedServo<Scalar>> servo() const {
    Each<TrackedServo<Scalar>> told{};
    for (std::size_t i = 0; i < axes_.size(); ++i) {
      told[i] = axes_[i].servo();
    }
    return told;
  }

  /// The estimator of an axis, 0 .. kAxes - 1: it may be configured, saved and restored alone.
  Estimator& operator[](int axis) { return axes_[static_cast<std::size_t>(axis)]; }
  const Estimator& operator[](int axis) const { return axes_[static_cast<std::size_t>(axis)]; }

 private:
  Each<Estimator> axes_{};
};

}  // namespace ehsid
