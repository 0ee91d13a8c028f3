// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect.hpp>

#include <cmath>

namespace ehsid::plant {

/// Pressure line from the source to the volume in front of the valve, as one mass of oil:
///   L dq/dt = p_0 - p_s - R q,  L = 1 / (w^2 C),  R = 2 zeta w L,  C = volume / beta.
/// What the pressure p_s in front of the valve makes of q, Hydraulics computes. p_0 is the pressure of the source, or
/// of its accumulator where the supply droops.
///
/// Leapfrog: q at half steps, p_0 and p_s at whole steps.
template <class Scalar>
class RingingLine {
 public:
  RingingLine() = default;

  /// source: pressure of the source, Pa. fastest: it rings no faster than this, rad/s, because the steps of integration
  /// could not follow.
  RingingLine(const PressureLine<Scalar>& line, const SupplyLine<Scalar>& supply,
              const Scalar& source, const Scalar& bulk_modulus, double fastest)
      : active_(value_of(line.frequency_hz) > 0.0 && value_of(line.volume_m3) > 0.0) {
    if (!active_) {
      return;
    }
    constexpr double kTwoPi = 6.283185307179586;
    const Scalar rate = line.frequency_hz * kTwoPi;
    rate_ = value_of(rate);
    inverse_capacitance_ = bulk_modulus / line.volume_m3;
    inertance_ = inverse_capacitance_ / (rate * rate);
    if (rate_ > fastest) {
      // A larger volume: what is slower than the ringing hardly feels it.
      inverse_capacitance_ = inertance_ * (fastest * fastest);
    }
    resistance_ = line.damping * rate * inertance_ * 2.0;
    droops_ = value_of(supply.resistance) > 0.0;
    source_ = source;
    begin_ = source;
    if (droops_) {
      source_resistance_ = supply.resistance;
      inverse_time_ = 1.0 / (supply.resistance * supply.capacitance);
    }
  }

  bool active() const { return active_; }

  /// As the values say, whatever the steps can follow, rad/s.
  double rate() const { return rate_; }

  /// 1 / C, Pa/m^3.
  const Scalar& inverse_capacitance() const { return inverse_capacitance_; }

  /// In the middle of the last step, m^3/s.
  const Scalar& flow() const { return flow_; }

  /// A step of h seconds that begins with `pressure` in front of the valve.
  void advance(const Scalar& pressure, double h) {
    using std::exp;
    const Scalar inertia = inertance_ * (1.0 / h);
    const Scalar half = resistance_ * 0.5;
    flow_ = (flow_ * (inertia - half) + begin_ - pressure) / (inertia + half);
    if (droops_) {
      const Scalar settled = source_ - source_resistance_ * flow_;
      begin_ = settled + (begin_ - settled) * exp(-h * inverse_time_);
    }
  }

 private:
  bool active_ = false;
  bool droops_ = false;
  double rate_ = 0.0;
  Scalar inverse_capacitance_{}, inertance_{}, resistance_{};
  Scalar source_{}, source_resistance_{};
  Scalar inverse_time_{};  // 1/s, of the accumulator
  Scalar begin_{};         // pressure where the line begins
  Scalar flow_{};
};

}  // namespace ehsid::plant
