// SPDX-License-Identifier: MIT
// Recursive least squares, Eqs. (12)-(14) of Ghazali et al. (2011), on UD factors.
//
//   (12) epsilon(k) = y(k) - phi'(k) theta(k-1)
//   (13) P(k) = (1/lambda) P(k-1) [I - phi phi' P(k-1) / (lambda + phi' P(k-1) phi)]
//   (14) theta(k) = theta(k-1) + P(k) phi(k) epsilon(k)
//
// Works for any linear regression y = phi' theta + e, not only for ARX. P is in units of the residual
// variance sigma^2. With the weights w of the samples, products of lambda, the covariance of theta is
// sigma^2 P sum(w^2) / sum(w): sigma^2 P where nothing is forgotten, about half of it where lambda is held below 1.
#pragma once

#include <ehsid/fields.hpp>
#include <ehsid/forgetting/evidence.hpp>
#include <ehsid/forgetting/settings.hpp>
#include <ehsid/groups.hpp>
#include <ehsid/information_account.hpp>
#include <ehsid/parts.hpp>
#include <ehsid/rls_options.hpp>
#include <ehsid/types.hpp>
#include <ehsid/ud.hpp>

#include <cmath>
#include <limits>
#include <type_traits>

namespace ehsid {

/// Everything the recursion changes. Plain data: copy it, store it, compare it.
template <class Scalar, int kN, class Forgetting, class Parts = AllParts>
struct RlsState {
  using Account = InformationAccount<Scalar, kN>;

  Array<Scalar, kN> theta;
  // What rounding took off theta so far, below its last digit.
  std::conditional_t<Parts::kCompensation, Array<Scalar, kN>, Nothing> remainder;
  UdFactors<Scalar, kN> factors;
  Forgetting forgetting;
  Array<Scalar, kN> gain;    // K(k) = P(k) phi(k) of the last kept step
  Scalar innovation;         // epsilon(k) of the last step that was not refused
  Scalar forgetting_factor;  // lambda of the last kept step
  Scalar square;             // epsilon^2 lambda / (lambda + phi' P phi) of the last kept step
  Scalar mean_square;        // weighted mean of `square`
  Scalar usual_square;       // the same, but it rises slowly: a changed plant is not noise
  Scalar weight;             // weight of both in samples, at most kWeightLimit
  Scalar weight_square;      // sum of the squares of these weights, at most as much
  Scalar recent_square;      // the same over about the last 16 steps, skipped ones included
  std::conditional_t<Parts::kInformation, Account, Nothing> account;

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&RlsState::theta, each_parameter);
    visit(&RlsState::remainder, each_parameter);
    visit(&RlsState::factors);
    visit(&RlsState::forgetting);
    visit(&RlsState::gain, each_parameter);
    visit(&RlsState::innovation);
    visit(&RlsState::forgetting_factor);
    visit(&RlsState::square);
    visit(&RlsState::mean_square);
    visit(&RlsState::usual_square);
    visit(&RlsState::weight);
    visit(&RlsState::weight_square);
    visit(&RlsState::recent_square);
    visit(&RlsState::account);
  }
};

/// Recursive least squares with a forgetting policy and guards.
///
/// Scalar: float or double. kN: number of parameters, >= 1, or up_to(most). Forgetting: see forgetting.hpp. Parts: see
/// parts.hpp.
/// update() is transactional: the whole step is computed, checked, and only then kept.
template <class Scalar_, int kN_, class Forgetting_, class Parts_ = AllParts>
class Rls {
 public:
  using Scalar = Scalar_;
  using Forgetting = Forgetting_;
  using Regressor = Vector<Scalar, kN_>;
  using Parameters = Vector<Scalar, kN_>;
  using Covariance = SquareMatrix<Scalar, kN_>;
  using Parts = Parts_;
  using State = RlsState<Scalar, kN_, Forgetting, Parts>;
  using Options = RlsOptions<Scalar>;

  static constexpr int kN = kN_;
  /// The regressor is all it needs, unlike that of instrumental_variables.hpp.
  static constexpr bool kFollowsModel = false;
  /// Start variance P0_ii where none is given: vague for regressors of order one.
  static constexpr Scalar kDefaultVariance = Scalar(1e6);

