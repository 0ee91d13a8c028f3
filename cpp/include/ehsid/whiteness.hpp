// SPDX-License-Identifier: MIT
// Are the residuals white? Least squares is right about theta and its deviations only where they are: an innovation that
// can be predicted, from earlier innovations or from commands that the regressor no longer holds, belongs to noise that
// biases theta (a noisy position sensor) or to a model that lacks something (order, delay, friction).
//
// The whiteness and independence tests of L. Ljung, System Identification, 2nd ed. 1999, sec. 16.6, online. With
// z(k) = epsilon(k) sqrt(lambda / (lambda + phi' P phi)) / sigma, which has variance one, converged or not,
//
//   x = (z(k-1), z(k-2), z(k-3), u(k-d), u(k-d-2), u(k-d-4)),   d = nk + nb
//   S_i(k) = rho S_i(k-1) + z(k) x_i,   V_i(k) = rho^2 V_i(k-1) + (z(k) x_i)^2,   Q = sum_i S_i^2 / V_i
//
// For white residuals each product has mean zero whatever came before, V_i is the variance of S_i, and Q is chi-squared
// distributed with 6 degrees of freedom. Dividing by V_i, the form of J. C. Escanciano, I. N. Lobato, "An automatic
// portmanteau test for serial correlation", Journal of Econometrics 151, 2009, keeps that true where the size of the
// noise changes. Measured rates of false alarms, and what the test sees and does not see: docs/estimator.md.
#pragma once

#include <ehsid/groups.hpp>
#include <ehsid/types.hpp>

#include <cmath>

namespace ehsid {

/// What WhitenessMonitor remembers. Plain data.
template <class Scalar>
struct WhitenessState {
  static constexpr int kErrors = 3;    // lags 1, 2, 3
  static constexpr int kCommands = 5;  // lags d .. d + 4, of which every other one is tested
  static constexpr int kTests = 6;

  Array<Scalar, kErrors> errors;  // z of the samples before, newest first; 0 where there is none
  Array<Scalar, kCommands> commands;  // commands that have left the regressor, newest first
  Array<Scalar, kTests> sums;         // S
  Array<Scalar, kTests> squares;      // V
  Scalar partial;                     // of Q, of the tests before `next`
  Scalar statistic;                   // Q, at most kTests samples old
  std::int32_t samples;               // seen since the start or the last reset, without the skipped
  std::int32_t tested;    // of these, samples with an error; both stop at their largest value
  std::uint8_t next;      // the test that comes next into Q
  std::uint8_t coloured;  // 1 from an alarm to its release

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&WhitenessState::errors);
    visit(&WhitenessState::commands);
    visit(&WhitenessState::sums);
    visit(&WhitenessState::squares);
    visit(&WhitenessState::partial);
    visit(&WhitenessState::statistic);
    visit(&WhitenessState::samples);
    visit(&WhitenessState::tested);
    visit(&WhitenessState::next);
    visit(&WhitenessState::coloured);
  }
};

/// Tests whether the residuals of a recursion are white.
///
/// One of the six terms of Q is formed at each sample, so the statistic is renewed every six samples and every sample
/// costs the same. The memory is that of the estimator, but at least 500 samples: the colour of the noise is a property
/// of the machine and stays when parameters change, and fewer samples do not show it.
template <class Scalar>
class WhitenessMonitor {
 public:
  using State = WhitenessState<Scalar>;

  /// Alarm above this: a chi-squared variable with 6 degrees of freedom exceeds it with a probability of 1e-3.
  static constexpr Scalar kAlarm = Scalar(22.458);
  /// Released below this, its 95 % quantile.
  static constexpr Scalar kRelease = Scalar(12.592);
  /// Tested samples before the first alarm. With fewer the sums are not normally distributed.
  static constexpr std::int32_t kFewest = 100;
  /// Samples before "no alarm" means much: from then on noise that biases theta by three deviations hardly ever goes
  /// unnoticed (docs/estimator.md).
  static constexpr std::int32_t kEnough = 300;
  /// Square of the deviations by which one error may move theta: three and a half. White residuals hardly ever move it by
  /// more than one.
  static constexpr Scalar kMostMoved = Scalar(12);
  /// An error is judged after so many samples for each parameter. With fewer sigma is not known, and every sample moves
  /// theta far.
  static constexpr int kFewestEach = 5;

