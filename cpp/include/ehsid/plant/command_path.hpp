// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace ehsid::plant {

/// Sampled commands behind a delay: command k acts over [t_k + delay, t_k+1 + delay). Before the first one the command
/// is zero.
///
/// A controller may be faster than the logger. Within a sample the command then moves on to the next one,
///   u(t_k + s dt) = u_k + b s (u_k+1 - u_k),  0 <= s < 1,
/// with b = 0 where it is held, 1/2 where the controller sends two commands a sample, towards 1 with many.
template <class Scalar>
class CommandPath {
 public:
  CommandPath() = default;
  CommandPath(const Scalar& delay, double dt, std::size_t samples,
              const Scalar& between = Scalar(0.0))
      : delay_(delay / dt), between_(between), moves_(!is_nothing(between)) {
    commands_.reserve(samples);
  }

  /// Number of commands so far.
  std::size_t size() const { return commands_.size(); }

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
      return within(k, begin - index + 0.5 * length) + (at(k - 1) - at(k)) * before;
    }
    if (value_of(until_next) >= length - kRounding) {
      return within(k, begin - index + 0.5 * length);
    }
    const Scalar share = until_next / length;
    return within(k, 1.0 - until_next * 0.5) * share +
           within(k + 1, (length - until_next) * 0.5) * (1.0 - share);
  }

  /// The command at this share of a sample after command k; its mean over a part of the sample is that of the middle.
  Scalar within(std::ptrdiff_t k, const Scalar& past) const {
    return moves_ && k >= 0 ? at(k) + between_ * past * (at(k + 1) - at(k)) : at(k);
  }

  /// The last command is held.
  Scalar at(std::ptrdiff_t k) const {
    const auto last = static_cast<std::ptrdiff_t>(commands_.size()) - 1;
    return k < 0 ? Scalar(0.0) : commands_[static_cast<std::size_t>((std::min)(k, last))];
  }

  Scalar delay_{};    // in samples
  Scalar between_{};  // b
  bool moves_ = false;
  std::vector<Scalar> commands_;
};

}  // namespace ehsid::plant
