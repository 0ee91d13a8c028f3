// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/types.hpp>

#include <cmath>

namespace ehsid {

/// What FitMonitor remembers. Plain data.
template <class Scalar>
struct FitState {
  Scalar mean;           // of the output
  Scalar variance;       // of the output about that mean
  Scalar square;         // mean square of the innovations
  std::int32_t samples;  // so far, up to the window
};

/// Fit one step ahead of the last samples, in percent: 100 (1 - rms(epsilon) / rms(y - mean(y))).
///
/// The measure is the NRMSE fit of L. Ljung, System Identification, 2nd ed. 1999, sec. 16.4, on innovations instead
/// of a simulation: near 100 even for a poor model of a plant sampled fast. Until the window is full every
/// sample counts alike, so the value is that of the formula; then old samples fade as in an exponential window
/// (D. H. D. West, "Updating mean and variance estimates", Communications of the ACM 22(9), 1979, pp. 532-535).
template <class Scalar>
class FitMonitor {
 public:
  using State = FitState<Scalar>;
  static constexpr std::int32_t kWindow = 1000;

  void restart() { state_ = State{}; }

  /// An output and how far it lay from its prediction, both in the same unit. A sample whose squares are not finite is
  /// left out.
  void update(Scalar output, Scalar innovation) {
    const Scalar away = output - state_.mean;
    if (!is_squarable(away) || !is_squarable(innovation)) {
      return;
    }
    state_.samples += state_.samples < kWindow ? 1 : 0;
    const Scalar share = Scalar(1) / static_cast<Scalar>(state_.samples);
    state_.mean += share * away;
    state_.variance = (Scalar(1) - share) * (state_.variance + share * away * away);
    state_.square += share * (innovation * innovation - state_.square);
  }

  /// Finite, at most 100; negative where the mean would predict better; 0 while the output has not moved.
  Scalar percent() const {
    if (!is_normal_positive(state_.variance)) {
      return Scalar(0);
    }
    const Scalar ratio = std::sqrt(state_.square) / std::sqrt(state_.variance);
    return bounded_product(Scalar(100), Scalar(1) - ratio);
  }

  const State& state() const { return state_; }

 private:
  State state_{};
};

}  // namespace ehsid
