// SPDX-License-Identifier: MIT
// Rls::update of as many estimators as a register has lanes: the same operations in the same order in each lane, with a
// mask in place of each branch. What only a lane in a hold needs is left out where no lane is in one.
#pragma once

#include <ehsid/bank/fields.hpp>
#include <ehsid/bank/lanes.hpp>
#include <ehsid/bank/policies.hpp>
#include <ehsid/reset.hpp>
#include <ehsid/rls.hpp>

namespace ehsid::bank {

/// The recursions of V::kWidth estimators of the type `Recursion`, an Rls. Plain data of whole registers.
template <class Recursion, class V>
class Recursions {
 public:
  using Scalar = typename Recursion::Scalar;
  using Truth = typename V::Truth;
  using Count = Lanes<Whole<Scalar>, V::kWidth>;
  static constexpr int kN = Recursion::kN;
  static constexpr int kWidth = V::kWidth;
  using Regressors = Array<V, kN>;
  using Factors = UdFactors<V, kN>;
  using Policy = PolicyOver<typename Recursion::Forgetting, V>;
  /// Is there a form of its own for ordinary samples? Where sizes are chosen at run time, it takes longer to compile than
  /// is worth it.
  static constexpr bool kTriesOrdinary = kN > 0;

  /// Takes over settings and state of one recursion: of the same type, or with as many parameters, chosen at run time.
  template <class One>
  void set(int lane, const One& one) {
    const auto& state = one.state();
    initial_factors_.resize(one.size());
    for (Numbers& now : numbers_) {  // both: what lies behind n stays as it is
      now.factors.resize(one.size());
      set_array(now.theta, lane, state.theta);
      set_array(now.remainder, lane, state.remainder);
      set_factors(now.factors, lane, state.factors);
      set_array(now.gain, lane, state.gain);
      now.innovation.set(lane, state.innovation);
      now.forgetting_factor.set(lane, state.forgetting_factor);
      now.square.set(lane, state.square);
      now.mean_square.set(lane, state.mean_square);
      now.usual_square.set(lane, state.usual_square);
      now.weight.set(lane, state.weight);
      now.weight_square.set(lane, state.weight_square);
      now.recent_square.set(lane, state.recent_square);
      set_array(now.regained, lane, state.account.regained);
      now.postponed.set(lane, state.account.waiting.postponed);
      now.waited.set(lane, state.account.waiting.waited);
    }
    ordinary_ = false;
    set_policy(forgetting_, lane, state.forgetting);
    margin_.set(lane, one.information_margin());
    given_margin_.set(lane, one.options_.information_margin);
    ceiling_.set(lane, one.options_.covariance_ceiling);
    set_factors(initial_factors_, lane, one.initial_.factors);
    set_array(ceiling_weight_, lane, one.ceiling_weight_);
  }

  /// Writes the state of one lane to `one`, which has its settings.
  void get(int lane, Recursion& one) const { get_state(lane, one.state_); }
  /// The state of one lane.
  template <class State>
  void get_state(int lane, State& state) const {
    get_array(now().theta, lane, state.theta);
    get_array(now().remainder, lane, state.remainder);
    get_array(now().factors.d, lane, state.factors.d);
    get_array(now().factors.u, lane, state.factors.u);
    get_policy(forgetting_, lane, state.forgetting);
    get_array(now().gain, lane, state.gain);
    state.innovation = now().innovation[lane];
    state.forgetting_factor = now().forgetting_factor[lane];
    state.square = now().square[lane];
    state.mean_square = now().mean_square[lane];
    state.usual_square = now().usual_square[lane];
    state.weight = now().weight[lane];
    state.weight_square = now().weight_square[lane];
    state.recent_square = now().recent_square[lane];
    get_array(now().regained, lane, state.account.regained);
    state.account.waiting = {now().postponed[lane], now().waited[lane]};
  }

  EHSID_ALWAYS_INLINE int size() const { return initial_factors_.size(); }

  /// One sample of each lane of `wanted`; the others stay as they are. Returns the Status of each lane as a number,
  /// Status::disabled for those that are not wanted.
  EHSID_ALWAYS_INLINE Count update(const Truth& wanted, const Regressors& phi, const V& y) {
    if constexpr (kTriesOrdinary) {
      if (all(wanted) && update_ordinary(phi, y)) {
        return Count(code(Status::ok));
      }
    }
    return update_any(wanted, phi, y);
  }