  static_assert(kN != 0, "Rls needs at least one parameter");
  static_assert(std::is_same<Scalar, float>::value || std::is_same<Scalar, double>::value,
                "Rls needs float or double");
  static_assert(detail::PolicyOf<Forgetting, Scalar>::kPolicy,
                "this is no forgetting policy: take one of ehsid/forgetting.hpp, such as "
                "ehsid::FRatio<float>, or a class with the members that are listed there");
  static_assert(detail::PolicyOf<Forgetting, Scalar>::kSameNumber,
                "the forgetting policy computes in another number than the estimator: "
                "ArxEstimator<float, ...> takes FRatio<float>, and so on");

  /// theta = 0, P0 = kDefaultVariance I. An invalid policy or option is replaced by its default; use
  /// start() and configure() where the status matters.
  Rls() : Rls(Forgetting{}) {}
  explicit Rls(const Forgetting& forgetting, const Options& options = Options{}) {
    if (configure(forgetting, options) != Status::ok) {
      static_cast<void>(configure(Forgetting{}, Options{}));
    }
    static_cast<void>(start(Parameters::Zero(capacity(kN)),
                            Parameters::Constant(capacity(kN), kDefaultVariance)));
  }

  /// Sets policy and guards; the estimate stays. invalid_argument leaves all as it was.
  Status configure(const Forgetting& forgetting, const Options& options) {
    if (!forgetting.valid() || !options.valid()) {
      return Status::invalid_argument;
    }
    state_.forgetting = forgetting;
    state_.forgetting.restart();
    options_ = options;
    return Status::ok;
  }

  /// Number of parameters: kN, or where that is up_to(most) the size of the last start.
  int size() const { return state_.factors.size(); }

  /// Starts from theta0, each is_squarable(), and P0 = diag(variances), variances > 0 in units of sigma^2. Each
  /// variance, n times it and the inverse of that must be normal numbers; invalid_argument, and nothing changed, otherwise.
  Status start(const Parameters& theta0, const Parameters& variances) {
    UdFactors<Scalar, kN> factors;
    return factors.set_diagonal(variances) ? begin(theta0, factors) : Status::invalid_argument;
  }

  /// Starts from theta0 and a full P0, symmetric positive definite, e.g. of an offline fit.
  Status start_from_covariance(const Parameters& theta0, const Covariance& p0) {
    UdFactors<Scalar, kN> factors;
    return factors.factorise(p0) ? begin(theta0, factors) : Status::invalid_argument;
  }

  /// Takes over an estimate made elsewhere, e.g. offline: theta, P = U D U' and sigma^2 (>= 0, 0 for unknown), of which
  /// theta and sigma^2 are squarable, see is_squarable().
  ///
  /// reset() and the ceiling keep to the P0 of start(): after a change of the plant what was known before no
  /// longer holds. Factors, because those of a fast-sampled plant have condition numbers that a float32 P
  /// does not hold. invalid_argument, and nothing changed, unless all are finite, P_ii too, and every D_ii > 0.
  Status seed(const Parameters& theta, const UdFactors<Scalar, kN>& factors,
              Scalar noise_variance) {
    if (!fits(theta) || !factors.usable() || factors.size() != size() ||
        !is_squared(noise_variance)) {
      return Status::invalid_argument;
    }
    begin_statistics(noise_variance);
    for (int i = 0; i < size(); ++i) {
      state_.theta[static_cast<std::size_t>(i)] = theta[i];
    }
    clear_remainder();
    state_.factors = factors;
    return Status::ok;
  }

  /// One sample: y = phi' theta + e.
  ///
  /// ok, no_information (kept on purpose, see RlsOptions), invalid_input or numerical_limit; on the
  /// last two nothing at all has changed.
  Status update(const Regressor& phi, Scalar y) { return update(phi, y, predict(phi)); }

  /// The same; where it returns ok, `variances` becomes all P_ii, as ConvergenceMonitor takes them.
  Status update(const Regressor& phi, Scalar y, Array<Scalar, kN>& variances) {
    return update(phi, y, predict(phi), variances);
  }

