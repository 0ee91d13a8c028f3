// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>

#include <cmath>
#include <cstddef>
#include <vector>

namespace ehsid::plant {

/// Sampled commands behind a delay: command k acts over [t_k + delay, t_k+1 + delay). Before the first one the command
/// is zero.
template <class Scalar>
class CommandPath {
 public:
  CommandPath() = default;
  CommandPath(const Scalar& delay, double dt, std::size_t samples) : delay_(delay / dt) {
    commands_.reserve(samples);
  }

  void push(const Scalar& command) { commands_.push_back(command); }

  /// Mean of the delayed command over [from, from + length), in samples; length <= 1. Where an interval begins with a
  /// sample, the derivative by the delay is that for a longer one: a multiple of the integration step must not hide the
  /// delay from a fit.
  Scalar mean(double from, double length) const { return mean_from(from - delay_, length); }

  /// The same with a further delay, s; the delay of both together is no less than zero.
  Scalar mean(double from, double length, const Scalar& further, double dt) const {
    const Scalar delay = delay_ + further * (1.0 / dt);
    return mean_from(from - (value_of(delay) < 0.0 ? Scalar(0.0) : delay), length);
  }

 private:
  static constexpr double kRounding = 1e-9;

  Scalar mean_from(const Scalar& begin, double length) const {
    // Rounding must not put the edge of an interval into the sample before.
    const double index = std::floor(value_of(begin) + kRounding);
    const Scalar until_next = index + 1.0 - begin;
    const auto k = static_cast<std::ptrdiff_t>(index);
    if (value_of(begin) - index < kRounding) {
      const Scalar before =
          (value_of(begin) - begin) * (1.0 / length);  // zero, but for its derivative
      return at(k) + (at(k - 1) - at(k)) * before;
    }
    if (value_of(until_next) >= length - kRounding) {
      return at(k);
    }
    const Scalar share = until_next / length;
    return at(k) * share + at(k + 1) * (1.0 - share);
  }

  Scalar at(std::ptrdiff_t k) const {
    return k < 0 ? Scalar(0.0) : commands_[static_cast<std::size_t>(k)];
  }

  Scalar delay_{};  // in samples
  std::vector<Scalar> commands_;
};

}  // namespace ehsid::plant
