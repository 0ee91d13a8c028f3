// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/forgetting/evidence.hpp>
#include <ehsid/forgetting/settings.hpp>
#include <ehsid/ud.hpp>

namespace ehsid {

/// Kalman filter for parameters that wander: theta(k) = theta(k-1) + w(k), Var w = sigma^2 diag(drift).
///
/// Source: L. Ljung, S. Gunnarsson, "Adaptation and tracking in system identification - a survey",
/// Automatica 26(1), 1990, pp. 7-21; factors updated by Bierman (1977), ch. III and V.
/// Equation: P <- P + Q, then the measurement update with lambda = 1.
/// Guarantee: P grows by at most Q a step, not geometrically; the optimal estimate if theta
/// really is a random walk with this Q. The estimator's guards bound P without excitation.
/// Cost: n rank-one updates of a unit vector, n^3 / 3 multiplications: the dearest policy.
/// Default: drift = 1e-4 each, which at unit regressor variance matches lambda = 0.99.
template <class Scalar, int kN>
struct RandomWalk {
  static constexpr std::uint32_t kId = 6;
  static constexpr bool kSpreads = true;
  static constexpr bool kFilters = false;
  static constexpr PolicyInfo kInfo{"random_walk", "RandomWalk",
                                    "Kalman filter for parameters that wander",
                                    "Ljung, Gunnarsson 1990"};

  Array<Scalar, kN> drift = uniform(Scalar(1e-4));

  template <class Visit>
  static constexpr void settings(Visit visit) {
    visit(SettingInfo{"drift", Range::at_least(0.0), "sigma^2",
                      "variance of each (scaled) parameter a step, in units of sigma^2", 9},
          [](auto& owner) -> auto& { return owner.drift; });
  }

  static Array<Scalar, kN> uniform(Scalar value) {
    Array<Scalar, kN> all;
    all.fill(value);
    return all;
  }

  bool valid() const { return settings_valid(*this); }
  void restart() {}
  ForgettingFactors<Scalar> peek(const Evidence<Scalar>& /*evidence*/) const {
    return {Scalar(1), Scalar(1)};
  }
  void accept(const Evidence<Scalar>& /*evidence*/) {}

  EHSID_ALWAYS_INLINE Scalar loss(int parameter, Scalar variance) const {
    const Scalar added = drift[static_cast<std::size_t>(parameter)];
    return added / (variance + added);
  }

  EHSID_ALWAYS_INLINE void spread(UdFactors<Scalar, kN>& factors,
                                  const Vector<Scalar, kN>& /*phi*/) const {
    upwards(count_of<kN>(factors.size()), [&](const auto i) EHSID_INLINE_LAMBDA {
      factors.add_variance(i, drift[static_cast<std::size_t>(i)]);
    });
  }
};

}  // namespace ehsid