  /// The same with the prediction of y from elsewhere, finite, e.g. of a model that is not linear in theta; phi is then its
  /// gradient.
  EHSID_ALWAYS_INLINE Status update(const Regressor& phi, Scalar y, Scalar predicted) {
    Array<Scalar, kN> variances;
    return take<false>(phi, y, predicted, variances);
  }

  /// Both.
  EHSID_ALWAYS_INLINE Status update(const Regressor& phi, Scalar y, Scalar predicted,
                                    Array<Scalar, kN>& variances) {
    return take<true>(phi, y, predicted, variances);
  }

  /// lambda and P back to their start values, theta kept (Fig. 4). sigma^2 stays until new samples replace it.
  void reset() { reset(known_residual_variance()); }

  /// The same with sigma^2 from elsewhere (is_variance()), where the last errors are those of a change. It counts
  /// as much as two samples: without it the first deviations after a reset would be zero and look certain.
  void reset(Scalar noise_variance) {
    static_assert(Parts::kStart, "reset() needs the start values: have kStart among the parts");
    state_.factors = initial_.factors;
    begin_statistics(noise_variance);
  }

  /// lambda, P, theta and sigma^2 back to their start values.
  void reset_all() {
    static_assert(Parts::kStart, "reset_all() needs the start values: have kStart among the parts");
    state_.theta = initial_.theta;
    clear_remainder();
    reset(Scalar(0));
  }

  Parameters theta_hat() const { return to_vector<kN>(size(), state_.theta); }
  /// P(k), formed from the factors; parameter_variance() P is the covariance of theta_hat.
  Covariance P() const { return state_.factors.matrix(); }
  /// Did the samples of the last memory, up to the last kept one, bring too little about some parameter? Then nothing is
  /// forgotten, and after a while samples that tell nothing are left out.
  bool starved() const {
    if constexpr (Parts::kInformation) {
      return state_.account.waits();
    } else {
      return false;
    }
  }
  Regressor gain() const { return to_vector<kN>(size(), state_.gain); }
  Scalar innovation() const { return state_.innovation; }
  Scalar forgetting_factor() const { return state_.forgetting_factor; }
  /// epsilon^2 lambda / (lambda + phi' P phi) of the last kept step: its mean is sigma^2, converged or not.
  Scalar normalised_square() const { return state_.square; }

  /// phi' theta_hat.
  Scalar predict(const Regressor& phi) const {
    return dot(count_of<kN>(size()), phi, state_.theta);
  }

  /// sigma^2 from the weighted residuals, with the degrees of freedom of kN parameters taken off; 0 before any sample,
  /// and of no use before more than kN.
  Scalar residual_variance() const { return with_freedom(state_.mean_square); }

  /// What P is multiplied by to be the covariance of theta_hat: sigma^2 sum(w^2) / sum(w), see the top of this file.
  Scalar parameter_variance() const { return residual_variance() * weight_share(); }

  /// sqrt(parameter_variance() P_ii); always finite.
  Parameters standard_deviation() const {
    const int n = size();
    Parameters deviation(n);
    const Scalar variance = parameter_variance();
    for (int i = 0; i < n; ++i) {
      const Scalar square = variance * state_.factors.variance(i);
      deviation[i] = is_finite(square)
                         ? std::sqrt(square)
                         : std::sqrt(variance) * std::sqrt(state_.factors.variance(i));
    }
    return deviation;
  }

  /// theta0, where reset_all() goes back to.
  Parameters start_theta() const { return to_vector<kN>(size(), initial_.theta); }

  const State& state() const { return state_; }

  /// Writes what a start gave and a step does not change: settings, guards, and the factors that a reset returns to.
  void write_configuration(ByteStream& writer, const ModelShape& of) const {
    write_layout<Forgetting>(writer, of);
    write_settings(writer, state_.forgetting);
    stream_fields(writer, of, options_);
    if constexpr (Parts::kStart) {
      stream_fields(writer, of, initial_.factors);
    } else {
      writer.values(ceiling_weight_.data(), size());
    }
  }

