// SPDX-License-Identifier: MIT
// Estimator for a noisy position sensor: y(k) = x(k) + v(k), A(q^-1) x(k) = q^-nk B(q^-1) u(k).
//
// There y in the regressor of least squares carries the noise that is also in the equation error A v, and the estimate is
// biased whatever the number of samples. Here a running model computes x from the command alone, and x takes the place
// of y in the instrument psi:
//
//   z(k)   = (-x(k-1) .. -x(k-na), u(k-nk) .. u(k-nk-nb+1) [, 1])       x of the running model
//   psi(k) = z(k) / F(q^-1),    F(q^-1) = A(fading q^-1) of the running model
//   epsilon(k) = (y(k) - phi'(k) theta(k-1)) / F,                       phi as in Eq. (8) with the measured y
//   theta(k) = theta(k-1) + P(k) psi(k) epsilon(k),   P^-1(k) = lambda(k) P^-1(k-1) + psi(k) psi'(k)
//
// This is the refined instrumental variable method in its symmetric form.
// Source: P. C. Young, Recursive Estimation and Time-Series Analysis, 2nd ed., Springer 2011, ch. 7.
//
// The last line is Eqs. (13)-(14) with psi for phi. So the update of rls.hpp is used as it is, with the prediction of this
// model in place of psi' theta. UD factors, forgetting policies, guards, compensated sums and sigma^2 are those of least
// squares. The mathematics and what was measured are in docs/which_estimator.md.
#pragma once

#include <ehsid/arx.hpp>
#include <ehsid/arx_estimator.hpp>
#include <ehsid/forgetting.hpp>
#include <ehsid/gradient_options.hpp>
#include <ehsid/integrating.hpp>
#include <ehsid/polynomial.hpp>
#include <ehsid/rls.hpp>

#include <cmath>
#include <limits>

namespace ehsid {

/// The running model and its filters. Plain data. A filter keeps its last na outputs, newest first.
template <class Scalar, int kNa, int kN>
struct RunningModelState {
  static constexpr int kOfGradient = capacity(kNa) * capacity(kN);
  static constexpr int kOfOutputs = capacity(kNa) * capacity(kNa);

  Array<Scalar, kN> model;             // parameters of the running model
  Array<Scalar, kNa> filter;           // f1 .. f_na of F, see above
  Array<Scalar, kNa> outputs;          // its outputs x(k-1) .. x(k-na)
  Array<Scalar, kOfGradient> psi;      // psi(k-1) .. psi(k-na), n numbers each
  Array<Scalar, kOfOutputs> measured;  // the same of the first na entries of phi
  Array<Scalar, kNa> filtered;         // the same of y
  std::int32_t samples;  // taken since the start or a reset, up to where the count ends
  std::int32_t
      filled;         // samples that the filters have seen without a hole, up to those of settling
  Scalar recent;      // mean square of about the last 16 errors
  std::int32_t lost;  // samples in a row that the running model, or sigma^2, had nothing to do with
  std::int32_t doubts;  // refused samples, without kCalm good ones behind the last
  std::int32_t calm;    // good samples since the last refused one, up to kCalm

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&RunningModelState::model, each_parameter);
    visit(&RunningModelState::filter, each_output);
    visit(&RunningModelState::outputs, each_output);
    visit(&RunningModelState::psi, [](const ModelShape& of) { return of.na * of.size(); });
    visit(&RunningModelState::measured, [](const ModelShape& of) { return of.na * of.na; });
    visit(&RunningModelState::filtered, each_output);
    visit(&RunningModelState::samples);
    visit(&RunningModelState::filled);
    visit(&RunningModelState::recent);
    visit(&RunningModelState::lost);
    visit(&RunningModelState::doubts);
    visit(&RunningModelState::calm);
  }
};

/// Recursion and running model.
template <class Scalar, int kNa, int kN, class Forgetting>
struct InstrumentalState {
  RlsState<Scalar, kN, Forgetting> recursion;
  RunningModelState<Scalar, kNa, kN> running;
  Scalar directions;  // that the samples show, see InstrumentalVariables::learn()

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&InstrumentalState::recursion);
    visit(&InstrumentalState::running);
    visit(&InstrumentalState::directions);
  }
};

