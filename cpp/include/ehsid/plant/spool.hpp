// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect.hpp>

#include <array>

namespace ehsid::plant {

/// Spool as a second-order system with a held input, exact for any step:
///   x'' + 2 zeta w x' + w^2 x = w^2 u.
/// In z = (x - u, x' / w) the step is z <- M z, M = exp(w h [0 1; -1 -2 zeta]). What drives it can give no more flow than
/// for a certain speed: |x'| <= slew (H. E. Merritt, Hydraulic Control Systems, Wiley 1967, ch. 7).
template <class Scalar>
class Spool {
 public:
  Spool() = default;

  /// A step of h seconds. Without a bandwidth the spool is where its command puts it; a slew of zero, 1/s, is no limit.
  Spool(const SpoolLag<Scalar>& lag, const Scalar& slew, double h)
      : lagging_(value_of(lag.bandwidth_hz) > 0.0), limited_(lagging_ && value_of(slew) > 0.0) {
    if (!lagging_) {
      return;
    }
    constexpr double kTwoPi = 6.283185307179586;
    farthest_ = slew * h;
    fastest_ = slew / (lag.bandwidth_hz * kTwoPi);
    // Scaling and squaring of the series, which unlike sines and hyperbolic sines passes through zeta = 1.
    constexpr int kSquarings = 10;
    constexpr int kTerms = 8;
    const Scalar angle = lag.bandwidth_hz * (kTwoPi * h / static_cast<double>(1 << kSquarings));
    const Matrix a{Scalar(0.0), angle, -angle, lag.damping * angle * -2.0};
    Matrix term{Scalar(1.0), Scalar(0.0), Scalar(0.0), Scalar(1.0)};
    step_ = term;
    for (int i = 1; i <= kTerms; ++i) {
      term = product(term, a);
      for (std::size_t k = 0; k < term.size(); ++k) {
        term[k] *= 1.0 / i;
        step_[k] += term[k];
      }
    }
    for (int i = 0; i < kSquarings; ++i) {
      step_ = product(step_, step_);
    }
  }

  /// Position behind a step with the input held at u.
  const Scalar& advance(const Scalar& u) {
    if (!lagging_) {
      position_ = u;
      return position_;
    }
    const Scalar away = position_ - u;
    const Scalar next = step_[0] * away + step_[1] * speed_;
    speed_ = step_[2] * away + step_[3] * speed_;
    const Scalar move = u + next - position_;
    position_ += limited_ ? within(move, farthest_) : move;
    if (limited_) {
      speed_ = within(speed_, fastest_);
    }
    return position_;
  }

  const Scalar& position() const { return position_; }

 private:
  using Matrix = std::array<Scalar, 4>;  // by rows

  static Matrix product(const Matrix& a, const Matrix& b) {
    return {a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3], a[2] * b[0] + a[3] * b[2],
            a[2] * b[1] + a[3] * b[3]};
  }

  static Scalar within(const Scalar& x, const Scalar& limit) {
    if (value_of(x) > value_of(limit)) {
      return limit;
    }
    return value_of(x) < -value_of(limit) ? -limit : x;
  }

  bool lagging_ = false;
  bool limited_ = false;
  Scalar farthest_{};  // in a step
  Scalar fastest_{};   // of x' / w
  Matrix step_{};
  Scalar position_{};
  Scalar speed_{};
};

}  // namespace ehsid::plant