  /// May this saved state be taken over? Every number is one that a recursion can reach, or not far beyond it, so that
  /// what is made of them is finite, now and later.
  static bool usable(const State& saved) {
    const int n = saved.factors.size();
    return saved.factors.usable() && all_squarable(n, saved.theta) && usable_remainder(saved) &&
           saved.forgetting.valid() && all_finite(n, saved.gain) && is_finite(saved.innovation) &&
           is_forgetting_factor(saved.forgetting_factor) && is_squared(saved.square) &&
           is_variance(saved.mean_square) && is_variance(saved.usual_square) &&
           saved.weight >= Scalar(0) && saved.weight <= kWeightLimit &&
           saved.weight_square >= Scalar(0) && saved.weight_square <= saved.weight &&
           is_variance(saved.recent_square) && usable_account(saved);
  }

  /// Takes a saved state over. invalid_argument, and nothing changed, unless it is usable and of this size.
  Status restore(const State& saved) {
    if (!usable(saved) || saved.factors.size() != size()) {
      return Status::invalid_argument;
    }
    state_ = saved;
    return Status::ok;
  }

 private:
  template <class, class>
  friend class bank::Recursions;

  // Above this weight a float can no longer count samples one by one; the mean square then becomes
  // an exponential average over that many samples.
  static constexpr Scalar kWeightLimit = Scalar(1e6);
  // Errors count as surprising where their recent mean square is four times the residual variance:
  // twice the RMSE, for a mean of about 16 squares (standard deviation 0.25) twelve deviations up.
  static constexpr Scalar kRecentRate = Scalar(1) / Scalar(16);
  static constexpr Scalar kSurprise = Scalar(4);
  // Errors count as fallen where their recent mean square is a tenth of the residual variance.
  static constexpr Scalar kFallen = Scalar(10);
  // A model predicts where its errors are below 1 % of the output, and does not where they are above 17 %.
  static constexpr Scalar kPredicted = Scalar(1e-4);
  static constexpr Scalar kUnpredicted = Scalar(0.03);
  // Least phi' P0 phi of a regressor that is not only noise, and of one of full size: with the default P0 = 1e6 half a
  // percent of full scale, and 1.4 times that.
  static constexpr Scalar kNoise = Scalar(25);
  static constexpr Scalar kFullSize = Scalar(2e6);
  // The usual square rises by a sixteenth in a step, or by as much as a square 25 times as large adds: a larger noise is
  // still followed, twice the variance in 11 steps.
  static constexpr Scalar kMostRise = Scalar(1) / Scalar(16);
  static constexpr Scalar kMostSquare = Scalar(24);
  // Rounding of phi' theta: not a surprise, however small the noise.
  static constexpr Scalar kRounding = Scalar(64) * std::numeric_limits<Scalar>::epsilon();

  /// A sample and what it says, before anything is computed from it.
  struct Step {
    Evidence<Scalar> evidence;
    ForgettingFactors<Scalar> lambda;
    Scalar square;  // normalised, as are the recent ones
    Scalar recent;
    Scalar power;  // of the signals, scale of the errors
    bool frozen;   // nothing is forgotten
    typename State::Account::Waiting waiting;
  };

  /// What follows of a step, until it is kept.
  struct Update {
    Array<Scalar, kN> gain;  // U' phi of judge(), K(k) = P(k) phi(k) of measure()
    UdFactors<Scalar, kN> factors;
    Array<Scalar, kN> theta;
    decltype(State::remainder) remainder;
    Scalar alpha;
    bool limited;  // P has come to its ceiling
  };

  /// kTells: does somebody read the variances?
  template <bool kTells>
  EHSID_ALWAYS_INLINE Status take(const Regressor& phi, Scalar y, Scalar predicted,
                                  Array<Scalar, kN>& variances) {
    Step step;
    Update next;
    const Status judged = judge(phi, y, predicted, step, next.gain);
    if (judged != Status::ok) {
      return judged;
    }
    forget(step);
    variances = {};  // gcc does not see that measure() writes them all
    if (!measure(step, next, variances)) {
      return Status::numerical_limit;
    }
    keep(step, next, variances);
    if constexpr (kTells) {
      if (next.limited) {
        state_.factors.variances(variances);
      }
    }
    return Status::ok;
  }