/// The recursion for noise of the position sensor, see the top of the file. Takes the place of Rls in OnlineEstimator.
///
/// kNa: past outputs in the regressor, its first entries. kN: all parameters. Both > 0, or both up_to(most).
/// Forgetting: see forgetting.hpp. update() is transactional: the whole step is computed, checked, and only then kept.
template <class Scalar_, int kNa_, int kN_, class Forgetting_>
class InstrumentalVariables {
 public:
  using Scalar = Scalar_;
  using Forgetting = Forgetting_;
  static constexpr int kNa = kNa_;
  static constexpr int kN = kN_;
  /// This recursion keeps samples and filters of its own: OnlineEstimator tells it the order and where samples are missing.
  static constexpr bool kFollowsModel = true;
  static constexpr Scalar kDefaultVariance = Scalar(1e6);
  /// Correlation, from sample to sample, that the filters give to epsilon of white noise, at most: A / F, and the sums of
  /// integrating.hpp. It does not bias theta.
  static constexpr Scalar kOwnColour = Scalar(0.05);

  using Inner = Rls<Scalar, kN, Forgetting>;
  using Regressor = Vector<Scalar, kN>;
  using Parameters = Vector<Scalar, kN>;
  using Covariance = SquareMatrix<Scalar, kN>;
  using Options = GradientOptions<Scalar>;
  using Parts = AllParts;
  using State = InstrumentalState<Scalar, kNa, kN, Forgetting>;

  InstrumentalVariables() : InstrumentalVariables(Forgetting{}) {}
  explicit InstrumentalVariables(const Forgetting& forgetting, const Options& options = Options{}) {
    if (configure(forgetting, options) != Status::ok) {
      static_cast<void>(configure(Forgetting{}, Options{}));
    }
  }

  /// Sets policy and options; the estimate stays, and settles anew. invalid_argument leaves all as it was.
  Status configure(const Forgetting& forgetting, const Options& options) {
    if (!options.valid() || inner_.configure(forgetting, options.rls) != Status::ok) {
      return Status::invalid_argument;
    }
    options_ = options;
    settle();
    return Status::ok;
  }

  /// As Rls::start(), for a regressor whose first na entries, 1 to the number of parameters, are past outputs.
  Status start(const Parameters& theta0, const Parameters& variances, int outputs) {
    if (!Extent<kNa>::accepts(outputs) || outputs > theta0.size() ||
        inner_.start(theta0, variances) != Status::ok) {
      return Status::invalid_argument;
    }
    past_outputs_.resize(outputs);
    running_ = RunningModelState<Scalar, kNa, kN>{};
    settle();
    return Status::ok;
  }

  /// As Rls::seed(). Where the model of theta is stable, the estimator does not settle: it starts with this model.
  Status seed(const Parameters& theta, const UdFactors<Scalar, kN>& factors,
              Scalar noise_variance) {
    const Status status = inner_.seed(theta, factors, noise_variance);
    if (status == Status::ok) {
      running_ = RunningModelState<Scalar, kNa, kN>{};
      settle();
      running_.samples = follow(Scalar(1), Scalar(1)) ? options_.settling : 0;
    }
    return status;
  }

  /// Past samples are missing: the filters start from zero with the next regressor, x with its measured outputs. Past
  /// settling nothing is learned from as many samples, because the noise of these outputs goes through the filters.
  void clear_history() { running_.filled = 0; }

  /// One sample: phi(k) as in Eq. (8) and y(k). As Rls::update(); after no_information, and after filling behind a hole,
  /// only the filters have moved on. out_of_range: a glitch, clear_history() is due. reset: all has begun anew.
  Status update(const Regressor& phi, Scalar y) {
    Array<Scalar, kN> variances;
    return update(phi, y, variances);
  }

