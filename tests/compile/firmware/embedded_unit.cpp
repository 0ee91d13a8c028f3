// SPDX-License-Identifier: MIT
// What a controller calls, for every forgetting policy; the storage is the caller's.
#include <ehsid/c_api.h>
#include <ehsid/ehsid.hpp>

#include <new>

namespace {

template <class Forgetting>
using Estimator = ehsid::ArxEstimator<float, 3, 3, 1, Forgetting>;

}  // namespace

template <class Forgetting>
void start(void* storage) {
  static_cast<void>(::new (storage) Estimator<Forgetting>());
}

template <class Forgetting>
ehsid::Status configure(Estimator<Forgetting>& estimator, float lambda_margin) {
  typename Estimator<Forgetting>::Options options;
  options.rls.information_margin = lambda_margin;
  return estimator.configure(options);
}

template <class Forgetting>
ehsid::Status seed(Estimator<Forgetting>& estimator, const float* theta, const float* variances) {
  ehsid::UdFactors<float, 6> factors;
  ehsid::Vector<float, 6> start;
  ehsid::Vector<float, 6> diagonal;
  for (int i = 0; i < 6; ++i) {
    start[i] = theta[i];
    diagonal[i] = variances[i];
  }
  return factors.set_diagonal(diagonal) ? estimator.seed(start, factors, variances[6])
                                        : ehsid::Status::invalid_argument;
}

template <class Forgetting>
ehsid::Status step(Estimator<Forgetting>& estimator, float command, float position) {
  return estimator.step(command, position);
}

template <class Forgetting>
ehsid::Status move_state(const Estimator<Forgetting>& from, Estimator<Forgetting>& to) {
  return to.restore(from.save());
}

template <class Forgetting>
bool read(const Estimator<Forgetting>& estimator, float* theta, float* deviation, float* ahead) {
  const auto theta_hat = estimator.theta_hat();
  const auto standard_deviation = estimator.standard_deviation();
  const auto covariance = estimator.covariance();
  const ehsid::Vector<float, 4> commands = ehsid::Vector<float, 4>::Zero();
  const auto predicted = estimator.template predict_ahead<4>(commands);
  for (int i = 0; i < 6; ++i) {
    theta[i] = theta_hat[i];
    deviation[i] = standard_deviation[i] + covariance(i, 0);
  }
  for (int i = 0; i < 4; ++i) {
    ahead[i] = predicted[i] + estimator.innovation() * estimator.forgetting_factor();
  }
  return estimator.converged();
}

template <class Forgetting>
void operate(Estimator<Forgetting>& estimator, bool on) {
  estimator.reset();
  estimator.enable(on);
}

#define EHSID_FIRMWARE(Policy)                                                                \
  template void start<ehsid::Policy>(void*);                                                  \
  template ehsid::Status configure<ehsid::Policy>(Estimator<ehsid::Policy>&, float);          \
  template ehsid::Status seed<ehsid::Policy>(Estimator<ehsid::Policy>&, const float*,         \
                                             const float*);                                   \
  template ehsid::Status step<ehsid::Policy>(Estimator<ehsid::Policy>&, float, float);        \
  template ehsid::Status move_state<ehsid::Policy>(const Estimator<ehsid::Policy>&,           \
                                                   Estimator<ehsid::Policy>&);                \
  template bool read<ehsid::Policy>(const Estimator<ehsid::Policy>&, float*, float*, float*); \
  template void operate<ehsid::Policy>(Estimator<ehsid::Policy>&, bool)

#define EHSID_FIRMWARE_OF(policy) EHSID_FIRMWARE(PolicyOfSix<ehsid::place_of_policy(#policy)>);
namespace ehsid {  // a name without a comma, for the macro
template <std::size_t kPlace>
using PolicyOfSix = PolicyAt<kPlace, float>;
}  // namespace ehsid
EHSID_EACH_POLICY(EHSID_FIRMWARE_OF)

ehsid::Status start_servo(void* storage, float dt_s) {
  auto& estimator = *::new (storage) ehsid::ServoEstimator<float>();
  ehsid::ServoEstimator<float>::Options options;
  options.dt_s = dt_s;
  return estimator.configure(options);
}

ehsid::Status step_servo(ehsid::ServoEstimator<float>& estimator, float command, float position) {
  return estimator.step(command, position);
}

ehsid::TrackedServo<float> read_servo(const ehsid::ServoEstimator<float>& estimator) {
  return estimator.servo();
}

using Small = ehsid::SmallArxEstimator<float, 3, 3, 1>;

ehsid::Status start_small(void* storage, const float* variance) {
  auto& estimator = *::new (storage) Small();
  Small::Options options;
  options.variance0[0] = *variance;
  return estimator.configure(options);
}

ehsid::Status step_small(Small& estimator, float command, float position) {
  return estimator.step(command, position);
}

float read_small(const Small& estimator, Small& copy) {
  return copy.restore(estimator.save()) == ehsid::Status::ok ? copy.standard_deviation()[0]
                                                             : estimator.theta_hat()[0];
}