  void restart() { state_ = State{}; }

  /// After an update that was kept. rls: any estimator with innovation, residuals and forgetting factor in its state().
  /// leaving: the oldest command of the regressor, scaled. tolerated: correlation of the errors that is none of the plant's,
  /// >= 0.
  template <class Estimator>
  void updated(const Estimator& rls, Scalar leaving, Scalar tolerated = Scalar(0)) {
    const auto& recursion = rls.state();
    Scalar error(0);
    // With few samples sigma is not known. mean_square has seen the square, so it is no smaller than a share of it.
    if (recursion.weight > Scalar(2 * rls.size())) {
      count(state_.samples);
      if (recursion.square > kSmallestError * kSmallestError) {
        count(state_.tested);
        const Scalar size = std::sqrt(recursion.square / recursion.mean_square);
        // Not a branch: one that depends on the sign of noise is guessed wrong every other time.
        error = std::copysign(size < kLargestError ? size : kLargestError, recursion.innovation);
      }
      accumulate(error, recursion.forgetting_factor, tolerated);
    }
    remember(error, leaving);
  }

  /// Has the last error moved theta by more than sqrt(kMostMoved) of the deviations that it had before? What the residuals
  /// before it said of theta then no longer holds, and enough() begins anew.
  ///
  /// leverage: phi' K. The step K epsilon is sqrt(epsilon^2 K' P^-1 K / sigma^2) deviations long, with the P of before,
  /// and that is sqrt(square phi' K / sigma^2), with the sigma of before.
  template <class Estimator>
  bool moved_far(const Estimator& rls, Scalar leverage) {
    const auto& recursion = rls.state();
    const Scalar before = recursion.mean_square - recursion.square / recursion.weight;
    const bool far = recursion.weight > Scalar(kFewestEach * rls.size()) &&
                     recursion.square > kSmallestError * kSmallestError &&
                     recursion.square * leverage > kMostMoved * before;
    state_.samples = far ? 0 : state_.samples;
    return far;
  }

  /// After a sample that was not taken for lack of information: time goes on, nothing is tested.
  void skipped(Scalar leaving) { remember(Scalar(0), leaving); }

  /// After a sample without a regressor: what follows has no past.
  void interrupted() {
    state_.errors.fill(Scalar(0));
    state_.commands.fill(Scalar(0));
  }

  /// No alarm. True before kFewest samples have been tested.
  bool white() const { return state_.coloured == 0; }
  /// Have there been enough samples for `white` to mean something?
  bool enough() const { return state_.samples >= kEnough; }
  /// Q. Of white residuals chi-squared distributed with 6 degrees of freedom; 0 before the first six samples.
  Scalar statistic() const { return state_.statistic; }

  /// Factor >= 1 of the standard deviations: 1 where the residuals are white, else sqrt(1 + Q).
  ///
  /// Least squares with the six x_i as additional regressors would change theta_j by at most sqrt(Q) of its deviations
  /// where theta_j and the x_i share half of their information (omitted variables; e.g. W. H. Greene, Econometric
  /// Analysis, 7th ed. 2012, sec. 4.3.2). It says how large the bias may be and is no bound of it: see docs/estimator.md.
  Scalar inflation() const { return white() ? Scalar(1) : std::sqrt(Scalar(1) + state_.statistic); }

  const State& state() const { return state_; }