  /// One sample of every lane, if it is an ordinary one for each of them: see take(). False: nothing has changed, and
  /// update_any() must do it. It is not tried where the sample before was not an ordinary one.
  EHSID_ALWAYS_INLINE bool update_ordinary(const Regressors& phi, const V& y) {
    Count status;
    return ordinary_ && take<true>(Truth(true), phi, y, status);
  }

  /// update() of any sample.
  EHSID_ALWAYS_INLINE Count update_any(const Truth& wanted, const Regressors& phi, const V& y) {
    Count status;
    ordinary_ = take<false>(wanted, phi, y, status);
    return status;
  }

  /// As Rls::reset(noise_variance), where the mask is true.
  EHSID_ALWAYS_INLINE void reset(const Truth& where, const V& noise_variance) {
    Numbers& old = numbers_[now_];
    const V zero(0);
    const V one(1);
    ordinary_ = false;
    choose(where, initial_factors_, old.factors);
    forgetting_.restart(where);
    const Truth known = noise_variance > zero;
    const V weight(Scalar(size() + 2));
    const V mean = noise_variance * V(2) / weight;
    for (std::size_t i = 0; i < old.gain.size(); ++i) {
      old.gain[i] = select(where, zero, old.gain[i]);
      old.regained[i] = select(where, one, old.regained[i]);
    }
    old.innovation = select(where, zero, old.innovation);
    old.forgetting_factor = select(where, one, old.forgetting_factor);
    old.square = select(where, zero, old.square);
    old.mean_square = select(where, select(known, mean, zero), old.mean_square);
    old.usual_square = select(where, select(known, mean, zero), old.usual_square);
    old.weight = select(where, select(known, weight, zero), old.weight);
    old.weight_square = select(where, select(known, weight, zero), old.weight_square);
    old.recent_square = select(where, zero, old.recent_square);
    old.postponed = select(where, one, old.postponed);
    old.waited = select(where, one, old.waited);
  }