  /// The same; as Rls::update(), all P_ii of judged() go to `variances` where the step was kept.
  Status update(const Regressor& phi, Scalar y, Array<Scalar, kN>& variances) {
    const int n = size();
    const int outputs = na();
    const bool settled = running_.samples >= options_.settling;
    const bool fresh = running_.filled == 0;
    // z(k); while settling phi(k) itself
    Regressor z = phi;
    if (settled && !fresh) {
      for (int i = 0; i < outputs; ++i) {
        z[i] = -running_.outputs[static_cast<std::size_t>(i)];
      }
    }
    // psi(k) = z(k) / F, and the same of phi(k) and y(k): they differ in the first na entries only
    Regressor psi = z;
    Array<Scalar, kNa> measured;
    for (int i = 0; i < outputs; ++i) {
      measured[static_cast<std::size_t>(i)] = phi[i];
    }
    Scalar filtered = y;
    if (!fresh) {
      for (int lag = 0; lag < outputs; ++lag) {
        const Scalar f = running_.filter[static_cast<std::size_t>(lag)];
        const Scalar* past = running_.psi.data() + lag * n;
        const Scalar* before = running_.measured.data() + lag * outputs;
        EHSID_UNROLL
        for (int i = 0; i < n; ++i) {
          psi[i] -= f * past[i];
        }
        EHSID_UNROLL
        for (int i = 0; i < outputs; ++i) {
          measured[static_cast<std::size_t>(i)] -= f * before[i];
        }
        filtered -= f * running_.filtered[static_cast<std::size_t>(lag)];
      }
    }
    Scalar predicted(0);
    for (int i = 0; i < n; ++i) {
      predicted += (i < outputs ? measured[static_cast<std::size_t>(i)] : psi[i]) * estimated(i);
    }
    if (!all_squarable(n, psi) || !all_squarable(outputs, measured) || !is_squarable(filtered) ||
        !is_squarable(predicted)) {
      return is_finite(y) && all_finite(n, phi) ? Status::numerical_limit : Status::invalid_input;
    }
    const Scalar error = filtered - predicted;
    const Scalar power = filtered * filtered + predicted * predicted;
    if (is_glitch(psi, error * error, power)) {
      running_.calm = 0;
      ++running_.doubts;
      return running_.doubts <= kMostDoubts ? Status::out_of_range : begin_anew();
    }
    Status status = Status::filling;
    bool wrong = false;
    if (!settled || running_.filled >= options_.settling) {
      wrong = settled && misled(measured, psi);
      status = wrong ? rest(psi) : learn(psi, filtered, predicted, variances);
    }
    if (is_error(status)) {
      return status;
    }
    if (is_lost(wrong, status, error * error)) {
      return begin_anew();
    }
    // The step is kept. Nothing below can fail.
    push(psi, measured, filtered, n, fresh);
    if (status == Status::ok) {
      advance();
    }
    run_model(z, y, settled);
    return status;
  }

  /// lambda and P back to their start values, theta kept; the estimator settles anew.
  void reset() {
    inner_.reset();
    settle();
  }

  /// Number of parameters.
  int size() const { return inner_.size(); }
  /// Past outputs in the regressor.
  int na() const { return past_outputs_.size(); }

  Parameters theta_hat() const { return inner_.theta_hat(); }
  /// parameter_variance() P is the covariance of theta_hat.
  Covariance P() const { return inner_.P(); }
  Regressor gain() const { return inner_.gain(); }
  /// epsilon(k) of the last step that was not refused.
  Scalar innovation() const { return inner_.innovation(); }
  Scalar forgetting_factor() const { return inner_.forgetting_factor(); }
  Scalar normalised_square() const { return inner_.normalised_square(); }
  /// sigma^2, the variance of epsilon.
  Scalar residual_variance() const { return inner_.residual_variance(); }
  /// As Rls::parameter_variance().
  Scalar parameter_variance() const { return inner_.parameter_variance(); }
  /// sqrt(parameter_variance() P_ii); always finite.
  Parameters standard_deviation() const { return inner_.standard_deviation(); }
  /// What the monitors of convergence and whiteness judge.
  const Inner& judged() const { return inner_; }

  /// Has the running model taken over, so that the estimate is consistent?
  bool settled() const { return running_.samples >= options_.settling; }

  State state() const { return {inner_.state(), running_, directions_}; }

