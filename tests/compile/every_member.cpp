// SPDX-License-Identifier: MIT
// Explicit instantiations, so that the warnings of every member are seen in both precisions.
#include <ehsid/ehsid.hpp>

namespace ehsid {

template class OnlineEstimator<Arx<float, 3, 3, 1>, Constant<float>>;
template class OnlineEstimator<Arx<float, 3, 3, 1>, Exponential<float>>;
template class OnlineEstimator<Arx<float, 3, 3, 1>, ErrorDriven<float>>;
template class OnlineEstimator<Arx<float, 3, 3, 1>, FRatio<float>>;
template class OnlineEstimator<Arx<float, 3, 3, 1>, Directional<float>>;
template class OnlineEstimator<Arx<float, 3, 3, 1>, RandomWalk<float, 6>>;
template class OnlineEstimator<Arx<double, 1, 1, 0, true>, Constant<double>>;
template class OnlineEstimator<Arx<double, 1, 1, 0, true>, Exponential<double>>;
template class OnlineEstimator<Arx<double, 1, 1, 0, true>, ErrorDriven<double>>;
template class OnlineEstimator<Arx<double, 1, 1, 0, true>, FRatio<double>>;
template class OnlineEstimator<Arx<double, 1, 1, 0, true>, Directional<double>>;
template class OnlineEstimator<Arx<double, 1, 1, 0, true>, RandomWalk<double, 3>>;

template class Arx<float, 3, 3, 1>;
template class Arx<double, 1, 1, 0, true>;
template class Rls<float, 6, Exponential<float>>;
template class Rls<double, 3, RandomWalk<double, 3>>;
template class RmseReset<float>;
template class RmseReset<double>;
template class ConvergenceMonitor<float>;
template class ConvergenceMonitor<double>;
template class FitMonitor<float>;
template class FitMonitor<double>;

}  // namespace ehsid
