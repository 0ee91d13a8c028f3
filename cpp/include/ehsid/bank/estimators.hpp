// SPDX-License-Identifier: MIT
// OnlineEstimator::step of as many estimators as a register has lanes.
#pragma once

#include <ehsid/arx_estimator.hpp>
#include <ehsid/bank/monitors.hpp>
#include <ehsid/bank/recursions.hpp>
#include <ehsid/parts.hpp>

#include <type_traits>

namespace ehsid::bank {

/// What a step says of each lane besides its state, in the units of the signals.
template <class V, int kN>
struct Results {
  Array<V, kN> theta;
  Array<V, kN> deviation;
  V innovation;
  V forgetting_factor;
  V residual_variance;
  typename V::Truth converged;
};

/// V::kWidth estimators of the type Estimator, an OnlineEstimator with an Rls. All have the same orders.
template <class Estimator, class V>
class Estimators {
 public:
  using Scalar = typename Estimator::Scalar;
  using Truth = typename V::Truth;
  using Count = CountsOf<V>;
  using Model = typename Estimator::Model;
  using Recursion = typename Estimator::Recursion;
  static constexpr int kN = Estimator::kN;
  static constexpr int kWidth = V::kWidth;
  static_assert(std::is_same_v<typename Estimator::Parts, AllParts>,
                "a bank has estimators with all parts");

  /// Takes over settings and state of one estimator: of the same type, or of the same orders, chosen at run time.
  template <class One>
  void set(int lane, const One& one) {
    recursions_.set(lane, one.recursion());
    if constexpr (std::is_same_v<One, Estimator>) {
      model_ = one.model();
    }
    const auto& history = one.model().state();
    for (std::size_t i = 0; i < outputs_.size(); ++i) {
      outputs_[i].set(lane, history.outputs[i]);
    }
    for (std::size_t i = 0; i < commands_.size(); ++i) {
      commands_[i].set(lane, history.commands[i]);
    }
    filled_.set(lane, history.filled);
    set_lane(resets_, lane, one.change_detector().state());
    set_lane(reset_options_, lane, one.change_detector().options());
    set_lane(convergences_, lane, one.monitor().state());
    set_lane(convergence_options_, lane, one.monitor().options());
    set_lane(whitenesses_, lane, one.whiteness().state());
    const auto& scaling = one.scaling();
    command_scale_.set(lane, scaling.command_scale);
    position_scale_.set(lane, scaling.position_scale);
    command_offset_.set(lane, scaling.command_offset);
    position_offset_.set(lane, scaling.position_offset);
    for (std::size_t i = 0; i < units_.size(); ++i) {
      units_[i].set(lane, one.unit(static_cast<int>(i)));
    }
    input_limit_.set(lane, one.input_limit_);
    reset_enabled_.set(lane, one.reset_enabled_);
    enabled_.set(lane, one.enabled_);
  }

  /// Writes the state of one lane to `one`, which has its settings.
  template <class One>
  void get(int lane, One& one) const {
    auto state = one.contents();
    recursions_.get_state(lane, state.recursion);
    for (std::size_t i = 0; i < outputs_.size(); ++i) {
      state.history.outputs[i] = outputs_[i][lane];
    }
    for (std::size_t i = 0; i < commands_.size(); ++i) {
      state.history.commands[i] = commands_[i][lane];
    }
    state.history.filled = static_cast<std::int32_t>(filled_[lane]);
    get_lane(resets_, lane, state.reset);
    get_lane(convergences_, lane, state.convergence);
    get_lane(whitenesses_, lane, state.whiteness);
    // A state that an estimator has reached: these cannot refuse.
    static_cast<void>(one.recursion_.restore(state.recursion));
    static_cast<void>(one.model_.restore(state.history));
    static_cast<void>(one.reset_.restore(state.reset));
    static_cast<void>(one.monitor_.restore(state.convergence));
    static_cast<void>(one.whiteness_.restore(state.whiteness));
    one.enabled_ = enabled_[lane];
  }

