// SPDX-License-Identifier: MIT
// What holds for the outputs of every estimator after a call that was not refused.
#pragma once

#include "data.hpp"

#include <ehsid/c_api.h>
#include <ehsid/types.hpp>

namespace fuzz {

/// A variance, or another number that is never negative.
template <class Scalar>
bool is_magnitude(Scalar value) {
  return ehsid::is_finite(value) && value >= Scalar(0);
}

/// An estimator of C.
inline void check_c_outputs(const ehsid_estimator* estimator) {
  const std::size_t n = ehsid_parameters(estimator);
  float theta[EHSID_MAX_PARAMETERS] = {};
  float deviation[EHSID_MAX_PARAMETERS] = {};
  float variance[EHSID_MAX_PARAMETERS] = {};
  ehsid_report report = {};
  check(ehsid_theta(estimator, theta, n) == EHSID_OK &&
            ehsid_standard_deviation(estimator, deviation, n) == EHSID_OK &&
            ehsid_covariance_diagonal(estimator, variance, n) == EHSID_OK &&
            ehsid_read(estimator, &report) == EHSID_OK,
        "an estimator can be read");
  for (std::size_t i = 0; i < n; ++i) {
    check(ehsid::is_finite(theta[i]), "theta is finite");
    check(is_magnitude(deviation[i]), "deviations are not negative, and finite");
    check(is_magnitude(variance[i]), "variances are not negative, and finite");
  }
  check(ehsid::is_finite(report.innovation), "the innovation is finite");
  check(report.forgetting_factor > 0.0F && report.forgetting_factor <= 1.0F,
        "lambda is above 0 and at most 1");
  check(is_magnitude(report.residual_variance), "sigma^2 is not negative, and finite");
  check(ehsid::is_finite(report.fit_percent), "the fit is finite");
  check(report.excitation >= 0.0F && report.excitation <= 1.0F, "the excitation is a share");
  check(report.resets >= 0, "resets are counted from 0 on");
}

/// An estimator of C++.
template <class Estimator>
void check_outputs(const Estimator& estimator) {
  const auto theta = estimator.theta_hat();
  const auto deviation = estimator.standard_deviation();
  const auto covariance = estimator.covariance();
  for (int i = 0; i < estimator.size(); ++i) {
    check(ehsid::is_finite(theta[i]), "theta is finite");
    check(is_magnitude(deviation[i]), "deviations are not negative, and finite");
    check(is_magnitude(covariance(i, i)), "variances are not negative, and finite");
  }
  check(ehsid::is_finite(estimator.innovation()), "the innovation is finite");
  check(estimator.forgetting_factor() > 0 && estimator.forgetting_factor() <= 1,
        "lambda is above 0 and at most 1");
  check(is_magnitude(estimator.residual_variance()), "sigma^2 is not negative, and finite");
}

}  // namespace fuzz