  void write_configuration(ByteStream& writer, const ModelShape& of) const {
    const std::uint8_t method = 1;
    writer.values(&method, 1);
    inner_.write_configuration(writer, of);
    stream_fields(writer, of, options_);
  }

  /// May this saved state be taken over? See Rls::usable(); the running model must be stable.
  bool usable(const State& saved) const {
    const auto& running = saved.running;
    return Inner::usable(saved.recursion) && is_variance(saved.directions) &&
           all_squarable(capacity(kN), running.model) &&
           all_squarable(capacity(kNa), running.outputs) &&
           all_squarable(running.kOfGradient, running.psi) &&
           all_squarable(running.kOfOutputs, running.measured) &&
           all_squarable(capacity(kNa), running.filtered) && running.samples >= 0 &&
           running.samples <= options_.settling && running.filled >= 0 &&
           running.filled <= options_.settling && is_variance(running.recent) &&
           running.lost >= 0 && running.lost < options_.settling && running.doubts >= 0 &&
           running.doubts <= kMostDoubts && running.calm >= 0 && running.calm <= kCalm &&
           all_squarable(capacity(kNa), running.filter) && stable_filter(running.filter) &&
           stable(running.model);
  }

  /// Takes a saved state over. invalid_argument, and nothing changed, unless it is usable and of this size.
  Status restore(const State& saved) {
    if (!usable(saved) || inner_.restore(saved.recursion) != Status::ok) {
      return Status::invalid_argument;
    }
    running_ = saved.running;
    directions_ = saved.directions;
    return Status::ok;
  }

 private:
  // The poles of the running model are 0.999 times those of the estimate, so that an integrator, estimated a little outside
  // the unit circle, does not run away: a memory of 1000 samples.
  static constexpr Scalar kModelFading = Scalar(0.999);
  static constexpr Scalar kMostDifference = Scalar(0.25);
  static constexpr int kMostDirections = 1000;
  static constexpr int kMemory = 256;
  static constexpr int kLeastMemory = 16;

  /// One step with an instrument, the output and its prediction. As Rls::update(); no_information where the estimate rests.
  ///
  /// P^-1 weighs `weight` samples, so psi' P psi times the weight is the number of directions that the samples show: on
  /// average as many as there are parameters, one where the command is held. The estimate rests where the average falls
  /// below the geometric mean of both: an instrument in one direction says nothing of the others, whatever lambda is.
  Status learn(const Regressor& psi, Scalar y, Scalar predicted, Array<Scalar, kN>& variances) {
    if (!excited()) {
      return is_finite(y - predicted) ? rest(psi) : Status::numerical_limit;
    }
    const Status status = inner_.update(psi, y, predicted, variances);
    if (status == Status::ok) {
      // psi' K = psi' P psi / (lambda + psi' P psi)
      const typename Inner::State& state = inner_.state();
      const Scalar share = dot(size(), psi, state.gain);
      count_directions(share < Scalar(1) ? state.forgetting_factor * share / (Scalar(1) - share)
                                         : Scalar(kMostDirections));
    }
    return status;
  }

  /// Do the samples of late show more than one direction?
  bool excited() const { return directions_ >= least_directions(size()); }

  /// A sample from which nothing is learned.
  Status rest(const Regressor& psi) {
    Array<Scalar, kN> projected;
    const Scalar information = inner_.state().factors.project(psi, projected);
    if (!is_finite(information)) {
      return Status::numerical_limit;
    }
    count_directions(information);
    return Status::no_information;
  }

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

  Scalar estimated(int i) const { return inner_.state().theta[static_cast<std::size_t>(i)]; }

  // A glitch: an error ten times as large as its deviation. A wrong model makes such errors, too, but one behind the other:
  // the third without 50 good samples between them is not a glitch any more.
  static constexpr Scalar kGlitch = Scalar(100);
  static constexpr std::int32_t kMostDoubts = 2;
  static constexpr std::int32_t kCalm = 50;
  // Samples that sigma^2 has seen, as many times the parameters, before it can tell a glitch.
  static constexpr int kKnown = 10;
  // Errors a tenth of sigma^2: what was learned is of another signal.
  static constexpr Scalar kFallen = Scalar(10);
  static constexpr Scalar kRecentRate = Scalar(1) / Scalar(16);
  // Errors of 1e-5, and those of rounding, are never large: squares.
  static constexpr Scalar kSmall = Scalar(1e-10);
  static constexpr Scalar kRounding = Scalar(64) * std::numeric_limits<Scalar>::epsilon();