  /// Innovation of Eq. (12), and whether the sample is one to learn from.
  EHSID_ALWAYS_INLINE Status judge(const Regressor& phi, Scalar y, Scalar predicted, Step& step,
                                   Array<Scalar, kN>& gain) {
    const int n = size();
    const Scalar innovation = y - predicted;  // (12)
    const Scalar s = state_.factors.project(phi, gain);
    step.evidence = {innovation, s};
    step.lambda = state_.forgetting.peek(step.evidence);
    step.square = normalise(innovation, step.lambda.before, s);
    if (!is_squarable(step.square) || !is_finite(s)) {
      // NaN or Inf at the input ends up here, too: in phi it makes s so, in y the square
      return is_finite(y) && all_finite(n, phi) ? Status::numerical_limit : Status::invalid_input;
    }
    if constexpr (!Parts::kInformation) {
      step.power = Scalar(0);  // of no use then
      if (uninformative(s, false)) {
        state_.innovation = innovation;
        return Status::no_information;
      }
      return Status::ok;
    } else {
      return judge_information(phi, y, predicted, step);
    }
  }

  /// Is some parameter starving, and is this a sample to leave out?
  EHSID_ALWAYS_INLINE Status judge_information(const Regressor& phi, Scalar y, Scalar predicted,
                                               Step& step) {
    const int n = size();
    const Scalar s = step.evidence.regressor_variance;
    step.recent = state_.recent_square + kRecentRate * (step.square - state_.recent_square);
    step.power = y * y + predicted * predicted;
    const bool starving = information_margin() > Scalar(0) && state_.account.starving(n);
    step.frozen = starving && !surprising(step.recent, step.power);
    if (uninformative(s, step.frozen && state_.account.out_of_patience())) {
      const Scalar start = variance_at_start(phi);
      if (!overdue(step.recent, step.power, start)) {
        state_.innovation = step.evidence.innovation;
        state_.recent_square = step.recent;
        state_.account.lose(size(), loss());
        lower_residual_variance(s, step.recent, step.power, start);
        return Status::no_information;
      }
      step.frozen = false;
    }
    return Status::ok;
  }

  /// Postpones the forgetting while too little comes in, and makes up for it afterwards.
  EHSID_ALWAYS_INLINE void forget(Step& step) const {
    if constexpr (Parts::kInformation) {
      wait(step);
    }
  }

  EHSID_ALWAYS_INLINE void wait(Step& step) const {
    const bool changed = step.frozen || state_.account.waits();
    step.waiting = step.frozen ? state_.account.postpone(step.lambda, loss())
                               : state_.account.make_up(step.lambda);
    if (changed) {
      step.square =
          normalise(step.evidence.innovation, step.lambda.before, step.evidence.regressor_variance);
    }
  }

  /// Eqs. (13) and (14). False where a number of the result is not usable.
  EHSID_ALWAYS_INLINE bool measure(const Step& step, Update& next,
                                   Array<Scalar, kN>& variances) const {
    // (13)
    const Scalar shrink = step.lambda.before * step.lambda.after;
    next.alpha =
        next.factors.measure(state_.factors, next.gain, step.lambda.before, shrink, variances);
    bool good = limit(next, variances) && is_squarable(step.square);
    // (14), as a compensated sum: at large k the steps fall below the last digit of a float32 theta, and
    // with a held regressor their rounding has a direction, so theta would drift without end.
    const Scalar innovation = step.evidence.innovation;
    const Scalar alpha = next.alpha;
    in_groups<Scalar>(count_of<kN>(size()), [&](const auto group) EHSID_INLINE_LAMBDA {
      const auto before = group.load(state_.theta.data());
      const auto k = group.gather(next.gain.data()) / alpha;
      const auto d = group.gather(next.factors.d.data());
      if constexpr (Parts::kCompensation) {
        const auto increment = k * innovation + group.load(state_.remainder.data());
        const auto after = before + increment;
        const auto added = after - before;
        const auto rounded = (before - (after - added)) + (increment - added);
        good = group.usable(after, rounded, d) && good;
        group.store(after, next.theta.data());
        group.store(rounded, next.remainder.data());
      } else {
        const auto after = before + k * innovation;
        good = group.usable(after, after, d) && good;
        group.store(after, next.theta.data());
      }
      group.scatter(k, next.gain.data());
    });
    return good;
  }

