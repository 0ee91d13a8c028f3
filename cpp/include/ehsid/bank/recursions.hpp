// SPDX-License-Identifier: MIT
// Rls::update of as many estimators as a register has lanes: the same operations in the same order in each lane, with a
// mask in place of each branch. What only a lane in a hold needs is left out where no lane is in one.
#pragma once

#include <ehsid/bank/fields.hpp>
#include <ehsid/bank/lanes.hpp>
#include <ehsid/bank/policies.hpp>
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
  using Policy = LanesOf<typename Recursion::Forgetting, V>;

  /// Takes over settings and state of one estimator. All lanes have as many parameters.
  void set(int lane, const Recursion& one) {
    const auto& state = one.state();
    factors_.resize(one.size());
    initial_factors_.resize(one.size());
    set_array(theta_, lane, state.theta);
    set_array(remainder_, lane, state.remainder);
    set_lane(factors_, lane, state.factors);
    forgetting_.set(lane, state.forgetting);
    set_array(gain_, lane, state.gain);
    innovation_.set(lane, state.innovation);
    forgetting_factor_.set(lane, state.forgetting_factor);
    square_.set(lane, state.square);
    mean_square_.set(lane, state.mean_square);
    usual_square_.set(lane, state.usual_square);
    weight_.set(lane, state.weight);
    recent_square_.set(lane, state.recent_square);
    set_array(regained_, lane, state.account.regained);
    postponed_.set(lane, state.account.waiting.postponed);
    waited_.set(lane, state.account.waiting.waited);
    margin_.set(lane, one.information_margin());
    given_margin_.set(lane, one.options_.information_margin);
    ceiling_.set(lane, one.options_.covariance_ceiling);
    set_lane(initial_factors_, lane, one.initial_factors_);
    set_array(ceiling_weight_, lane, one.ceiling_weight_);
  }

  /// Writes the state of one lane to `one`, which has its settings.
  void get(int lane, Recursion& one) const { get(lane, one.state_); }
  /// The state of one lane.
  void get(int lane, typename Recursion::State& state) const {
    get_array(theta_, lane, state.theta);
    get_array(remainder_, lane, state.remainder);
    get_lane(factors_, lane, state.factors);
    forgetting_.get(lane, state.forgetting);
    get_array(gain_, lane, state.gain);
    state.innovation = innovation_[lane];
    state.forgetting_factor = forgetting_factor_[lane];
    state.square = square_[lane];
    state.mean_square = mean_square_[lane];
    state.usual_square = usual_square_[lane];
    state.weight = weight_[lane];
    state.recent_square = recent_square_[lane];
    get_array(regained_, lane, state.account.regained);
    state.account.waiting = {postponed_[lane], waited_[lane]};
  }

  EHSID_ALWAYS_INLINE int size() const { return factors_.size(); }

  /// One sample of each lane of `wanted`; the others stay as they are. Returns the Status of each lane as a number,
  /// Status::disabled for those that are not wanted.
  EHSID_ALWAYS_INLINE Count update(const Truth& wanted, const Regressors& phi, const V& y) {
    const int n = size();
    const auto at = [](int i) EHSID_INLINE_LAMBDA { return static_cast<std::size_t>(i); };
    const V zero(0);
    const V one(1);

    // (12)
    V predicted = phi[0] * theta_[0];
    EHSID_UNROLL
    for (int i = 1; i < n; ++i) {
      predicted += phi[at(i)] * theta_[at(i)];
    }
    const V innovation = y - predicted;
    Regressors gain;
    V s = factors_.project(phi, gain);
    const Evidence<V> evidence{innovation, s};
    ForgettingFactors<V> lambda = forgetting_.peek(evidence);
    V square = normalise(innovation, lambda.before, s);
    const V recent = recent_square_ + V(Recursion::kRecentRate) * (square - recent_square_);
    const V power = y * y + predicted * predicted;

    Truth taken = wanted & is_squarable(square) & is_finite(s);
    Count status = select(wanted, Count(code(Status::ok)), Count(code(Status::disabled)));
    if (any(wanted & ~taken)) {
      Extreme<Scalar, V::kWidth> inputs;
      inputs.size_of(y);
      EHSID_UNROLL
      for (int i = 0; i < n; ++i) {
        inputs.size_of(phi[at(i)]);
      }
      const Count refused = select(inputs.all_finite(), Count(code(Status::numerical_limit)),
                                   Count(code(Status::invalid_input)));
      status = select(wanted & ~taken, refused, status);
    }

    // What a sample without information, a starving parameter and postponed forgetting change.
    V postponed = one;
    V waited = one;
    Truth frozen(false);
    V least = regained_[0];
    EHSID_UNROLL
    for (int i = 1; i < n; ++i) {
      least = smaller(regained_[at(i)], least);
    }
    const Truth starving = (margin_ > zero) & (least < V(Account::kStarved));
    const Truth waits = waited_ < one;
    Truth dull = ~(s > zero) & (given_margin_ != zero);
    if constexpr (Recursion::Forgetting::kFilters) {
      dull = dull | forgetting_.filters(n, phi);
    }
    V before = lambda.before * postponed_;
    if (any(taken & (starving | waits | dull))) {
      const V known = with_freedom(usual_square_);
      const Truth surprising = (weight_ <= V(Scalar(n + 1))) |
                               (recent > V(Recursion::kSurprise) * known + rounding() * power);
      frozen = starving & ~surprising;
      const V loss = least_loss();
      const Truth idle = frozen & ~(waited_ > V(Account::kLongest));
      Truth skipped = taken & (dull | (idle & (s < margin_ * loss)));
      if (any(skipped)) {
        const V start = variance_at_start(phi);
        const V wanted_information = margin_ * loss;
        const Truth overdue =
            (start > V(Recursion::kFullSize)) & ((recent > V(Recursion::kUnpredicted) * power) |
                                                 (least_variance() * start < wanted_information));
        frozen = frozen & ~(skipped & overdue);
        skipped = skipped & ~overdue;
        innovation_ = select(skipped, innovation, innovation_);
        recent_square_ = select(skipped, recent, recent_square_);
        lose_information(skipped);
        lower_residual_variance(skipped, s, recent, power, start, loss);
        status = select(skipped, Count(code(Status::no_information)), status);
        taken = taken & ~skipped;
        if (!any(taken)) {
          return status;
        }
      }
      // Postponed where frozen, else made up.
      const V all_postponed = postponed_ * lambda.before * lambda.after;
      const V longer = waited_ * (one - loss);
      postponed = select(frozen, larger(all_postponed, V(Account::kLongest)), one);
      waited = select(frozen, larger(longer, V(Account::kLongest)), one);
      before = select(frozen, one, before);
      lambda.after = select(frozen, one, lambda.after);
      square = select(frozen | waits, normalise(innovation, before, s), square);
    }
    lambda.before = before;

    Factors factors;
    factors.resize(n);
    if constexpr (Recursion::Forgetting::kSpreads) {
      factors.keep(factors_);
      forgetting_.spread(factors, phi);
      if (any(taken & frozen)) {
        choose(frozen, factors_, factors);
      }
      s = factors.project(phi, gain);
      square = select(frozen, square, normalise(innovation, lambda.before, s));
    }
    // (13)
    const Factors& prior = Recursion::Forgetting::kSpreads ? factors : factors_;
    const V shrink = lambda.before * lambda.after;
    Regressors variances;
    const V alpha = factors.measure(prior, gain, lambda.before, shrink, variances);
    V mean = variances[0] * ceiling_weight_[0];
    EHSID_UNROLL
    for (int i = 1; i < n; ++i) {
      mean += variances[at(i)] * ceiling_weight_[at(i)];
    }
    const Truth over = mean > ceiling_;
    if (any(taken & over)) {
      factors.scale(select(over, ceiling_ / mean, one));
    }
    // (14)
    Regressors theta;
    Regressors remainder;
    Extreme<Scalar, V::kWidth> squarable;
    Extreme<Scalar, V::kWidth> finite;
    Extreme<Scalar, V::kWidth> positive;
    squarable.size_of(square);
    finite.size_of(mean);
    EHSID_UNROLL
    for (int i = 0; i < n; ++i) {
      gain[at(i)] /= alpha;
      const V increment = gain[at(i)] * innovation + remainder_[at(i)];
      theta[at(i)] = theta_[at(i)] + increment;
      const V added = theta[at(i)] - theta_[at(i)];
      remainder[at(i)] = (theta_[at(i)] - (theta[at(i)] - added)) + (increment - added);
      squarable.size_of(theta[at(i)]);
      finite.size_of(remainder[at(i)]);
      positive.value_of(factors.d[at(i)]);
    }
    const Truth good =
        squarable.all_squarable() & finite.all_finite() & positive.all_normal_positive();
    const Truth kept = taken & good;
    status = select(taken & ~good, Count(code(Status::numerical_limit)), status);

    // From here on as Rls::update after the last check.
    const V fresh = fresh_share();
    const auto keep = [&](const auto& put) EHSID_INLINE_LAMBDA {
      EHSID_UNROLL
      for (int i = 0; i < n; ++i) {
        const V off = gain[at(i)] * gain[at(i)] * alpha;
        const V share = regained_[at(i)];
        const V next = share + (off / (variances[at(i)] * shrink + off) -
                                loss(i, variances[at(i)], fresh) * share);
        put(regained_[at(i)], smaller(next, one));
        put(theta_[at(i)], theta[at(i)]);
        put(remainder_[at(i)], remainder[at(i)]);
        put(gain_[at(i)], gain[at(i)]);
        put(factors_.d[at(i)], factors.d[at(i)]);
      }
      const int pairs = n > 1 ? n * (n - 1) / 2 : 1;
      EHSID_UNROLL
      for (int i = 0; i < pairs; ++i) {
        put(factors_.u[at(i)], factors.u[at(i)]);
      }
      put(innovation_, innovation);
      put(forgetting_factor_, shrink);
      put(square_, square);
      put(recent_square_, recent);
      put(postponed_, postponed);
      put(waited_, waited);
      accumulate(square, lambda, power, put);
    };
    if (all(kept)) {
      keep([](V& to, const V& from) EHSID_INLINE_LAMBDA { to = from; });
    } else {
      keep([&](V& to, const V& from) EHSID_INLINE_LAMBDA { to = select(kept, from, to); });
    }
    forgetting_.accept(kept, evidence);
    return status;
  }

  /// As Rls::reset(noise_variance), where the mask is true.
  EHSID_ALWAYS_INLINE void reset(const Truth& where, const V& noise_variance) {
    const V zero(0);
    const V one(1);
    choose(where, initial_factors_, factors_);
    forgetting_.restart(where);
    const Truth known = noise_variance > zero;
    const V weight(Scalar(size() + 2));
    const V mean = noise_variance * V(2) / weight;
    for (std::size_t i = 0; i < gain_.size(); ++i) {
      gain_[i] = select(where, zero, gain_[i]);
      regained_[i] = select(where, one, regained_[i]);
    }
    innovation_ = select(where, zero, innovation_);
    forgetting_factor_ = select(where, one, forgetting_factor_);
    square_ = select(where, zero, square_);
    mean_square_ = select(where, select(known, mean, zero), mean_square_);
    usual_square_ = select(where, select(known, mean, zero), usual_square_);
    weight_ = select(where, select(known, weight, zero), weight_);
    recent_square_ = select(where, zero, recent_square_);
    postponed_ = select(where, one, postponed_);
    waited_ = select(where, one, waited_);
  }

  EHSID_ALWAYS_INLINE V residual_variance() const { return with_freedom(mean_square_); }
  EHSID_ALWAYS_INLINE Truth starved() const { return waited_ < V(1); }
  EHSID_ALWAYS_INLINE const Regressors& theta() const { return theta_; }
  EHSID_ALWAYS_INLINE const Factors& factors() const { return factors_; }
  EHSID_ALWAYS_INLINE const V& weight() const { return weight_; }
  EHSID_ALWAYS_INLINE const V& innovation() const { return innovation_; }
  EHSID_ALWAYS_INLINE const V& forgetting_factor() const { return forgetting_factor_; }
  EHSID_ALWAYS_INLINE const V& normalised_square() const { return square_; }
  EHSID_ALWAYS_INLINE const V& mean_square() const { return mean_square_; }

 private:
  using Account = InformationAccount<Scalar, kN>;

  static constexpr Whole<Scalar> code(Status status) { return static_cast<Whole<Scalar>>(status); }

  template <class Many, class One>
  static void set_array(Many& many, int lane, const One& one) {
    for (std::size_t i = 0; i < one.size(); ++i) {
      many[i].set(lane, one[i]);
    }
  }
  template <class Many, class One>
  static void get_array(const Many& many, int lane, One& one) {
    for (std::size_t i = 0; i < one.size(); ++i) {
      one[i] = many[i][lane];
    }
  }

  EHSID_ALWAYS_INLINE static void choose(const Truth& where, const Factors& from, Factors& to) {
    for (std::size_t i = 0; i < to.d.size(); ++i) {
      to.d[i] = select(where, from.d[i], to.d[i]);
    }
    for (std::size_t i = 0; i < to.u.size(); ++i) {
      to.u[i] = select(where, from.u[i], to.u[i]);
    }
  }

  EHSID_ALWAYS_INLINE static V normalise(const V& innovation, const V& lambda, const V& s) {
    return innovation * innovation * (lambda / (lambda + s));
  }

  EHSID_ALWAYS_INLINE static V rounding() { return V(Recursion::kRounding * Recursion::kRounding); }

  EHSID_ALWAYS_INLINE V with_freedom(const V& mean) const {
    return mean * weight_ / larger(weight_ - V(Scalar(size())), V(1));
  }

  EHSID_ALWAYS_INLINE V fresh_share() const { return V(1) / (weight_ + V(Scalar(2 * size()))); }

  EHSID_ALWAYS_INLINE V loss(int i, const V& variance, const V& fresh) const {
    return larger(forgetting_.loss(i, variance), fresh);
  }

  EHSID_ALWAYS_INLINE V variance(int i) const {
    V sum = factors_.d[static_cast<std::size_t>(i)];
    const int n = size();
    const V* factor = &factors_.u[0] + i * (i + 1) / 2 + i;
    for (int k = i + 1; k < n; ++k) {
      sum += *factor * *factor * factors_.d[static_cast<std::size_t>(k)];
      factor += k;
    }
    return sum;
  }

  EHSID_ALWAYS_INLINE V least_loss() const {
    const V fresh = fresh_share();
    if constexpr (!Recursion::Forgetting::kSpreads) {
      return loss(0, V(0), fresh);
    } else {
      V least(1);
      for (int i = 0; i < size(); ++i) {
        least = smaller(loss(i, variance(i), fresh), least);
      }
      return least;
    }
  }

  EHSID_ALWAYS_INLINE void lose_information(const Truth& where) {
    const V fresh = fresh_share();
    for (int i = 0; i < size(); ++i) {
      V& share = regained_[static_cast<std::size_t>(i)];
      const V lost = loss(i, Recursion::Forgetting::kSpreads ? variance(i) : V(0), fresh);
      V left = share - lost * share;
      left = select(left > V(Account::kNothing), left, V(0));
      share = select(where, left, share);
    }
  }

  EHSID_ALWAYS_INLINE V least_variance() const {
    V least(std::numeric_limits<Scalar>::max());
    for (int i = 0; i < size(); ++i) {
      const V share =
          variance(i) * V(Scalar(size())) * ceiling_weight_[static_cast<std::size_t>(i)];
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
                                                   const V& power, const V& start, const V& loss) {
    const V known = select(weight_ > V(Scalar(size() + 1)), residual_variance(), V(0));
    const V wanted = margin_ * loss;
    const Truth predicted = recent < V(Recursion::kPredicted) * power;
    Truth lowered = where & (recent * V(Recursion::kFallen) < known) &
                    (start > V(Recursion::kNoise)) & (s < select(predicted, loss, wanted));
    if (!any(lowered)) {
      return;
    }
    const V needed = wanted / s;
    V trace = variance(0) * ceiling_weight_[0];
    // weighted_trace(): the weights stand on the left, which does not change a product.
    for (int i = 1; i < size(); ++i) {
      trace += variance(i) * ceiling_weight_[static_cast<std::size_t>(i)];
    }
    const V room = ceiling_ / trace;
    V factor = known / recent;
    factor = select(predicted & (needed < factor), needed, factor);
    factor = smaller(room, factor);
    lowered = lowered & (factor > V(1));
    Extreme<Scalar, V::kWidth> scaled;
    for (int i = 0; i < size(); ++i) {
      scaled.size_of(factor * variance(i));
    }
    lowered = lowered & scaled.all_finite();
    for (int i = 0; i < size(); ++i) {
      V& d = factors_.d[static_cast<std::size_t>(i)];
      d = select(lowered, d * factor, d);
    }
    mean_square_ = select(lowered, mean_square_ / factor, mean_square_);
    usual_square_ = select(lowered, usual_square_ / factor, usual_square_);
  }

  template <class Put>
  EHSID_ALWAYS_INLINE void accumulate(const V& square, const ForgettingFactors<V>& lambda,
                                      const V& power, const Put& put) {
    const V samples = lambda.before * weight_ + V(1);
    const V share = V(1) / samples;
    const V mean_square = mean_square_ + (square - mean_square_) * share;
    const V outlier = V(Recursion::kMostSquare) * share;
    const V most = (usual_square_ + rounding() * power) * larger(outlier, V(Recursion::kMostRise));
    const V unlimited(std::numeric_limits<Scalar>::infinity());
    const V limit = select(weight_ > V(Scalar(size() + 1)), most, unlimited);
    const V usual_square = usual_square_ + smaller((square - usual_square_) * share, limit);
    const V weight = smaller(lambda.after * samples, V(Recursion::kWeightLimit));
    put(mean_square_, mean_square);
    put(usual_square_, usual_square);
    put(weight_, weight);
  }

  Regressors theta_;
  Regressors remainder_;
  Factors factors_;
  Regressors gain_;
  V innovation_;
  V forgetting_factor_;
  V square_;
  V mean_square_;
  V usual_square_;
  V weight_;
  V recent_square_;
  Regressors regained_;
  V postponed_;
  V waited_;
  Policy forgetting_;
  V margin_;
  V given_margin_;  // negative for the default
  V ceiling_;
  Regressors ceiling_weight_;
  Factors initial_factors_;
};

}  // namespace ehsid::bank
