// SPDX-License-Identifier: MIT
// Unknown inputs of the plant's equations as directions: signals that add nothing, but whose sizes have derivatives.
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/tables.hpp>

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

namespace ehsid::plant {

/// A signal that could be added to an equation: a number for each sample, in the unit of the equation, linear between
/// samples. Its size is zero.
struct Disturbance {
  Equation adds_to = Equation::force;
  const double* signal = nullptr;
};

/// All disturbances of a plant. Without derivatives there is nothing to add.
template <class Scalar>
class Disturbances {
 public:
  bool act_on(Equation /*equation*/) const { return false; }
  Scalar at(Equation /*equation*/) const { return Scalar(0.0); }
  void move_to(std::size_t /*sample*/, double /*share*/) {}
};

/// The size of each disturbance is a partial derivative.
template <class Partials>
class Disturbances<Dual<Partials>> {
 public:
  Disturbances() = default;

  /// samples: number of samples of each signal. first: the place of the first disturbance among the partial derivatives.
  Disturbances(std::vector<Disturbance> all, std::size_t samples, std::size_t first)
      : all_(std::move(all)), samples_(samples), first_(first) {
    for (const Disturbance& each : all_) {
      acts_[static_cast<std::size_t>(each.adds_to)] = true;
    }
    move_to(0, 0.0);
  }

  /// Whether any disturbance adds to this equation.
  bool act_on(Equation equation) const { return acts_[static_cast<std::size_t>(equation)]; }

  /// Their sum now: zero, with its derivatives.
  const Dual<Partials>& at(Equation equation) const {
    return now_[static_cast<std::size_t>(equation)];
  }

  /// On to this share, below one, of the way from a sample to the next; behind the last one all stay as they are.
  void move_to(std::size_t sample, double share) {
    if (samples_ == 0) {
      return;
    }
    const std::size_t next = sample + 1 < samples_ ? sample + 1 : sample;
    for (std::size_t i = 0; i < all_.size(); ++i) {
      const double* const signal = all_[i].signal;
      now_[static_cast<std::size_t>(all_[i].adds_to)].partial.set(
          first_ + i, signal[sample] + (signal[next] - signal[sample]) * share);
    }
  }

 private:
  std::vector<Disturbance> all_;
  std::size_t samples_ = 0;
  std::size_t first_ = 0;
  std::array<bool, static_cast<std::size_t>(Equation::count)> acts_{};
  std::array<Dual<Partials>, static_cast<std::size_t>(Equation::count)> now_{};
};

}  // namespace ehsid::plant
