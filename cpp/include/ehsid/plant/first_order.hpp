// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>

#include <cmath>

namespace ehsid::plant {

/// A reading that follows a signal as a first-order system, m' = (x - m) / tau.
template <class Scalar>
class FirstOrder {
 public:
  /// The signal has rested at x.
  Scalar start(const Scalar& x) {
    shown_ = x;
    before_ = x;
    return x;
  }

  /// The reading after a step of h seconds, exact where the signal runs along a straight line to x. A time constant that is
  /// not above zero means none.
  Scalar follow(const Scalar& x, const Scalar& tau, double h) {
    using std::exp;
    if (!(value_of(tau) > 0.0)) {
      return start(x);
    }
    const Scalar decay = exp(-h / tau);
    const Scalar slope = (x - before_) / h;
    shown_ = decay * (shown_ - before_ + tau * slope) + x - tau * slope;
    before_ = x;
    return shown_;
  }

  /// Signal and reading were different all the time by this much.
  void shift(const Scalar& change) {
    shown_ += change;
    before_ += change;
  }

 private:
  Scalar shown_{};
  Scalar before_{};
};

}  // namespace ehsid::plant
