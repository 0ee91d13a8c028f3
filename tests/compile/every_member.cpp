// SPDX-License-Identifier: MIT
// Explicit instantiations, so that the warnings of every member are seen in both precisions.
#include <ehsid/c_api.h>
#include <ehsid/ehsid.hpp>

namespace ehsid {

#define EHSID_EVERY_MEMBER(policy)                                                                \
  template class OnlineEstimator<Arx<float, 3, 3, 1>, PolicyAt<place_of_policy(#policy), float>>; \
  template class OnlineEstimator<Arx<double, 1, 1, 0, true>,                                      \
                                 PolicyAt<place_of_policy(#policy), double>>;
EHSID_EACH_POLICY(EHSID_EVERY_MEMBER)

template class Arx<float, 3, 3, 1>;
template class Arx<double, 1, 1, 0, true>;
template class Rls<float, 6, Exponential<float>>;
template class Rls<double, 3, Constant<double>>;
template class InstrumentalVariables<float, 3, 6, Exponential<float>>;
template class InstrumentalVariables<double, 1, 3, Constant<double>>;
template class OnlineEstimator<Arx<float, 3, 3, 1>, Exponential<float>,
                               InstrumentalVariables<float, 3, 6, Exponential<float>>>;
template class OnlineEstimator<Arx<double, 1, 1, 0, true>, Constant<double>,
                               InstrumentalVariables<double, 1, 3, Constant<double>>>;
template class RmseReset<float>;
template class RmseReset<double>;
template class ConvergenceMonitor<float>;
template class ConvergenceMonitor<double>;
template class FitMonitor<float>;
template class FitMonitor<double>;
template class ServoFilter<float>;
template class ServoFilter<double>;
template class RestDetector<float>;
template class RestDetector<double>;
template class SingleSine<float>;
template class SingleSine<double>;
template class FreeRun<float>;
template class FreeRun<double>;
template class ServoEstimator<float>;
template class ServoEstimator<double, 1>;

// Settings, models and monitors may be constants of a program, in its read-only memory. An estimator checks its settings
// when it is made, and may not.
template <class... Types>
constexpr bool kConstants = (static_cast<void>(Types{}), ..., true);
static_assert(kConstants<RlsOptions<float>, GradientOptions<float>, ConvergenceOptions<float>,
                         RmseResetOptions<float>, Scaling<float>, ServoEstimatorOptions<float>,
                         Constant<float>, Exponential<float>, ErrorDriven<float>, FRatio<float>,
                         UdFactors<float, 6>, Arx<float, 3, 3, 1>, Integrating<Arx<float, 2, 3, 1>>,
                         RmseReset<float>, ConvergenceMonitor<float>, WhitenessMonitor<float>>);

}  // namespace ehsid
