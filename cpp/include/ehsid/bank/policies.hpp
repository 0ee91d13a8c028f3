// SPDX-License-Identifier: MIT
// The forgetting policies across lanes: the equations of forgetting/*.hpp with a choice in place of each branch. Each lane
// has settings and state of its own.
//
// A policy that has no form here cannot be used in a bank; `LanesOf` names it in the message of the compiler.
#pragma once

#include <ehsid/bank/lanes.hpp>
#include <ehsid/bank/sliding_sums.hpp>
#include <ehsid/forgetting.hpp>

#include <limits>

namespace ehsid::bank {

/// The policy `Policy` for as many estimators as `V` has lanes.
///
/// set(lane, policy), get(lane, policy): settings and state of one lane. peek() and loss() as in the policy; accept() and
/// restart() only where the mask is true.
template <class Policy, class V>
struct LanesOf;

template <class Scalar, class V>
struct LanesOf<Constant<Scalar>, V> {
  using Policy = Constant<Scalar>;
  V lambda;

  void set(int lane, const Policy& one) { lambda.set(lane, one.lambda); }
  void get(int lane, Policy& one) const { one.lambda = lambda[lane]; }
  EHSID_ALWAYS_INLINE V loss() const { return V(1) - lambda; }
  EHSID_ALWAYS_INLINE void restart(const typename V::Truth& /*where*/) {}
  EHSID_ALWAYS_INLINE ForgettingFactors<V> peek(const Evidence<V>& /*evidence*/) const {
    return {lambda, V(1)};
  }
  EHSID_ALWAYS_INLINE void accept(const typename V::Truth& /*where*/,
                                  const Evidence<V>& /*evidence*/) {}
};

template <class Scalar, class V>
struct LanesOf<Exponential<Scalar>, V> {
  using Policy = Exponential<Scalar>;
  V lambda0;
  V lambda_initial;
  V deficit;

  void set(int lane, const Policy& one) {
    lambda0.set(lane, one.lambda0);
    lambda_initial.set(lane, one.lambda_initial);
    deficit.set(lane, one.deficit);
  }
  void get(int lane, Policy& one) const {
    one.lambda0 = lambda0[lane];
    one.lambda_initial = lambda_initial[lane];
    one.deficit = deficit[lane];
  }
  EHSID_ALWAYS_INLINE V loss() const { return next(); }
  EHSID_ALWAYS_INLINE void restart(const typename V::Truth& where) {
    deficit = select(where, V(1) - lambda_initial, deficit);
  }
  EHSID_ALWAYS_INLINE ForgettingFactors<V> peek(const Evidence<V>& /*evidence*/) const {
    return {V(1) - next(), V(1)};
  }
  EHSID_ALWAYS_INLINE void accept(const typename V::Truth& where, const Evidence<V>& /*evidence*/) {
    deficit = select(where, next(), deficit);
  }

 private:
  EHSID_ALWAYS_INLINE V next() const {
    const V shrunk = lambda0 * deficit;
    return select(shrunk > V(std::numeric_limits<Scalar>::epsilon() / Scalar(4)), shrunk, V(0));
  }
};

template <class Scalar, class V>
struct LanesOf<ErrorDriven<Scalar>, V> {
  using Policy = ErrorDriven<Scalar>;
  V memory;
  V lambda_min;
  V noise_variance;
  V mean_square;
  V seen;  // at most 2^20, which a float holds exactly