  /// May this saved state be taken over?
  static bool usable(const State& saved) {
    bool good = saved.samples >= 0 && saved.tested >= 0 && saved.next < State::kTests &&
                saved.coloured <= 1 && is_within(saved.partial) && is_within(saved.statistic);
    for (const Scalar error : saved.errors) {
      good = good && bounded(error, kLargestError) == error;
    }
    for (const Scalar command : saved.commands) {
      good = good && bounded(command, kLargestCommand) == command;
    }
    for (std::size_t i = 0; i < saved.sums.size(); ++i) {
      good = good && is_squarable(saved.sums[i]) && is_variance(saved.squares[i]) &&
             is_within(term(saved, i));
    }
    return good;
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
  template <class>
  friend struct bank::Whitenesses;

  // An outlier, or the errors of a change of the plant, count as three deviations.
  static constexpr Scalar kLargestError = Scalar(3);
  // Scaled commands are of order one; this only keeps every product finite.
  static constexpr Scalar kLargestCommand = Scalar(1e6);
  // Errors of the scaled output below this are rounding or the last trace of theta0, as in a simulation without noise.
  static constexpr Scalar kSmallestError = Scalar(1e-5);
  // Memory in samples, at least and at most: beyond, a float no longer adds up.
  static constexpr Scalar kShortest = Scalar(1) - Scalar(1) / Scalar(500);
  static constexpr Scalar kLongest = Scalar(1) - Scalar(1) / Scalar(1e5);
  // Each sample adds at most 1 to S^2 / V.
  static constexpr Scalar kMostStatistic = Scalar(State::kTests) * Scalar(4294967296.0);

  static bool is_within(Scalar value) {
    return is_finite(value) && value >= Scalar(0) && value <= kMostStatistic;
  }

  static Scalar bounded(Scalar value, Scalar most) {
    if (value > most) {
      return most;
    }
    return value < -most ? -most : value;
  }

  /// S^2 / V of what |S| is beyond the tolerated correlation, of which V is about the sum.
  static Scalar term(const State& state, std::size_t i, Scalar tolerated = Scalar(0)) {
    const Scalar size = std::abs(state.sums[i]) - tolerated * state.squares[i];
    return is_normal_positive(state.squares[i]) && size > Scalar(0) ? size * size / state.squares[i]
                                                                    : Scalar(0);
  }

  static void count(std::int32_t& samples) {
    constexpr std::int32_t kLast = 0x7fffffff;
    samples += samples < kLast ? 1 : 0;
  }

  void accumulate(Scalar error, Scalar forgetting_factor, Scalar tolerated) {
    Scalar rho = forgetting_factor < kLongest ? forgetting_factor : kLongest;
    rho = rho > kShortest ? rho : kShortest;
    const Scalar rho_square = rho * rho;
    const auto& errors = state_.errors;
    const auto& commands = state_.commands;
    const Array<Scalar, State::kTests> past{errors[0],   errors[1],   errors[2],
                                            commands[0], commands[2], commands[4]};
    Scalar* sums = state_.sums.data();
    Scalar* squares = state_.squares.data();
    in_groups<Scalar>(count_of<State::kTests>(State::kTests),
                      [&](const auto group) EHSID_INLINE_LAMBDA {
                        const auto product = error * group.gather(past.data());
                        group.store(rho * group.load(sums) + product, sums);
                        group.store(rho_square * group.load(squares) + product * product, squares);
                      });
    state_.partial +=
        term(state_, state_.next, state_.next < State::kErrors ? tolerated : Scalar(0));
    ++state_.next;
    if (state_.next == State::kTests) {
      state_.statistic = state_.partial;
      state_.partial = Scalar(0);
      state_.next = 0;
      const Scalar most = state_.coloured != 0 ? kRelease : kAlarm;
      state_.coloured = state_.tested >= kFewest && state_.statistic > most ? 1 : 0;
    }
  }

  void remember(Scalar error, Scalar leaving) {
    for (std::size_t i = state_.errors.size() - 1; i > 0; --i) {
      state_.errors[i] = state_.errors[i - 1];
    }
    state_.errors[0] = error;
    for (std::size_t i = state_.commands.size() - 1; i > 0; --i) {
      state_.commands[i] = state_.commands[i - 1];
    }
    state_.commands[0] = bounded(leaving, kLargestCommand);
  }

  State state_{};
};

}  // namespace ehsid