  EHSID_ALWAYS_INLINE void keep(const Step& step, const Update& next,
                                const Array<Scalar, kN>& variances) {
    const int n = size();
    const Scalar shrink = step.lambda.before * step.lambda.after;
    keep_numbers<kN>(n, next.theta, state_.theta);
    if constexpr (Parts::kCompensation) {
      keep_numbers<kN>(n, next.remainder, state_.remainder);
    }
    state_.factors.keep(next.factors);
    keep_numbers<kN>(n, next.gain, state_.gain);
    state_.innovation = step.evidence.innovation;
    state_.forgetting_factor = shrink;
    state_.square = step.square;
    if constexpr (Parts::kInformation) {
      state_.recent_square = step.recent;
      state_.account.waiting = step.waiting;
      gain_information(variances, next.alpha, shrink);
    }
    state_.forgetting.accept(step.evidence);
    accumulate(step.square, step.lambda, step.power);
  }

  /// Innovation a priori times residual a posteriori: variance sigma^2 whatever P still is.
  static Scalar normalise(Scalar innovation, Scalar lambda, Scalar s) {
    return innovation * innovation * (lambda / (lambda + s));
  }

  bool fits(const Parameters& theta) const {
    return theta.size() == size() && all_squarable(size(), theta);
  }

  static bool is_squared(Scalar value) { return is_squarable(value) && value >= Scalar(0); }

  Status begin(const Parameters& theta0, const UdFactors<Scalar, kN>& factors) {
    const int n = factors.size();
    Array<Scalar, kN> weights{};
    bool good = theta0.size() == n && all_squarable(n, theta0) && factors.usable();
    for (int i = 0; i < n; ++i) {
      const auto at = static_cast<std::size_t>(i);
      weights[at] = Scalar(1) / (Scalar(n) * factors.variance(i));
      good = is_normal_positive(weights[at]) && good;
    }
    if (!good) {
      return Status::invalid_argument;
    }
    for (int i = 0; i < n; ++i) {
      state_.theta[static_cast<std::size_t>(i)] = theta0[i];
    }
    state_.factors = factors;
    ceiling_weight_ = weights;
    clear_remainder();
    begin_statistics(Scalar(0));
    if constexpr (Parts::kStart) {
      initial_ = {state_.theta, factors};
    }
    return Status::ok;
  }

  /// As after no sample, but for sigma^2 where it is known.
  void begin_statistics(Scalar noise_variance) {
    restart_statistics();
    if (noise_variance > Scalar(0)) {
      state_.weight = Scalar(size() + 2);
      state_.weight_square = state_.weight;
      state_.mean_square = noise_variance * Scalar(2) / Scalar(size() + 2);
      state_.usual_square = state_.mean_square;
    }
  }

  void clear_remainder() {
    if constexpr (Parts::kCompensation) {
      state_.remainder.fill(Scalar(0));
    }
  }

  static bool usable_remainder(const State& saved) {
    if constexpr (Parts::kCompensation) {
      return all_finite(saved.factors.size(), saved.remainder);
    } else {
      return true;
    }
  }

  static bool usable_account(const State& saved) {
    if constexpr (Parts::kInformation) {
      return saved.account.usable(saved.factors.size());
    } else {
      return true;
    }
  }

  void restart_statistics() {
    state_.forgetting.restart();
    state_.gain.fill(Scalar(0));
    state_.innovation = Scalar(0);
    state_.forgetting_factor = Scalar(1);
    state_.square = Scalar(0);
    state_.mean_square = Scalar(0);
    state_.usual_square = Scalar(0);
    state_.weight = Scalar(0);
    state_.weight_square = Scalar(0);
    state_.recent_square = Scalar(0);
    if constexpr (Parts::kInformation) {
      state_.account.restart();
    }
  }