  /// One sample far off, of a sensor that dropped out, would stay in theta, and in the filters for hundreds of samples.
  bool is_glitch(const Regressor& psi, Scalar square, Scalar power) const {
    const auto& state = inner_.state();
    const Scalar most =
        kGlitch * (inner_.residual_variance() + kSmall + kRounding * kRounding * power);
    if (!(state.weight > Scalar(kKnown * size())) || !(square > most)) {
      return false;
    }
    // What theta does not know yet makes large errors, too.
    Array<Scalar, kN> projected;
    const Scalar factor = state.forgetting_factor;
    return square * factor > most * (factor + state.factors.project(psi, projected));
  }

  /// Has the instrument been misleading, or the error far below sigma^2, for as many samples as settling takes? Nothing
  /// is learned then, or hardly anything: P is that of another model, or of signals that were far larger.
  bool is_lost(bool wrong, Status status, Scalar square) {
    running_.recent += kRecentRate * (square - running_.recent);
    running_.calm += running_.calm < kCalm ? 1 : 0;
    running_.doubts = running_.calm < kCalm ? running_.doubts : 0;
    const bool fallen = inner_.state().weight > Scalar(kKnown * size()) &&
                        kFallen * (running_.recent + kSmall) < inner_.residual_variance();
    if (fallen || (wrong && excited())) {
      ++running_.lost;
    } else if (status == Status::ok) {
      running_.lost = 0;
    }
    return running_.lost >= options_.settling;
  }

  Status begin_anew() {
    inner_.reset(Scalar(0));
    settle();
    return Status::reset;
  }

  /// Is the instrument too far from the measured regressor? Both filtered; they differ in the first na entries.
  ///
  /// A step multiplies the error of theta by I - P psi phi_f' / alpha, which shrinks it where phi_f is psi and may not
  /// otherwise. With d = phi_f - psi, d' P d is small against 1 as long as d is of the size of what was learned from: it
  /// falls with the number of samples. It is not where the position goes on for long with the command held.
  bool misled(const Array<Scalar, kNa>& measured, const Regressor& psi) const {
    Regressor difference = Regressor::Zero(size());
    for (int i = 0; i < na(); ++i) {
      difference[i] = measured[static_cast<std::size_t>(i)] - psi[i];
    }
    Array<Scalar, kN> projected;
    return !(inner_.state().factors.project(difference, projected) < kMostDifference);
  }

  void settle() {
    directions_ = Scalar(kMostDirections);  // as at the start
    running_.samples = 0;
    running_.lost = running_.doubts = 0;
    running_.filled = 0;  // what the old filter kept of the noise would last long in the new one
    running_.filter = repeated_pole<kNa>(na(), options_.start_pole);
  }

  void push(const Regressor& psi, const Array<Scalar, kNa>& measured, Scalar filtered, int n,
            bool fresh) {
    for (int lag = na() - 1; lag >= 0; --lag) {
      const auto at = static_cast<std::size_t>(lag);
      Scalar* to = running_.psi.data() + lag * n;
      Scalar* outputs = running_.measured.data() + lag * na();
      for (int i = 0; i < n; ++i) {
        to[i] = lag == 0 ? psi[i] : fresh ? Scalar(0) : (to - n)[i];
      }
      for (int i = 0; i < na(); ++i) {
        outputs[i] = lag == 0 ? measured[static_cast<std::size_t>(i)]
                     : fresh  ? Scalar(0)
                              : (outputs - na())[i];
      }
      running_.filtered[at] = lag == 0 ? filtered : fresh ? Scalar(0) : running_.filtered[at - 1];
    }
  }

