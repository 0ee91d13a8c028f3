// SPDX-License-Identifier: MIT
// The linear drive of Ghazali, Sam, Rahmat, Zulfatman, Int. J. Phys. Sci. 6(30), 2011, about any position:
//   x_v = K_v u                                             (1)
//   Q_L = K_q x_v - K_c P_L                                 (2)
//   dP_L/dt = (4 beta_e / V_t) (Q_L - C_p P_L - A_p y')     (3)
//   force = A_p P_L                                         (4)
#pragma once

#include <ehsid/plant/catalogue.hpp>
#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/rig.hpp>

#include <vector>

namespace ehsid::plant {

template <class Scalar>
class LinearServo {
 public:
  /// Values in the order of plant_parameters(). load: on the rod at the start, N, which P_L carries.
  /// overlap: dead band of the spool.
  LinearServo(const std::vector<Scalar>& values, const Overlap<Scalar>& overlap, const Scalar& load)
      : flow_gain_(value_at(values, RigValue::linear_flow_gain)),
        loss_(value_at(values, RigValue::linear_flow_pressure) +
              value_at(values, RigValue::linear_leakage)),
        area_(value_at(values, RigValue::linear_area)),
        stiffness_(value_at(values, RigValue::linear_bulk_modulus) * 4.0 /
                   value_at(values, RigValue::linear_volume)),
        overlap_(overlap),
        rounding_(value_at(values, Nuisance::edge_rounding)),
        load_pressure_(load / area_) {}

  /// On the rod, N, positive extends.
  Scalar force() const { return area_ * load_pressure_; }

  /// h seconds about a time, s, with the spool at x_v and the rod at `velocity`, by the implicit midpoint rule.
  void advance(const Effects<Scalar>& effects, const Scalar& x_v, const Scalar& velocity,
               double time, double h) {
    Scalar flow = flow_gain_ * behind_overlap(x_v);
    effects.flow_shares(time, [&](const Scalar& share) { flow = flow * share; });
    const Scalar inflow = flow - area_ * velocity;
    const Scalar half = stiffness_ * loss_ * (0.5 * h);
    load_pressure_ = (load_pressure_ * (1.0 - half) + stiffness_ * inflow * h) / (1.0 + half);
  }

  /// Of the oil, N/m.
  double stiffness() const { return value_of(stiffness_) * value_of(area_) * value_of(area_); }

 private:
  /// Two rounded edges: x - overlap beyond it, x + overlap on the other side; x itself without overlap.
  Scalar behind_overlap(const Scalar& x) const {
    if (is_nothing(overlap_.extending) && is_nothing(overlap_.retracting)) {
      return x;
    }
    using std::sqrt;
    const auto edge = [&](const Scalar& s) {
      return (s + sqrt(s * s + rounding_ * rounding_)) * 0.5;
    };
    return edge(x - overlap_.extending) - edge(-x - overlap_.retracting);
  }

  Scalar flow_gain_, loss_, area_, stiffness_;
  Overlap<Scalar> overlap_;
  Scalar rounding_;
  Scalar load_pressure_;
};

}  // namespace ehsid::plant
