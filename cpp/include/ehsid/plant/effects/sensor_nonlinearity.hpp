// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/plant/dual.hpp>
#include <ehsid/plant/effect.hpp>

#include <array>
#include <cmath>
#include <cstddef>

namespace ehsid::plant {

/// The scale of the sensor is not quite even, with an error that returns along the stroke: of the poles of a resolver or of
/// a linear scale, of the turns of a screw, or with a period as long as the stroke the bow of a transducer.
template <class Scalar>
struct SensorNonlinearity : Effect<Scalar> {
  static constexpr EffectInfo kInfo{
      "sensor_nonlinearity",
      Subsystem::sensor,
      "m = y + amplitude sin(2 pi y / period)",
      "Fraden, Handbook of Modern Sensors, 4th ed., Springer 2010, ch. 2",
      "motion over more than a period, at several speeds",
      "the position, against pressures or a second sensor",
      "transducers of good quality are linear within 0.02 % of their stroke or 10 micrometres"};
  static constexpr std::array<ParameterInfo, 2> kParameters{
      {{"amplitude_m", "m", -2e-2, 2e-2, 3e-4, "largest error of the reading"},
       {"period_m", "m", 1e-3, 2.0, 0.05, "distance after which the error returns", 0.0}}};
  std::array<Scalar, 2> parameters{};

  static constexpr std::array kNeeds{Need::wide_travel};
  static constexpr Reach kReach = Reach::sensor_noise;
  static constexpr LogPlace kLogPlace = LogPlace::position;
  static constexpr std::array kDoesNotCommute{"sensor_lag", "sensor_quantisation"};
  static constexpr double kUnknownStroke = 0.3;                    // m
  static constexpr std::array kShares{1.0, 0.6, 0.4, 0.25, 0.16};  // of the stroke
  static constexpr std::size_t kScanned = 27;
  /// From an amplitude that is not zero a fit reaches a period that is off by a tenth, if the motion covers a period or two
  /// and the sign is right. Where the amplitude is zero the reading does not depend on the period, so that the first step
  /// of a fit finds the amplitude that is best with this period. Many periods are tried so: the nearest one is off by an
  /// eighth of a turn at most over three quarters of the stroke. Fits found 11 of 20 periods with 14 of them, and all with
  /// these. The others are for derivatives by differences, which need an amplitude.
  static std::array<Sizes<2>, kShares.size() + kScanned> starts(const MachineScale& machine) {
    const double stroke = stroke_or(machine, kUnknownStroke);
    std::array<Sizes<2>, kShares.size() + kScanned> all{};
    for (std::size_t i = 0; i < kScanned; ++i) {
      all[i] = {0.0, stroke / (1.0 + 0.35 * static_cast<double>(i))};
    }
    for (std::size_t i = 0; i < kShares.size(); ++i) {
      all[kScanned + i] = {1e-3 * stroke, kShares[i] * stroke};
    }
    return all;
  }
  static bool matters(const Sizes<2>& size, const MachineScale& machine) {
    // The transducer of an unknown stroke: fmax passes over NaN.
    return std::abs(size[0]) >= std::fmax(1e-5, 2e-4 * machine.stroke_m);
  }

  Scalar start_sensor(const Scalar& position) {
    position_ = position;
    return reading_of(position);
  }
  Scalar sense(const Scalar& position, double /*h*/) { return start_sensor(position); }
  Scalar shift_sensor(const Scalar& change) {
    const Scalar before = position_;
    position_ = position_of(reading_of(before) + change);
    return position_ - before;
  }
  /// The root of y + amplitude sin(2 pi y / period) = m, which is one alone unless the error falls faster than the position
  /// rises.
  Scalar position_of(const Scalar& reading) const {
    if (!has_period()) {
      return reading;
    }
    const double amplitude = value_of(parameters[0]);
    const double turn = kTwoPi / value_of(parameters[1]);
    const double m = value_of(reading);
    double low = m - std::abs(amplitude);
    double high = m + std::abs(amplitude);
    double y = m;
    const auto slope = [&] {
      return std::fmax(1.0 + amplitude * turn * std::cos(turn * y), kLeastSlope);
    };
    // Newton's method, or half of the interval where it would leave it.
    constexpr int kMostSteps = 60;
    for (int i = 0; i < kMostSteps; ++i) {
      const double error = y + amplitude * std::sin(turn * y) - m;
      (error > 0.0 ? high : low) = y;
      const double next = y - error / slope();
      const double last = y;
      y = low <= next && next <= high ? next : 0.5 * (low + high);
      if (std::abs(y - last) <= kExact) {
        break;
      }
    }
    // One more step has the derivatives.
    return y + (reading - reading_of(Scalar(y))) / slope();
  }

 private:
  static constexpr double kTwoPi = 6.283185307179586;
  static constexpr double kLeastSlope = 0.1;
  static constexpr double kExact = 1e-15;  // m

  bool has_period() const { return value_of(parameters[1]) > 0.0; }

  Scalar reading_of(const Scalar& position) const {
    using std::sin;
    return has_period() ? position + parameters[0] * sin(position * kTwoPi / parameters[1])
                        : position;
  }

  Scalar position_{};
};

}  // namespace ehsid::plant
