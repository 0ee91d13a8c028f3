// SPDX-License-Identifier: MIT
#include "reference.h"

#include <ehsid/fit.hpp>

namespace {

struct Reference {
  ehsid::Status (*start)();
  void (*step)(float, float, readings&);
  void (*enable)(bool);
  void (*reset)();
};

template <class Estimator, ehsid::Status (*configure)(Estimator&)>
Reference reference() {
  static Estimator estimator;
  static ehsid::FitMonitor<float> fit;
  return {[] {
            fit.restart();
            return configure(estimator);
          },
          [](float command, float position, readings& made) {
            const ehsid::Status status = estimator.step(command, position);
            if (status == ehsid::Status::ok || status == ehsid::Status::no_information) {
              fit.update(position, estimator.innovation());
            }
            made.status = static_cast<std::int32_t>(status);
            const auto theta = estimator.theta_hat();
            const auto deviation = estimator.standard_deviation();
            const auto covariance = estimator.covariance();
            for (int i = 0; i < Estimator::kN; ++i) {
              made.theta[i] = theta[i];
              made.deviation[i] = deviation[i];
              made.variance[i] = covariance(i, i);
            }
            made.report.innovation = estimator.innovation();
            made.report.forgetting_factor = estimator.forgetting_factor();
            made.report.residual_variance = estimator.residual_variance();
            made.report.fit_percent = fit.percent();
            made.report.excitation = estimator.monitor().excitation();
            made.report.resets = estimator.change_detector().alarms();
            made.report.whiteness = estimator.whiteness().statistic();
            made.report.white = estimator.whiteness().white();
            made.report.settled = estimator.settled();
            made.report.converged = estimator.converged();
            made.report.enabled = estimator.enabled();
          },
          [](bool on) { estimator.enable(on); }, [] { estimator.reset(); }};
}

#define EHSID_REFERENCE(name) reference<name::Estimator, name::configure>(),

const Reference& reference(int which) {
  static const Reference all[CASES] = {EXPORTED_CASES(EHSID_REFERENCE)};
  return all[which];
}

}  // namespace

int32_t reference_start(int which) { return static_cast<int32_t>(reference(which).start()); }

void reference_step(int which, float command, float position, readings* made) {
  reference(which).step(command, position, *made);
}

void reference_enable(int which, bool on) { reference(which).enable(on); }

void reference_reset(int which) { reference(which).reset(); }
