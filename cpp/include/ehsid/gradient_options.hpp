// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/rls_options.hpp>

namespace ehsid {

/// Settings of the recursions whose filters are made of the running estimate.
template <class Scalar>
struct GradientOptions {
  RlsOptions<Scalar> rls{};
  /// Samples at the start, and after a reset, in which the estimate is least squares on filtered signals; > 0. The
  /// running model starts with what they gave.
  std::int32_t settling = 200;
  /// The filter of these samples is 1 / (1 - start_pole q^-1)^na; 0 <= start_pole < 1. Near the poles of the plant it
  /// takes most of the bias of least squares away.
  Scalar start_pole = Scalar(0.7);
  /// The poles of the running filter are `fading` times those of the estimate; 0 < fading < 1. Then the filter
  /// forgets its start after about 1 / (1 - fading) samples, where the plant has an integrator, too.
  Scalar fading = Scalar(0.99);
  /// Part of the way that the running model follows the estimate in a sample; 0 < model_rate <= 1. Slowly, because
  /// otherwise the noise of this sample reaches the instruments of the next.
  Scalar model_rate = Scalar(0.03);

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&GradientOptions::rls);
    visit(&GradientOptions::settling);
    visit(&GradientOptions::start_pole);
    visit(&GradientOptions::fading);
    visit(&GradientOptions::model_rate);
  }

  bool valid() const {
    return rls.valid() && settling > 0 && settling <= kMostSettling && start_pole >= Scalar(0) &&
           start_pole < Scalar(1) && fading > Scalar(0) && fading < Scalar(1) &&
           model_rate > Scalar(0) && model_rate <= Scalar(1);
  }

  static constexpr std::int32_t kMostSettling = 1000000;
};

}  // namespace ehsid
