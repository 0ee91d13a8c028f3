// SPDX-License-Identifier: MIT
// What a ServoEstimator is told once, and what it tells: settings, values with intervals, and the reason where a value is
// not trusted.
#pragma once

#include <ehsid/types.hpp>

#include <limits>

namespace ehsid {

/// Settings of a ServoEstimator. Only the sampling time has to be given.
template <class Scalar>
struct ServoEstimatorOptions {
  Scalar dt_s = Scalar(0);  // sampling time in s, > 0
  /// Samples from a command to the first position that shows it, 1 .. kMaxDelay; one more is found by itself.
  std::int32_t delay = 1;
  /// How fast K and omega_n may wander: standard deviation of their logarithms in 1 s, >= 0.
  Scalar drift = Scalar(0.02);
  /// K is trusted where the half of its 90 % interval is below this share of it; omega_n and xi at 1.5 times this.
  Scalar tolerance = Scalar(0.1);

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&ServoEstimatorOptions::dt_s);
    visit(&ServoEstimatorOptions::delay);
    visit(&ServoEstimatorOptions::drift);
    visit(&ServoEstimatorOptions::tolerance);
  }

  bool valid(std::int32_t most_delay) const {
    return is_finite(dt_s) && dt_s > Scalar(0) && delay >= 1 && delay <= most_delay &&
           is_finite(drift) && drift >= Scalar(0) && is_finite(tolerance) && tolerance > Scalar(0);
  }
};

/// Why a value is not trusted.
enum class TrustReason : std::uint8_t {
  trusted = 0,
  starting = 1,          // too little has been seen since the start, or since all began anew
  resting = 2,           // the servo stands still, and the interval has grown
  single_sine = 3,       // the command is one sine, which does not show this value
  change_suspected = 4,  // the innovations have just been far too large
  model_does_not_fit =
      5,  // left alone, the model does not run like the servo; or the residuals are not white
  not_precise = 6,  // the interval is wider than the tolerance
};

/// The name of the reason, as of a Status.
constexpr const char* to_string(TrustReason reason) {
  switch (reason) {
    case TrustReason::trusted:
      return "trusted";
    case TrustReason::starting:
      return "starting";
    case TrustReason::resting:
      return "resting";
    case TrustReason::single_sine:
      return "single_sine";
    case TrustReason::change_suspected:
      return "change_suspected";
    case TrustReason::model_does_not_fit:
      return "model_does_not_fit";
    case TrustReason::not_precise:
      return "not_precise";
  }
  return "unknown";
}

/// A value with the half of its 90 % interval, in the same unit; NaN before there is any.
template <class Scalar>
struct TrackedValue {
  Scalar value = std::numeric_limits<Scalar>::quiet_NaN();
  Scalar half_width = std::numeric_limits<Scalar>::quiet_NaN();
  bool trusted = false;
  TrustReason reason = TrustReason::starting;
};

/// The servo of Eq. (5): gain K in units of the position per s and unit of the command (negative where a positive command
/// retracts), omega_n in rad/s, xi.
template <class Scalar>
struct TrackedServo {
  TrackedValue<Scalar> gain;
  TrackedValue<Scalar> omega_n;
  TrackedValue<Scalar> xi;
};

}  // namespace ehsid