  EHSID_ALWAYS_INLINE V residual_variance() const { return with_freedom(now(), now().mean_square); }
  EHSID_ALWAYS_INLINE V parameter_variance() const {
    return residual_variance() * weight_share(now());
  }
  EHSID_ALWAYS_INLINE Truth starved() const { return now().waited < V(1); }
  EHSID_ALWAYS_INLINE const Regressors& theta() const { return now().theta; }
  EHSID_ALWAYS_INLINE const Factors& factors() const { return now().factors; }
  /// All P_ii. Where the last sample was an ordinary one, it left them behind.
  EHSID_ALWAYS_INLINE void variances(Regressors& to) const {
    if (kTriesOrdinary && ordinary_) {
      to = variances_;
    } else {
      factors().variances(to);
    }
  }
  EHSID_ALWAYS_INLINE const V& weight() const { return now().weight; }
  EHSID_ALWAYS_INLINE const V& innovation() const { return now().innovation; }
  EHSID_ALWAYS_INLINE const V& forgetting_factor() const { return now().forgetting_factor; }
  EHSID_ALWAYS_INLINE const V& normalised_square() const { return now().square; }
  EHSID_ALWAYS_INLINE const V& mean_square() const { return now().mean_square; }
  /// As OnlineEstimator::keeps().
  EHSID_ALWAYS_INLINE Truth keeps() const {
    if constexpr (Recursion::Forgetting::kFollowsErrors) {
      return Truth(false);
    } else {
      return forgetting_.loss() < V(RmseReset<Scalar>::kForgets);
    }
  }
  /// phi' K, of the last kept step.
  EHSID_ALWAYS_INLINE V leverage(const Regressors& phi) const {
    V sum = phi[0] * now().gain[0];
    for (int i = 1; i < size(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      sum += phi[at] * now().gain[at];
    }
    return sum;
  }

 private:
  using Account = InformationAccount<Scalar, kN>;

  /// What a sample changes.
  struct Numbers {
    Regressors theta;
    Regressors remainder;
    Factors factors;
    Regressors gain;
    V innovation;
    V forgetting_factor;
    V square;
    V mean_square;
    V usual_square;
    V weight;
    V weight_square;
    V recent_square;
    Regressors regained;
    V postponed;
    V waited;
  };

  EHSID_ALWAYS_INLINE const Numbers& now() const { return numbers_[now_]; }

  /// One sample, computed from numbers_[now_] into the other one, which takes its place where it is right.
  ///
  /// An ordinary sample is one that every lane takes as it is: wanted and accepted, with no guard, no hold and nothing
  /// postponed. Almost all of them are.
  /// kOrdinary: supposes that it is one, without a single choice on the way. Where it is not, returns false, and nothing
  /// has changed.
  /// Else: does what each lane needs, and returns whether the sample was an ordinary one.
  template <bool kOrdinary>
  EHSID_ALWAYS_INLINE bool take(const Truth& wanted, const Regressors& phi, const V& y,
                                Count& status) {
    Numbers& old = numbers_[now_];
    Numbers& next = numbers_[1 - now_];
    Truth extraordinary = ~wanted;
    // Notes that something extraordinary occurs; true: it must be dealt with here.
    const auto occurs = [&](const Truth& something) EHSID_INLINE_LAMBDA {
      extraordinary = extraordinary | something;
      return !kOrdinary && any(something);
    };

    Regressors gain;
    Step step = judge(old, phi, y, gain);
    Truth taken = wanted & is_squarable(step.square) & is_finite(step.evidence.regressor_variance);
    if constexpr (!kOrdinary) {
      status = select(wanted, Count(code(Status::ok)), Count(code(Status::disabled)));
    }
    if (occurs(wanted & ~taken)) {
      refuse(wanted & ~taken, phi, y, status);
    }
    const Truth waits = old.waited < V(1);
    const V before = step.lambda.before * old.postponed;
    if (occurs(taken & (starving(old) | waits | dull(step)))) {
      forget(old, phi, before, waits, step, taken, status);
      if (!any(taken)) {
        return false;
      }
    } else {
      step.lambda.before = before;
    }

    const Measured measured = measure(old, step, gain, next);
    if (occurs(taken & measured.over)) {
      next.factors.scale(select(measured.over, ceiling_ / measured.mean, V(1)));
    }
    const Truth good = correct(old, step, measured, gain, next);
    const Truth kept = taken & good;
    if (occurs(taken & ~good)) {
      status = select(taken & ~good, Count(code(Status::numerical_limit)), status);
    }
    const bool ordinary = !any(extraordinary);
    if (kOrdinary && !ordinary) {
      return false;
    }
    keep<kOrdinary>(kept, old, step, measured, gain, next);
    forgetting_.accept(step.evidence, kept);
    now_ = 1 - now_;
    return ordinary;
  }

  /// As Rls::Step.
  struct Step {
    Evidence<V> evidence;
    ForgettingFactors<V> lambda;
    V square;
    V recent;
    V power;
    V postponed;
    V waited;
  };

  /// What Eq. (13) gives beside the factors.
  struct Measured {
    V shrink;
    V alpha;
    V mean;      // weighted mean of the variances, which has a ceiling
    Truth over;  // it is above it
  };

  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

  /// Eq. (12), and what the sample says; gain: U' phi.
  EHSID_ALWAYS_INLINE Step judge(const Numbers& old, const Regressors& phi, const V& y,
                                 Regressors& gain) const {
    const int n = size();
    V predicted = phi[0] * old.theta[0];
    EHSID_UNROLL
    for (int i = 1; i < n; ++i) {
      predicted += phi[at(i)] * old.theta[at(i)];
    }
    const V innovation = y - predicted;
    const V s = old.factors.project(phi, gain);
    const Evidence<V> evidence{innovation, s};
    const ForgettingFactors<V> lambda = forgetting_.peek(evidence);
    const V square = normalise(innovation, lambda.before, s);
    const V recent = old.recent_square + V(Recursion::kRecentRate) * (square - old.recent_square);
    return {evidence, lambda, square, recent, y * y + predicted * predicted, V(1), V(1)};
  }

  /// Says why a sample is not taken.
  EHSID_ALWAYS_INLINE void refuse(const Truth& refused, const Regressors& phi, const V& y,
                                  Count& status) const {
    const int n = size();
    Extreme<Scalar, V::kWidth> inputs;
    inputs.size_of(y);
    EHSID_UNROLL
    for (int i = 0; i < n; ++i) {
      inputs.size_of(phi[at(i)]);
    }
    const Count why = select(inputs.all_finite(), Count(code(Status::numerical_limit)),
                             Count(code(Status::invalid_input)));
    status = select(refused, why, status);
  }

  EHSID_ALWAYS_INLINE Truth starving(const Numbers& old) const {
    const int n = size();
    V least = old.regained[0];
    EHSID_UNROLL
    for (int i = 1; i < n; ++i) {
      least = smaller(old.regained[at(i)], least);
    }
    return (margin_ > V(0)) & (least < V(Account::kStarved));
  }

  EHSID_ALWAYS_INLINE Truth dull(const Step& step) const {
    return ~(step.evidence.regressor_variance > V(0)) & (given_margin_ != V(0));
  }

  /// What a sample without information, a starving parameter and postponed forgetting change, as in Rls::judge and
  /// Rls::forget. before: the factor with what was postponed.
  EHSID_ALWAYS_INLINE void forget(Numbers& old, const Regressors& phi, const V& before,
                                  const Truth& waits, Step& step, Truth& taken,
                                  Count& status) const {
    const V one(1);
    const V& innovation = step.evidence.innovation;
    const V& s = step.evidence.regressor_variance;
    const V known = with_freedom(old, old.usual_square);
    const Truth surprising =
        (old.weight <= V(Scalar(size() + 1))) |
        (step.recent > V(Recursion::kSurprise) * known + rounding() * step.power);
    Truth frozen = starving(old) & ~surprising;
    const V lost = loss(old);
    const Truth idle = frozen & ~(old.waited > V(Account::kLongest));
    Truth skipped = taken & (dull(step) | (idle & (s < margin_ * lost)));
    if (any(skipped)) {
      const V start = variance_at_start(phi);
      const V wanted_information = margin_ * lost;
      const Truth overdue = (start > V(Recursion::kFullSize)) &
                            ((step.recent > V(Recursion::kUnpredicted) * step.power) |
                             (least_variance(old) * start < wanted_information));
      frozen = frozen & ~(skipped & overdue);
      skipped = skipped & ~overdue;
      old.innovation = select(skipped, innovation, old.innovation);
      old.recent_square = select(skipped, step.recent, old.recent_square);
      lose_information(skipped, old);
      lower_residual_variance(skipped, s, step.recent, step.power, start, lost, old);
      status = select(skipped, Count(code(Status::no_information)), status);
      taken = taken & ~skipped;
    }
    // Postponed where frozen, else made up.
    const V all_postponed = old.postponed * step.lambda.before * step.lambda.after;
    const V longer = old.waited * (one - lost);
    step.postponed = select(frozen, larger(all_postponed, V(Account::kLongest)), one);
    step.waited = select(frozen, larger(longer, V(Account::kLongest)), one);
    step.lambda.before = select(frozen, one, before);
    step.lambda.after = select(frozen, one, step.lambda.after);
    step.square = select(frozen | waits, normalise(innovation, step.lambda.before, s), step.square);
  }

  /// Eq. (13).
  EHSID_ALWAYS_INLINE Measured measure(const Numbers& old, const Step& step, Regressors& gain,
                                       Numbers& next) {
    const int n = size();
    next.factors.resize(size());
    const V shrink = step.lambda.before * step.lambda.after;
    const V alpha = next.factors.measure(old.factors, gain, step.lambda.before, shrink, variances_);
    V mean = variances_[0] * ceiling_weight_[0];
    EHSID_UNROLL
    for (int i = 1; i < n; ++i) {
      mean += variances_[at(i)] * ceiling_weight_[at(i)];
    }
    return {shrink, alpha, mean, mean > ceiling_};
  }

  /// Eq. (14), with gain K(k) in the end. Where all numbers of the result are usable.
  EHSID_ALWAYS_INLINE Truth correct(const Numbers& old, const Step& step, const Measured& measured,
                                    Regressors& gain, Numbers& next) const {
    const int n = size();
    Extreme<Scalar, V::kWidth> squarable;
    Extreme<Scalar, V::kWidth> finite;
    Extreme<Scalar, V::kWidth> positive;
    squarable.size_of(step.square);
    finite.size_of(measured.mean);
    EHSID_UNROLL
    for (int i = 0; i < n; ++i) {
      gain[at(i)] /= measured.alpha;
      const V increment = gain[at(i)] * step.evidence.innovation + old.remainder[at(i)];
      const V theta = old.theta[at(i)] + increment;
      const V added = theta - old.theta[at(i)];
      const V remainder = (old.theta[at(i)] - (theta - added)) + (increment - added);
      squarable.size_of(theta);
      finite.size_of(remainder);
      positive.value_of(next.factors.d[at(i)]);
      next.theta[at(i)] = theta;
      next.remainder[at(i)] = remainder;
    }
    return squarable.all_squarable() & finite.all_finite() & positive.all_normal_positive();
  }

  /// As Rls::keep, in the lanes `kept`; the others stay as they are.
  template <bool kOrdinary>
  EHSID_ALWAYS_INLINE void keep(const Truth& kept, const Numbers& old, const Step& step,
                                const Measured& measured, const Regressors& gain, Numbers& next) {
    const int n = size();
    const V one(1);
    const auto put = [&](V& to, const V& value, const V& from) EHSID_INLINE_LAMBDA {
      to = kOrdinary ? value : select(kept, value, from);
    };
    const V lost = loss(old);
    EHSID_UNROLL
    for (int i = 0; i < n; ++i) {
      const V off = gain[at(i)] * gain[at(i)] * measured.alpha;
      const V share = old.regained[at(i)];
      const V all = share + (off / (variances_[at(i)] * measured.shrink + off) - lost * share);
      put(next.regained[at(i)], smaller(all, one), share);
      put(next.gain[at(i)], gain[at(i)], old.gain[at(i)]);
    }
    if constexpr (!kOrdinary) {
      EHSID_UNROLL
      for (int i = 0; i < n; ++i) {
        put(next.theta[at(i)], next.theta[at(i)], old.theta[at(i)]);
        put(next.remainder[at(i)], next.remainder[at(i)], old.remainder[at(i)]);
      }
      choose(~kept, old.factors, next.factors);
    }
    put(next.innovation, step.evidence.innovation, old.innovation);
    put(next.forgetting_factor, measured.shrink, old.forgetting_factor);
    put(next.square, step.square, old.square);
    put(next.recent_square, step.recent, old.recent_square);
    put(next.postponed, step.postponed, old.postponed);
    put(next.waited, step.waited, old.waited);
    const ForgettingFactors<V>& lambda = step.lambda;
    const V samples = lambda.before * old.weight + one;
    const V share = one / samples;
    const V outlier = V(Recursion::kMostSquare) * share;
    const V most =
        (old.usual_square + rounding() * step.power) * larger(outlier, V(Recursion::kMostRise));
    const V unlimited(std::numeric_limits<Scalar>::infinity());
    const V limit = select(old.weight > V(Scalar(n + 1)), most, unlimited);
    put(next.mean_square, old.mean_square + (step.square - old.mean_square) * share,
        old.mean_square);
    put(next.usual_square,
        old.usual_square + smaller((step.square - old.usual_square) * share, limit),
        old.usual_square);
    const V weight = smaller(lambda.after * samples, V(Recursion::kWeightLimit));
    const V squares = lambda.before * lambda.before * old.weight_square + one;
    put(next.weight, weight, old.weight);
    put(next.weight_square, smaller(lambda.after * lambda.after * squares, weight),
        old.weight_square);
  }

  static constexpr Whole<Scalar> code(Status status) { return static_cast<Whole<Scalar>>(status); }

  template <class Many, class One>
  static void set_array(Many& many, int lane, const One& one) {
    for (std::size_t i = 0; i < many.size(); ++i) {
      many[i].set(lane, one[i]);
    }
  }
  template <class Many, class One>
  static void get_array(const Many& many, int lane, One& one) {
    for (std::size_t i = 0; i < many.size(); ++i) {
      one[i] = many[i][lane];
    }
  }
  template <class One>
  static void set_factors(Factors& many, int lane, const One& one) {
    set_array(many.d, lane, one.d);
    set_array(many.u, lane, one.u);
  }

  EHSID_ALWAYS_INLINE static void choose(const Truth& where, const Factors& from, Factors& to) {
    const int n = from.size();
    EHSID_UNROLL
    for (int i = 0; i < n; ++i) {
      V& d = to.d[static_cast<std::size_t>(i)];
      d = select(where, from.d[static_cast<std::size_t>(i)], d);
    }
    const int pairs = n > 1 ? n * (n - 1) / 2 : 1;
    EHSID_UNROLL
    for (int i = 0; i < pairs; ++i) {
      V& u = to.u[static_cast<std::size_t>(i)];
      u = select(where, from.u[static_cast<std::size_t>(i)], u);
    }
  }

  EHSID_ALWAYS_INLINE static V normalise(const V& innovation, const V& lambda, const V& s) {
    return innovation * innovation * (lambda / (lambda + s));
  }

  EHSID_ALWAYS_INLINE static V rounding() { return V(Recursion::kRounding * Recursion::kRounding); }

  EHSID_ALWAYS_INLINE static V weight_share(const Numbers& of) {
    return select(of.weight > V(0), of.weight_square / of.weight, V(1));
  }

  EHSID_ALWAYS_INLINE V with_freedom(const Numbers& of, const V& mean) const {
    return mean * of.weight / larger(of.weight - V(Scalar(size())) * weight_share(of), V(1));
  }

  EHSID_ALWAYS_INLINE V loss(const Numbers& of) const {
    return larger(forgetting_.loss(), V(1) / (of.weight + V(Scalar(2 * size()))));
  }

  EHSID_ALWAYS_INLINE static V variance(const Numbers& of, int i) {
    V sum = of.factors.d[static_cast<std::size_t>(i)];
    const int n = of.factors.size();
    const V* factor = &of.factors.u[0] + i * (i + 1) / 2 + i;
    for (int k = i + 1; k < n; ++k) {
      sum += *factor * *factor * of.factors.d[static_cast<std::size_t>(k)];
      factor += k;
    }
    return sum;
  }

  EHSID_ALWAYS_INLINE void lose_information(const Truth& where, Numbers& of) const {
    const V lost = loss(of);
    for (int i = 0; i < size(); ++i) {
      V& share = of.regained[static_cast<std::size_t>(i)];
      V left = share - lost * share;
      left = select(left > V(Account::kNothing), left, V(0));
      share = select(where, left, share);
    }
  }

  EHSID_ALWAYS_INLINE V least_variance(const Numbers& of) const {
    V least(std::numeric_limits<Scalar>::max());
    for (int i = 0; i < size(); ++i) {
      const V share =
          variance(of, i) * V(Scalar(size())) * ceiling_weight_[static_cast<std::size_t>(i)];
      least = smaller(share, least);
    }
    return least;
  }

  EHSID_ALWAYS_INLINE V variance_at_start(const Regressors& phi) const {
    V sum(0);
    for (int i = 0; i < size(); ++i) {
      const auto ii = static_cast<std::size_t>(i);
      sum += phi[ii] * phi[ii] / (V(Scalar(size())) * ceiling_weight_[ii]);
    }
    return sum;
  }

  EHSID_ALWAYS_INLINE void lower_residual_variance(const Truth& where, const V& s, const V& recent,
                                                   const V& power, const V& start, const V& lost,
                                                   Numbers& of) const {
    const V known =
        select(of.weight > V(Scalar(size() + 1)), with_freedom(of, of.mean_square), V(0));
    const V wanted = margin_ * lost;
    const Truth predicted = recent < V(Recursion::kPredicted) * power;
    Truth lowered = where & (recent * V(Recursion::kFallen) < known) &
                    (start > V(Recursion::kNoise)) & (s < select(predicted, lost, wanted));
    if (!any(lowered)) {
      return;
    }
    const V needed = wanted / s;
    V trace = variance(of, 0) * ceiling_weight_[0];
    // weighted_trace(): the weights stand on the left, which does not change a product.
    for (int i = 1; i < size(); ++i) {
      trace += variance(of, i) * ceiling_weight_[static_cast<std::size_t>(i)];
    }
    const V room = ceiling_ / trace;
    V factor = known / recent;
    factor = select(predicted & (needed < factor), needed, factor);
    factor = smaller(room, factor);
    lowered = lowered & (factor > V(1));
    Extreme<Scalar, V::kWidth> scaled;
    for (int i = 0; i < size(); ++i) {
      scaled.size_of(factor * variance(of, i));
    }
    lowered = lowered & scaled.all_finite();
    for (int i = 0; i < size(); ++i) {
      V& d = of.factors.d[static_cast<std::size_t>(i)];
      d = select(lowered, d * factor, d);
    }
    of.mean_square = select(lowered, of.mean_square / factor, of.mean_square);
    of.usual_square = select(lowered, of.usual_square / factor, of.usual_square);
  }

  Numbers numbers_[2];
  int now_ = 0;
  bool ordinary_ = false;  // was the last sample?
  Regressors variances_;   // P_ii, if it was
  Policy forgetting_;
  V margin_;
  V given_margin_;  // negative for the default
  V ceiling_;
  Regressors ceiling_weight_;
  Factors initial_factors_;
};

}  // namespace ehsid::bank