  /// sum(w^2) / sum(w) of the weights; 1 before any sample.
  EHSID_ALWAYS_INLINE Scalar weight_share() const {
    return state_.weight > Scalar(0) ? state_.weight_square / state_.weight : Scalar(1);
  }

  /// A mean of weighted squares, with the degrees of freedom taken off: kN parameters take off kN sum(w^2) / sum(w).
  EHSID_ALWAYS_INLINE Scalar with_freedom(Scalar mean) const {
    const Scalar freedom = state_.weight - Scalar(size()) * weight_share();
    return mean * state_.weight / (freedom > Scalar(1) ? freedom : Scalar(1));
  }

  /// residual_variance() once there are enough samples for it to mean something, else 0.
  EHSID_ALWAYS_INLINE Scalar known_residual_variance() const {
    return state_.weight > Scalar(size() + 1) ? residual_variance() : Scalar(0);
  }

  bool surprising(Scalar recent, Scalar power) const {
    return state_.weight <= Scalar(size() + 1) ||
           recent > kSurprise * with_freedom(state_.usual_square) + kRounding * kRounding * power;
  }

  /// Information that is forgotten in a step, as a share of what there is. Where the policy forgets nothing, the share of
  /// one sample among all: what came long ago says nothing on the excitation of now. With fewer than twice as many samples
  /// as parameters nobody can tell.
  EHSID_ALWAYS_INLINE Scalar loss() const {
    const Scalar forgotten = state_.forgetting.loss();
    const Scalar fresh = Scalar(1) / (state_.weight + Scalar(2 * size()));
    return forgotten > fresh ? forgotten : fresh;
  }

  /// The last step left P_ii = variances[i]; its measurement took (P phi)_i^2 / alpha off.
  EHSID_ALWAYS_INLINE void gain_information(const Array<Scalar, kN>& variances, Scalar alpha,
                                            Scalar shrink) {
    state_.account.gain(
        size(),
        [&](const auto group)
            EHSID_INLINE_LAMBDA { return group.gather(variances.data()) * shrink; },
        [&](const auto group) EHSID_INLINE_LAMBDA {
          const auto gain = group.load(state_.gain.data());
          return gain * gain * alpha;
        },
        loss());
  }

  bool uninformative(Scalar s, bool idle) const {
    if (!(s > Scalar(0)) && options_.information_margin != Scalar(0)) {
      return true;  // phi = 0: forgetting without measuring would be all that is left
    }
    return idle && s < information_margin() * loss();
  }

  /// Must a sample without information be taken all the same? After samples far larger than those of now all of these
  /// seem to carry none, and the estimate would rest for ever. So a regressor of full size is taken where the model does
  /// not predict the output, for it is wrong then whatever sigma^2 is, and where P_ii of some parameter is smaller than
  /// full excitation by such regressors would leave it: until it is as large, forgetting cannot wind it up.
  bool overdue(Scalar recent, Scalar power, Scalar start) const {
    return start > kFullSize && (recent > kUnpredicted * power ||
                                 least_variance() * start < information_margin() * loss());
  }

  /// The least P_ii / P0_ii.
  Scalar least_variance() const {
    Scalar least = std::numeric_limits<Scalar>::max();
    for (int i = 0; i < size(); ++i) {
      const Scalar share = state_.factors.variance(i) * Scalar(size()) *
                           ceiling_weight_[static_cast<std::size_t>(i)];
      least = share < least ? share : least;
    }
    return least;
  }

