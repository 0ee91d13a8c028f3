// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect.hpp>

#include <cmath>

namespace ehsid::plant {

/// The part m_2 of a mass m that hangs on the rest, m_1, by a spring and a damper. With z its distance from where it hangs
/// at rest and w, zeta its frequency and damping ratio while m_1 is fixed,
///   m_1 v'  = force - damping v + m_2 (w^2 z + 2 zeta w z'),
///   v' + z'' = -(w^2 z + 2 zeta w z').
///
/// Leapfrog, as the rod: z at whole steps, velocities at half steps, forces over velocities by the mean of both half steps. The
/// velocity of m_2 after the step stands in both equations; put into the first, it leaves a force and a damping on the
/// rod.
template <class Scalar>
class HangingMass {
 public:
  HangingMass() = default;

  /// mass: the whole, kg. fastest: both masses swing against each other no faster than this, rad/s, because the steps of h
  /// seconds could not follow.
  HangingMass(const HangingLoad<Scalar>& load, const Scalar& mass, double fastest, double h)
      : active_(value_of(load.mass_share) > 0.0 && value_of(load.frequency_hz) > 0.0) {
    if (!active_) {
      return;
    }
    constexpr double kTwoPi = 6.283185307179586;
    h_ = h;
    rate_ = load.frequency_hz * kTwoPi;
    share_ = load.mass_share;
    mass_ = mass * share_;
    // Apart from each other the masses swing at w sqrt(1 + m_2 / m_1).
    using std::sqrt;
    const Scalar most = sqrt(1.0 - share_) * fastest;
    Scalar rate = rate_;
    if (value_of(rate) > value_of(most)) {
      rate = most;
    }
    square_ = rate * rate;
    loss_ = load.damping * rate * 2.0;
    carried_ = 1.0 / (1.0 + loss_ * (0.5 * h));
  }

  bool active() const { return active_; }

  /// It hangs at rest on a rod of this velocity.
  void start(const Scalar& velocity) { velocity_ = velocity; }

  /// It is faster by this much.
  void shift(const Scalar& change) { velocity_ += change; }

  /// Of the whole mass, kg.
  Scalar mass() const { return mass_; }

  /// On the rod, N, but for what goes with its mean velocity over the step.
  Scalar force() const { return mass_ * carried_ * (square_ * distance_ + loss_ * velocity_); }

  /// Over the mean velocity of the rod over the step, N s/m.
  Scalar damping() const { return mass_ * carried_ * loss_; }

  /// A step in which the velocity of the rod changes from one to the other.
  void advance(const Scalar& before, const Scalar& after) {
    const Scalar half = loss_ * (0.5 * h_);
    velocity_ = (velocity_ * (1.0 - half) - square_ * (distance_ * h_) + half * (before + after)) *
                carried_;
    distance_ += (velocity_ - after) * h_;
  }

  /// Fastest of the two oscillations with a spring of `stiffness` N/m between m_1 and the ground, as the values say,
  /// whatever the steps can follow, rad/s.
  double fastest_rate(double stiffness) const {
    const double own = value_of(rate_) * value_of(rate_);
    const double share = value_of(share_);
    const double rod = value_of(mass_) * (1.0 - share) / share;
    // [ (k + k_2) / m_1, -k_2 / m_1; -w^2, w^2 ] with k_2 = m_2 w^2
    const double first = stiffness / rod + own * share / (1.0 - share);
    const double apart = first - own;
    const double coupling = own * own * share / (1.0 - share);
    return std::sqrt(0.5 * (first + own + std::sqrt(apart * apart + 4.0 * coupling)));
  }

 private:
  bool active_ = false;
  double h_ = 0.0;
  Scalar share_{}, mass_{}, rate_{};
  Scalar square_{};   // w^2
  Scalar loss_{};     // 2 zeta w
  Scalar carried_{};  // 1 / (1 + zeta w h)
  Scalar distance_{};
  Scalar velocity_{};  // y' + z', half a step ago
};

}  // namespace ehsid::plant
