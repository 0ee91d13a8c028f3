// SPDX-License-Identifier: MIT
// Gauss-Newton recursion of a prediction-error method on the recursion of rls.hpp.
//
//   theta(k) = theta(k-1) + P(k) psi(k) epsilon(k),   P^-1(k) = lambda(k) P^-1(k-1) + psi(k) psi'(k)
//
// psi(k) is minus the gradient of the prediction error epsilon(k) with respect to theta, or an instrument in its place.
// Source: L. Ljung, T. Soderstrom, Theory and Practice of Recursive Identification, MIT Press 1983, ch. 3.
//
// It is Eqs. (13)-(14) with psi for phi. So the update of rls.hpp is used as it is, with the prediction of this model in
// place of psi' theta. UD factors, forgetting policies, guards, compensated sums and sigma^2 are those of least squares.
#pragma once

#include <ehsid/gradient_options.hpp>
#include <ehsid/polynomial.hpp>
#include <ehsid/rls.hpp>

#include <cmath>

namespace ehsid {

/// What OnlineEstimator asks of a recursion, answered by the Rls inside.
///
/// Scalar: float or double. kNa: past outputs in the regressor, its first entries. kN: parameters of the model. Both > 0,
/// or both up_to(most). kModelsNoise: na parameters behind those of the model describe the noise. Forgetting: see
/// forgetting.hpp.
template <class Scalar_, int kNa_, int kN_, bool kModelsNoise_, class Forgetting_>
class GradientRecursion {
 public:
  using Scalar = Scalar_;
  using Forgetting = Forgetting_;
  static constexpr int kN = kN_;
  static constexpr int kNa = kNa_;
  static constexpr int kNoiseParameters = kModelsNoise_ ? capacity(kNa) : 0;
  /// All parameters.
  static constexpr int kAll = kN > 0 ? kN + kNoiseParameters
                                     : up_to(capacity(kN) + kNoiseParameters);
  /// This recursion keeps samples and filters of its own: OnlineEstimator tells it the order and where samples are missing.
  static constexpr bool kFollowsModel = true;
  static constexpr Scalar kDefaultVariance = Scalar(1e6);

  using Inner = Rls<Scalar, kAll, Forgetting>;
  using Regressor = Vector<Scalar, kN>;
  using Parameters = Vector<Scalar, kN>;
  using Covariance = SquareMatrix<Scalar, kN>;
  using Options = GradientOptions<Scalar>;

  /// Number of parameters of the model.
  int size() const { return inner_.size() - noise_size(); }
  /// Number of parameters of the noise.
  int noise_size() const { return kModelsNoise_ ? na() : 0; }
  /// Past outputs in the regressor.
  int na() const { return past_outputs_.size(); }

  Parameters theta_hat() const { return to_vector<kN>(size(), inner_.state().theta); }
  /// P(k) of the model's parameters; parameter_variance() P is their covariance.
  Covariance P() const {
    const int n = size();
    return inner_.P().topLeftCorner(n, n);
  }
  Regressor gain() const { return to_vector<kN>(size(), inner_.state().gain); }
  /// epsilon(k) of the last step that was not refused.
  Scalar innovation() const { return inner_.innovation(); }
  Scalar forgetting_factor() const { return inner_.forgetting_factor(); }
  Scalar normalised_square() const { return inner_.normalised_square(); }
  /// sigma^2, the variance of epsilon.
  Scalar residual_variance() const { return inner_.residual_variance(); }
  /// As Rls::parameter_variance().
  Scalar parameter_variance() const { return inner_.parameter_variance(); }
  /// sqrt(parameter_variance() P_ii); always finite.
  Parameters standard_deviation() const { return inner_.standard_deviation().head(size()); }

  /// What ConvergenceMonitor judges: the parameters of the model, not those of the noise.
  struct Judged {
    using Forgetting = Forgetting_;
    static constexpr int kN = kN_;
    const Inner& inner;
    int n;
    const typename Inner::State& state() const { return inner.state(); }
    Scalar parameter_variance() const { return inner.parameter_variance(); }
    int size() const { return n; }
    bool starved() const { return inner.starved(); }
  };
  Judged judged() const { return {inner_, size()}; }

 protected:
  /// psi of all parameters.
  using Gradient = Vector<Scalar, kAll>;

  /// One step with a gradient, the output and its prediction. As Rls::update(); no_information where the estimate rests.
  ///
  /// P^-1 weighs `weight` samples, so psi' P psi times the weight is the number of directions that the samples show: on
  /// average as many as there are parameters, one where the command is held. The estimate rests where the average falls
  /// below the geometric mean of both: an instrument in one direction says nothing of the others, whatever lambda is. Not
  /// with parameters of the noise, which is always excited: there the guards of rls.hpp are the only ones.
  Status learn(const Gradient& psi, Scalar y, Scalar predicted) {
    if constexpr (kNoiseParameters > 0) {
      return inner_.update(psi, y, predicted);
    } else {
      const typename Inner::State& state = inner_.state();
      const int n = inner_.size();
      if (directions_ < least_directions(n)) {
        Array<Scalar, kAll> projected;
        const Scalar information = state.factors.project(psi, projected);
        if (!is_finite(information) || !is_finite(y - predicted)) {
          return Status::numerical_limit;
        }
        count_directions(information);
        return Status::no_information;
      }
      const Status status = inner_.update(psi, y, predicted);
      if (status == Status::ok) {
        // psi' K = psi' P psi / (lambda + psi' P psi)
        const Scalar share = dot(n, psi, state.gain);
        count_directions(share < Scalar(1) ? state.forgetting_factor * share / (Scalar(1) - share)
                                           : Scalar(kMostDirections));
      }
      return status;
    }
  }

  /// As at the start.
  void restart_directions() { directions_ = Scalar(kMostDirections); }

  Scalar estimated(int i) const { return inner_.state().theta[static_cast<std::size_t>(i)]; }

  void write_options(ByteStream& writer, const ModelShape& of) const {
    inner_.write_configuration(writer, of);
    stream_fields(writer, of, options_);
  }

  static constexpr int kMostDirections = 1000;

  Inner inner_{};
  /// Average of psi' P psi times the weight, over the weight in samples, at most kMemory.
  Scalar directions_ = Scalar(kMostDirections);
  Options options_{};
  Extent<kNa> past_outputs_{};

 private:
  static constexpr int kMemory = 256;
  static constexpr int kLeastMemory = 16;

  static Scalar least_directions(int n) {
    return n > 1 ? std::sqrt(static_cast<Scalar>(n)) : Scalar(0.5);
  }

  void count_directions(Scalar information) {
    const Scalar shown = information * inner_.state().weight;
    const Scalar samples = bounded(inner_.state().weight, Scalar(kLeastMemory), Scalar(kMemory));
    directions_ += (bounded(shown, Scalar(0), Scalar(kMostDirections)) - directions_) / samples;
  }

  static Scalar bounded(Scalar value, Scalar least, Scalar most) {
    return value < least ? least : value < most ? value : most;
  }
};

/// All `count` of these squarable, i.e. fit to be kept in a filter?
template <class Values>
bool all_squarable(int count, const Values& values) {
  bool good = true;
  for (int i = 0; i < count; ++i) {
    good = is_squarable(entry(values, i)) && good;
  }
  return good;
}

}  // namespace ehsid