  /// One sample of each lane of `wanted`, in the units of the signals. Returns the Status of each lane as a number.
  EHSID_ALWAYS_INLINE Count step(const Truth& wanted, const V& command, const V& position) {
    const Truth finite = is_finite(command) & is_finite(position);
    const V u = (command - command_offset_) / command_scale_;
    const V y = (position - position_offset_) / position_scale_;
    const Truth valid = wanted & finite & plausible(u) & plausible(y);
    const Count full(static_cast<Whole<Scalar>>(model_.full()));
    const Truth filled = filled_ >= full;
    typename Recursions<Recursion, V>::Regressors phi;
    if constexpr (Recursions<Recursion, V>::kTriesOrdinary) {
      if (all(valid & enabled_ & filled)) {
        fill(phi, u);
        if (recursions_.update_ordinary(phi, y)) {
          Count status = code(Status::ok);
          watch(Truth(true), Truth(false), Truth(false), phi, status);
          shift(commands_, model_.nk() + model_.nb(), u);
          shift(outputs_, model_.na(), y);
          return status;
        }
      }
    }

    Count status = select(enabled_, code(Status::filling), code(Status::disabled));
    if (any(wanted & ~valid)) {
      status = select(valid, status,
                      select(finite, code(Status::out_of_range), code(Status::invalid_input)));
      forget_samples(wanted & ~valid);
    }

    const Truth estimated = valid & enabled_ & filled;
    Truth kept(false);
    Truth skipped(false);
    fill(phi, u);
    if (any(estimated)) {
      const Count updated = recursions_.update_any(estimated, phi, y);
      status = select(estimated, updated, status);
      kept = estimated & (updated == code(Status::ok));
      skipped = estimated & (updated == code(Status::no_information));
    }
    watch(kept, skipped, valid & ~kept & ~skipped, phi, status);
    shift(commands_, model_.nk() + model_.nb(), u, valid);
    shift(outputs_, model_.na(), y, valid);
    filled_ = select(valid & ~filled, filled_ + Count(1), filled_);
    return status;
  }

  /// As the functions of OnlineEstimator with these names.
  EHSID_ALWAYS_INLINE void report(Results<V, kN>& to) const {
    const int n = recursions_.size();
    const auto at = [](int i) EHSID_INLINE_LAMBDA { return static_cast<std::size_t>(i); };
    const V variance = recursions_.parameter_variance();
    const Truth white = whitenesses_.coloured == Count(0);
    const V inflation = select(white, V(1), sqrt(V(1) + whitenesses_.statistic));
    Array<V, kN> variances;
    recursions_.variances(variances);
    EHSID_UNROLL
    for (int i = 0; i < n; ++i) {
      to.theta[at(i)] = bounded_product(recursions_.theta()[at(i)], units_[at(i)]);
      const V square = variance * variances[at(i)];
      V deviation = sqrt(square);
      const Truth finite = is_finite(square);
      if (!all(finite)) {
        deviation = select(finite, deviation, sqrt(variance) * sqrt(variances[at(i)]));
      }
      deviation = bounded_product(deviation, inflation);
      to.deviation[at(i)] = bounded_product(deviation, units_[at(i)]);
    }
    to.innovation = bounded_product(recursions_.innovation(), position_scale_);
    to.forgetting_factor = recursions_.forgetting_factor();
    to.residual_variance =
        bounded_product(recursions_.residual_variance(), position_scale_ * position_scale_);
    to.converged = (convergences_.steady >= convergence_options_.hold) &
                   (whitenesses_.samples >= Count(WhitenessMonitor<Scalar>::kEnough)) & white;
  }

  EHSID_ALWAYS_INLINE int size() const { return recursions_.size(); }

 private:
  EHSID_ALWAYS_INLINE static Count code(Status status) {
    return Count(static_cast<Whole<Scalar>>(status));
  }

  /// Eq. (8): the outputs, then the commands, of which u is the newest.
  EHSID_ALWAYS_INLINE void fill(Array<V, kN>& phi, const V& u) const {
    const int na = model_.na();
    const int nb = model_.nb();
    const int nk = model_.nk();
    EHSID_UNROLL
    for (int i = 0; i < na; ++i) {
      phi[static_cast<std::size_t>(i)] = -outputs_[static_cast<std::size_t>(i)];
    }
    EHSID_UNROLL
    for (int i = 0; i < nb; ++i) {
      const int delay = nk + i;
      phi[static_cast<std::size_t>(na + i)] =
          delay == 0 ? u : commands_[static_cast<std::size_t>(delay - 1)];
    }
    if (model_.offset()) {
      phi[static_cast<std::size_t>(na + nb)] = V(1);
    }
  }