  /// Counts a sample and lets the running model follow the estimate. The last sample of settling is only counted
  /// once the estimate is a stable model.
  void advance() {
    const std::int32_t next = running_.samples + 1;
    if (next < options_.settling) {
      running_.samples = next;
    } else {
      const bool first = next == options_.settling;
      const bool followed = follow(first ? Scalar(1) : options_.model_rate, options_.model_rate);
      if ((followed || !first) && running_.samples < options_.settling) {
        running_.samples = next;
      }
    }
  }

  /// model <- model + rate (theta - model), and the same of the filter, where both are stable; false otherwise.
  bool follow(Scalar rate, Scalar filter_rate) {
    const int n = size();
    const int outputs = na();
    Array<Scalar, kN> model{};
    for (int i = 0; i < n; ++i) {
      const auto at = static_cast<std::size_t>(i);
      model[at] = rate < Scalar(1) ? running_.model[at] + rate * (estimated(i) - running_.model[at])
                                   : estimated(i);
    }
    Array<Scalar, kNa> filter = contracted<kNa>(outputs, model, options_.fading);
    for (int i = 0; i < outputs; ++i) {
      const auto at = static_cast<std::size_t>(i);
      filter[at] = running_.filter[at] + filter_rate * (filter[at] - running_.filter[at]);
    }
    if (!stable(model) || !stable_filter(filter)) {
      return false;
    }
    running_.model = model;
    running_.filter = filter;
    return true;
  }

  bool stable(const Array<Scalar, kN>& model) const {
    return stable_filter(contracted<kNa>(na(), model, kModelFading));
  }
  bool stable_filter(const Array<Scalar, kNa>& filter) const {
    return roots_inside_unit_circle<kNa>(na(), filter);
  }

  /// x(k) of the running model joins its history; while settling it is y(k).
  void run_model(const Regressor& z, Scalar y, bool settled) {
    Scalar x = y;
    if (settled) {
      const Array<Scalar, kNa> a = contracted<kNa>(na(), running_.model, kModelFading);
      x = Scalar(0);
      for (int i = 0; i < size(); ++i) {
        const auto at = static_cast<std::size_t>(i);
        x += z[i] * (i < na() ? a[at] : running_.model[at]);
      }
      x = is_squarable(x) ? x : y;
    }
    for (int i = na() - 1; i >= 0; --i) {
      const auto at = static_cast<std::size_t>(i);
      running_.outputs[at] = i == 0                 ? x
                             : running_.filled == 0 ? -z[i - 1]
                                                    : running_.outputs[at - 1];
    }
    running_.filled += running_.filled < options_.settling ? 1 : 0;
  }

  Inner inner_{};
  RunningModelState<Scalar, kNa, kN> running_{};
  /// Average of psi' P psi times the weight, over the weight in samples, at most kMemory.
  Scalar directions_ = Scalar(kMostDirections);
  Options options_{};
  Extent<kNa> past_outputs_{};
};

/// As ArxEstimator, for a noisy position sensor: recursive refined instrumental variables. Needs about 300 samples more
/// of excitation than least squares. Forgetting: Exponential with lambda0 = 0.995 where the plant stays as it is.
template <class Scalar, int kNa, int kNb, int kNk, class Forgetting = Exponential<Scalar>,
          bool kOffset = false>
using InstrumentalArxEstimator =
    OnlineEstimator<Arx<Scalar, kNa, kNb, kNk, kOffset>, Forgetting,
                    InstrumentalVariables<Scalar, kNa, kNa + kNb + (kOffset ? 1 : 0), Forgetting>>;

/// The same for a plant that integrates, as a servo does, with na poles beside the integrator: see integrating.hpp. It is
/// the one to take for a servo; kOffset lets the null of its valve be anywhere.
template <class Scalar, int kNa, int kNb, int kNk, class Forgetting = Exponential<Scalar>,
          bool kOffset = false>
using IntegratingArxEstimator =
    OnlineEstimator<Integrating<Arx<Scalar, kNa, kNb, kNk, kOffset>>, Forgetting,
                    InstrumentalVariables<Scalar, kNa, kNa + kNb + (kOffset ? 1 : 0), Forgetting>>;

}  // namespace ehsid
