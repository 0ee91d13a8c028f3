// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>

#include <cmath>

namespace ehsid::plant {

/// Dry friction of the seals as a bristle that bends before it slides (Dahl 1968; Canudas de Wit et al., IEEE
/// Trans. Automatic Control 40(3), 1995). With the bend in units of the presliding distance d,
///   s' = (v - |v| s g(0) / g(v)) / d,   force = g(0) (s + tau s'),
/// so that sliding at v gives g(v) sgn(v), and d -> 0 the sharp form. g may depend on more than the speed; g(0) is one
/// number, and where g is zero the bristle lets go.
template <class Scalar>
class Seals {
 public:
  Seals() = default;

  /// at_rest: friction at rest, N. presliding: the distance d, m. stiffest: the seals are no stiffer than this, N/m,
  /// because the steps of integration could not follow them; > 0.
  Seals(const Scalar& at_rest, const Scalar& presliding, const Scalar& stiffest)
      : active_(value_of(at_rest) > 0.0),
        at_rest_(at_rest),
        stiffness_(active_ ? at_rest / presliding : Scalar(0.0)),
        presliding_(stiffness_ > stiffest ? at_rest / stiffest : presliding) {}

  bool active() const { return active_; }

  /// Before sliding, as the values say, whatever the steps can follow, N/m.
  Scalar stiffness() const { return stiffness_; }

  /// Elastic part of the force, N.
  Scalar force() const { return at_rest_ * bend_; }

  /// What the damping of the bristle adds to the viscous friction, N s/m; none once it slides.
  Scalar damping(const Scalar& velocity) const {
    if (!(value_of(sliding_) > 0.0)) {
      return Scalar(0.0);
    }
    const Scalar share = bend_ / sliding_;
    const Scalar left = value_of(velocity) < 0.0 ? 1.0 + share : 1.0 - share;
    return value_of(left) > 0.0 ? at_rest_ * (1.0 / kDampingSpeed) * left : Scalar(0.0);
  }

  /// h seconds at a constant velocity with friction g there; exact.
  void advance(const Scalar& velocity, const Scalar& friction, double h) {
    using std::exp;
    sliding_ = friction / at_rest_;
    if (!(value_of(sliding_) > 0.0)) {
      bend_ = Scalar(0.0);
      return;
    }
    const Scalar speed = absolute<Scalar>(velocity);
    const Scalar decay = exp(-(speed * (h / presliding_) / sliding_));
    const Scalar steady = value_of(velocity) < 0.0 ? -sliding_ : sliding_;
    bend_ = steady + (bend_ - steady) * decay;
  }

 private:
  // d / tau, m/s. In proportion to d, so that a bend ever shorter damps no motion.
  static constexpr double kDampingSpeed = 0.02;

  bool active_ = false;
  Scalar at_rest_{};
  Scalar stiffness_{};
  Scalar presliding_{};
  Scalar bend_{};
  Scalar sliding_{1.0};  // g / g(0) of the last step
};

}  // namespace ehsid::plant