  /// The command that leaves the regressor next.
  EHSID_ALWAYS_INLINE const V& last_of(const Array<V, kN>& phi) const {
    return phi[static_cast<std::size_t>(model_.na() + model_.nb() - 1)];
  }

  /// Puts `newest` in front of the first `count` numbers, of which the last one goes.
  template <class History>
  EHSID_ALWAYS_INLINE static void shift(History& history, int count, const V& newest) {
    EHSID_UNROLL
    for (int i = count - 1; i > 0; --i) {
      history[static_cast<std::size_t>(i)] = history[static_cast<std::size_t>(i - 1)];
    }
    history[0] = newest;
  }
  /// The same where the mask is true.
  template <class History>
  EHSID_ALWAYS_INLINE static void shift(History& history, int count, const V& newest,
                                        const Truth& where) {
    EHSID_UNROLL
    for (int i = count - 1; i > 0; --i) {
      V& number = history[static_cast<std::size_t>(i)];
      number = select(where, history[static_cast<std::size_t>(i - 1)], number);
    }
    history[0] = select(where, newest, history[0]);
  }

  /// Brings the monitors up to date, and resets where they say so.
  EHSID_ALWAYS_INLINE void watch(const Truth& kept, const Truth& skipped, const Truth& interrupted,
                                 const typename Recursions<Recursion, V>::Regressors& phi,
                                 Count& status) {
    update(convergences_, convergence_options_, recursions_, kept, skipped);
    whitenesses_.update(recursions_, last_of(phi), kept, skipped, interrupted);
    const Truth moved = whitenesses_.moved_far(recursions_, recursions_.leverage(phi), kept);
    const Truth watched = kept & reset_enabled_;
    if (any(watched)) {
      const Truth changed = update(resets_, reset_options_, watched, moved, recursions_.keeps(),
                                   recursions_.normalised_square());
      if (any(changed)) {
        const V rmse = sqrt(resets_.long_square);
        recursions_.reset(changed, rmse * rmse);
        clear(convergences_, changed);
        clear(whitenesses_, changed);
        status = select(changed, code(Status::reset), status);
      }
    }
  }

  EHSID_ALWAYS_INLINE Truth plausible(const V& scaled) const {
    return (scaled <= input_limit_) & (scaled >= -input_limit_);
  }

  EHSID_ALWAYS_INLINE void forget_samples(const Truth& where) {
    for (V& output : outputs_) {
      output = select(where, V(0), output);
    }
    for (V& command : commands_) {
      command = select(where, V(0), command);
    }
    filled_ = select(where, Count(0), filled_);
  }

  EHSID_ALWAYS_INLINE static V bounded_product(const V& a, const V& b) {
    V product = a * b;
    const Truth finite = is_finite(product);
    if (!all(finite)) {
      const V largest(std::numeric_limits<Scalar>::max());
      const auto same = ~((a < V(0)).native ^ (b < V(0)).native);
      product = select(finite, product, select(Truth(same), largest, -largest));
    }
    return product;
  }

  using History = typename Model::State;

  Recursions<Recursion, V> recursions_;
  Model model_;  // of which only the orders are used
  std::array<V, std::tuple_size<decltype(History::outputs)>::value> outputs_;
  std::array<V, std::tuple_size<decltype(History::commands)>::value> commands_;
  Count filled_;
  Resets<V> resets_;
  ResetOptions<V> reset_options_;
  Convergences<V> convergences_;
  ConvergenceSettings<V> convergence_options_;
  Whitenesses<V> whitenesses_;
  V command_scale_;
  V position_scale_;
  V command_offset_;
  V position_offset_;
  Array<V, kN> units_;
  V input_limit_;
  Truth reset_enabled_;
  Truth enabled_;
};

}  // namespace ehsid::bank
