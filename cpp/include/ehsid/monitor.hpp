// SPDX-License-Identifier: MIT
#pragma once

#include <ehsid/groups.hpp>
#include <ehsid/types.hpp>

namespace ehsid {

/// Settings of ConvergenceMonitor.
template <class Scalar>
struct ConvergenceOptions {
  Scalar tolerance = Scalar(0.05);  // standard deviation relative to the parameter, > 0
  Scalar magnitude =
      Scalar(0.1);         // a scaled parameter smaller than this is judged as if it were this, > 0
  std::int32_t hold = 20;  // informative samples in a row before "converged", >= 1

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&ConvergenceOptions::tolerance);
    visit(&ConvergenceOptions::magnitude);
    visit(&ConvergenceOptions::hold);
  }

  bool valid() const {
    return is_finite(tolerance) && tolerance > Scalar(0) && is_finite(magnitude) &&
           magnitude > Scalar(0) && hold >= 1;
  }
};

/// What ConvergenceMonitor remembers. Plain data.
template <class Scalar>
struct ConvergenceState {
  std::int32_t steady;  // informative samples in a row inside the tolerance, up to `hold`
  std::int32_t
      samples;        // samples seen since the start or the last reset (stops at its largest value)
  Scalar excitation;  // share of recent samples during which every parameter was excited, 0 to 1

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&ConvergenceState::steady);
    visit(&ConvergenceState::samples);
    visit(&ConvergenceState::excitation);
  }
};

/// Has the estimate converged? Judged in the covariance of theta: every standard deviation must stay below `tolerance` of its
/// parameter for `hold` informative samples in a row. Says nothing of whether that is right, see
/// WhitenessMonitor. Also keeps the share of samples, over about the last 100, during which every parameter was excited:
/// those that were neither left out nor taken while Rls::starved().
template <class Scalar>
class ConvergenceMonitor {
 public:
  using Options = ConvergenceOptions<Scalar>;
  using State = ConvergenceState<Scalar>;

  Status configure(const Options& options) {
    if (!options.valid()) {
      return Status::invalid_argument;
    }
    options_ = options;
    restart();
    return Status::ok;
  }

  void restart() { state_ = State{}; }

  /// After an informative update of any estimator with theta_hat, factors and residual variance.
  template <class Estimator>
  void updated(const Estimator& rls) {
    auto variances = rls.state().theta;  // takes all P_ii
    rls.state().factors.variances(variances);
    updated(rls, variances);
  }

  /// The same where all P_ii are known: Rls::update() gives them, and to form them anew takes as long as most of a monitor.
  template <class Estimator>
  void updated(const Estimator& rls, const Array<Scalar, Estimator::kN>& variances) {
    count(!rls.starved());
    const auto& state = rls.state();
    const Scalar variance = rls.parameter_variance();
    const Scalar share = options_.tolerance * options_.tolerance;
    // Degrees of freedom: with no more samples than parameters the residuals say nothing.
    bool inside = state.weight > Scalar(2 * rls.size());
    const Scalar least = options_.magnitude * options_.magnitude;
    in_groups<Scalar>(
        count_of<Estimator::kN>(rls.size()), [&](const auto group) EHSID_INLINE_LAMBDA {
          const auto theta = group.load(state.theta.data());
          const auto size = group.larger(theta * theta, least);
          inside = group.at_most(variance * group.gather(variances.data()), share * size) && inside;
        });
    if (!inside) {
      state_.steady = 0;
    } else if (state_.steady < options_.hold) {
      ++state_.steady;
    }
  }

  /// After a sample that carried no information: what was known stays known.
  void skipped() { count(false); }

  bool converged() const { return state_.steady >= options_.hold; }
  /// Share of recent samples during which the excitation told something about every parameter, 0 to 1.
  Scalar excitation() const { return state_.excitation; }
  std::int32_t samples() const { return state_.samples; }

  const Options& options() const { return options_; }
  const State& state() const { return state_; }

  /// May this saved state be taken over?
  static bool usable(const State& saved) {
    return saved.steady >= 0 && saved.samples >= 0 && is_finite(saved.excitation) &&
           saved.excitation >= Scalar(0) && saved.excitation <= Scalar(1);
  }

  /// Takes a saved state over; invalid_argument, and nothing changed, unless it is usable.
  Status restore(const State& saved) {
    if (!usable(saved)) {
      return Status::invalid_argument;
    }
    state_ = saved;
    return Status::ok;
  }

 private:
  static constexpr std::int32_t kMemory = 100;

  void count(bool informative) {
    constexpr std::int32_t kLast = 0x7fffffff;
    state_.samples += state_.samples < kLast ? 1 : 0;
    const std::int32_t window = state_.samples < kMemory ? state_.samples : kMemory;
    const Scalar now = informative ? Scalar(1) : Scalar(0);
    state_.excitation += (now - state_.excitation) / static_cast<Scalar>(window);
    // A product that goes on falling would be denormal, which is slow.
    state_.excitation = state_.excitation > Scalar(1e-6) ? state_.excitation : Scalar(0);
  }

  Options options_{};
  State state_{};
};

}  // namespace ehsid