  void set(int lane, const Policy& one) {
    memory.set(lane, one.memory);
    lambda_min.set(lane, one.lambda_min);
    noise_variance.set(lane, one.noise_variance);
    mean_square.set(lane, one.mean_square);
    seen.set(lane, static_cast<Scalar>(one.seen));
  }
  void get(int lane, Policy& one) const {
    one.memory = memory[lane];
    one.lambda_min = lambda_min[lane];
    one.noise_variance = noise_variance[lane];
    one.mean_square = mean_square[lane];
    one.seen = static_cast<std::int32_t>(seen[lane]);
  }
  EHSID_ALWAYS_INLINE V loss() const { return V(1) / memory; }
  EHSID_ALWAYS_INLINE void restart(const typename V::Truth& where) {
    mean_square = select(where, V(0), mean_square);
    seen = select(where, V(0), seen);
  }
  EHSID_ALWAYS_INLINE ForgettingFactors<V> peek(const Evidence<V>& evidence) const {
    const auto given = noise_variance > V(0);
    const V allowance = select(given, noise_variance, mean_square) * memory;
    const V error = posterior_square(evidence);
    V after = V(1) - error / allowance;
    const auto small = error < (V(1) - lambda_min) * allowance;
    after = select(small, after, select(allowance > V(0), lambda_min, V(1)));
    return {V(1), select(given | (seen >= V(Scalar(Policy::kFirst))), after, V(1))};
  }
  EHSID_ALWAYS_INLINE void accept(const typename V::Truth& where, const Evidence<V>& evidence) {
    const V samples = seen + V(1);
    const V rate = V(1) / smaller(samples, memory);
    const V outlier = V(Policy::kMostSquare) * rate;
    const V most = mean_square * larger(outlier, V(Policy::kMostRise));
    const auto limited = (seen >= V(Scalar(Policy::kFirst))) & (mean_square > V(0));
    const V unlimited(std::numeric_limits<Scalar>::infinity());
    const V step = smaller(rate * (posterior_square(evidence) - mean_square),
                           select(limited, most, unlimited));
    mean_square = select(where, mean_square + step, mean_square);
    seen = select(where & (seen < V(Scalar(Policy::kMostSeen))), samples, seen);
  }

 private:
  EHSID_ALWAYS_INLINE static V posterior_square(const Evidence<V>& evidence) {
    const V square =
        evidence.innovation * evidence.innovation / (V(1) + evidence.regressor_variance);
    return smaller(square, V(Policy::kMost));
  }
};

template <class Scalar, int kShort, int kLong, class V>
struct LanesOf<FRatio<Scalar, kShort, kLong>, V> {
  using Policy = FRatio<Scalar, kShort, kLong>;
  V eta;
  V critical_ratio;
  SlidingSums<V, kShort> short_window;
  SlidingSums<V, kLong> long_window;
  V seen;

  void set(int lane, const Policy& one) {
    eta.set(lane, one.eta);
    critical_ratio.set(lane, one.critical_ratio);
    short_window.set(lane, one.short_window);
    long_window.set(lane, one.long_window);
    seen.set(lane, static_cast<Scalar>(one.seen));
  }
  void get(int lane, Policy& one) const {
    one.eta = eta[lane];
    one.critical_ratio = critical_ratio[lane];
    short_window.get(lane, one.short_window);
    long_window.get(lane, one.long_window);
    one.seen = static_cast<std::int32_t>(seen[lane]);
  }
  EHSID_ALWAYS_INLINE V loss() const { return V(0); }
  EHSID_ALWAYS_INLINE void restart(const typename V::Truth& where) {
    short_window.restart(where);
    long_window.restart(where);
    seen = select(where, V(0), seen);
  }
  EHSID_ALWAYS_INLINE ForgettingFactors<V> peek(const Evidence<V>& evidence) const {
    const V square = square_of(evidence);
    const V short_mean = short_window.peek(square) / V(Scalar(kShort));
    const V long_mean = long_window.peek(square) / V(Scalar(kLong));
    const V usual = critical_ratio * long_mean;
    const auto larger_now = (short_mean > usual) & (seen + V(1) >= V(Scalar(kLong)));
    V lambda(1);
    if (any(larger_now)) {
      const V g = sqrt(short_mean / usual) - V(1);
      lambda = select(larger_now, V(1) / (V(1) + eta * g), lambda);
    }
    return {lambda, V(1)};
  }
  EHSID_ALWAYS_INLINE void accept(const typename V::Truth& where, const Evidence<V>& evidence) {
    const V square = square_of(evidence);
    short_window.push(where, square);
    long_window.push(where, square);
    seen = select(where & (seen < V(Scalar(kLong))), seen + V(1), seen);
  }

 private:
  EHSID_ALWAYS_INLINE static V square_of(const Evidence<V>& evidence) {
    return smaller(evidence.innovation * evidence.innovation, V(SlidingSum<Scalar, kLong>::kMost));
  }
};

}  // namespace ehsid::bank