  /// Of a sample that is left out: follows errors that have become far smaller than sigma^2.
  ///
  /// sigma^2 is the unit of P, and what was learned from samples with larger errors counts less against those of now:
  /// sigma^2 <- sigma^2 / f, P <- f P. The covariance of theta, sigma^2 P, stays as it was. f = sigma^2 / recent where the
  /// model does not predict the output. Where it does, f is at most what makes the sample informative, and 1 where it
  /// carries what is forgotten in one direction: in a position hold the errors of many a rig vanish, but what was
  /// learned stays true. Nothing is done for a regressor that P0 hardly notices, only noise in a hold at zero.
  void lower_residual_variance(Scalar s, Scalar recent, Scalar power, Scalar start) {
    const Scalar known = known_residual_variance();
    const Scalar lost = loss();
    const Scalar wanted = information_margin() * lost;
    const bool predicted = recent < kPredicted * power;
    if (!(recent * kFallen < known) || !(start > kNoise) || !(s < (predicted ? lost : wanted))) {
      return;
    }
    const Scalar needed = wanted / s;
    const Scalar room =
        options_.covariance_ceiling / state_.factors.weighted_trace(ceiling_weight_);
    Scalar factor = known / recent;
    factor = predicted && needed < factor ? needed : factor;
    factor = room < factor ? room : factor;
    // A ceiling far above 1 does not keep P finite.
    bool good = factor > Scalar(1);
    for (int i = 0; i < size(); ++i) {
      good = good && is_finite(factor * state_.factors.variance(i));
    }
    if (good) {
      state_.factors.scale(factor);
      state_.mean_square /= factor;
      state_.usual_square /= factor;
    }
  }

  /// phi' P0 phi, with the diagonal of P0: how large a regressor is, whatever its units.
  Scalar variance_at_start(const Regressor& phi) const {
    Scalar sum(0);
    for (int i = 0; i < size(); ++i) {
      sum += phi[i] * phi[i] / (Scalar(size()) * ceiling_weight_[static_cast<std::size_t>(i)]);
    }
    return sum;
  }

  Scalar information_margin() const {
    if (options_.information_margin >= Scalar(0)) {
      return options_.information_margin;
    }
    return size() > 1 ? std::sqrt(Scalar(size())) : Scalar(0);
  }

  /// Backstop: scales P down to the ceiling. P(k) stays above what the measurement alone leaves: without forgetting P
  /// cannot have passed the ceiling. False where P_ii or, every d > 0, a factor is not finite: the mean then is not.
  EHSID_ALWAYS_INLINE bool limit(Update& next, const Array<Scalar, kN>& variances) const {
    const Scalar mean = dot(count_of<kN>(size()), variances, ceiling_weight_);
    next.limited = mean > options_.covariance_ceiling;
    if (next.limited) {
      next.factors.scale(options_.covariance_ceiling / mean);
    }
    return is_finite(mean);
  }

  EHSID_ALWAYS_INLINE void raise_usual_square(Scalar square, Scalar share, Scalar power) {
    Scalar rise = (square - state_.usual_square) * share;
    if (state_.weight > Scalar(size() + 1)) {
      const Scalar outlier = kMostSquare * share;
      const Scalar most = (state_.usual_square + kRounding * kRounding * power) *
                          (outlier > kMostRise ? outlier : kMostRise);
      rise = rise < most ? rise : most;
    }
    state_.usual_square += rise;
  }

  /// Recursion of the weighted residual sum of squares, as a mean so that it cannot overflow.
  void accumulate(Scalar square, const ForgettingFactors<Scalar>& lambda, Scalar power) {
    const Scalar samples = lambda.before * state_.weight + Scalar(1);
    const Scalar share = Scalar(1) / samples;
    state_.mean_square += (square - state_.mean_square) * share;
    if constexpr (Parts::kInformation) {
      raise_usual_square(square, share, power);
    }
    const Scalar weight = lambda.after * samples;
    state_.weight = weight < kWeightLimit ? weight : kWeightLimit;
    const Scalar squares = lambda.before * lambda.before * state_.weight_square + Scalar(1);
    const Scalar weight_square = lambda.after * lambda.after * squares;
    // Rounding and the limit must not make it larger than the sum of weights, which are at most 1.
    state_.weight_square = weight_square < state_.weight ? weight_square : state_.weight;
  }

  State state_{};
  Options options_{};
  struct Start {
    Array<Scalar, kN> theta;
    UdFactors<Scalar, kN> factors;
  };
  std::conditional_t<Parts::kStart, Start, Nothing> initial_{};
  Array<Scalar, kN> ceiling_weight_{};
};

}  // namespace ehsid
