// SPDX-License-Identifier: MIT
// K, omega_n and xi of a servo while it runs, each with an interval and a word on whether it can be trusted, from the command
// and the position of a noisy sensor: ServoFilter with a bank of starts, a rule for rest, a check by free runs and a way to
// begin anew. The measured figures, and when the estimator of Eq. (8) is the better choice: docs/which_estimator.md.
#pragma once

#include <ehsid/free_run.hpp>
#include <ehsid/servo_discretisation.hpp>
#include <ehsid/servo_filter.hpp>
#include <ehsid/servo_rest.hpp>
#include <ehsid/single_sine.hpp>
#include <ehsid/snapshot.hpp>
#include <ehsid/types.hpp>

#include <array>
#include <cmath>

namespace ehsid {

/// Settings of a ServoEstimator. Only the sampling time has to be given.
template <class Scalar>
struct ServoEstimatorOptions {
  Scalar dt_s = Scalar(0);  // sampling time in s, > 0
  /// Samples from a command to the first position that shows it, 1 .. kMaxDelay; one more is found by itself.
  std::int32_t delay = 1;
  /// How fast K and omega_n may wander: standard deviation of their logarithms in 1 s, >= 0.
  Scalar drift = Scalar(0.02);
  /// K is trusted where the half of its 90 % interval is below this share of it; omega_n and xi at 1.5 times this.
  Scalar tolerance = Scalar(0.1);

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&ServoEstimatorOptions::dt_s);
    visit(&ServoEstimatorOptions::delay);
    visit(&ServoEstimatorOptions::drift);
    visit(&ServoEstimatorOptions::tolerance);
  }

  bool valid(std::int32_t most_delay) const {
    return is_finite(dt_s) && dt_s > Scalar(0) && delay >= 1 && delay <= most_delay &&
           is_finite(drift) && drift >= Scalar(0) && is_finite(tolerance) && tolerance > Scalar(0);
  }
};

/// Why a value is not trusted.
enum class TrustReason : std::uint8_t {
  trusted = 0,
  starting = 1,            // too little has been seen since the start, or since all began anew
  resting = 2,             // the servo stands still, and the interval has grown
  single_sine = 3,         // the command is one sine, which does not show this value
  change_suspected = 4,    // the innovations have just been far too large
  model_does_not_fit = 5,  // left alone, the model does not run like the servo
  not_precise = 6,         // the interval is wider than the tolerance
};

/// A value with the half of its 90 % interval, in the same unit; NaN before there is any.
template <class Scalar>
struct TrackedValue {
  Scalar value = std::numeric_limits<Scalar>::quiet_NaN();
  Scalar half_width = std::numeric_limits<Scalar>::quiet_NaN();
  bool trusted = false;
  TrustReason reason = TrustReason::starting;
};

/// The servo of Eq. (5): gain K in units of the position per s and unit of the command (negative where a positive command
/// retracts), omega_n in rad/s, xi.
template <class Scalar>
struct TrackedServo {
  TrackedValue<Scalar> gain;
  TrackedValue<Scalar> omega_n;
  TrackedValue<Scalar> xi;
};

/// Static memory, no heap, bounded time. kMaxDelay: the longest delay that can be chosen.
///
/// The constants below were set on 480 simulated servos, half of them nonlinear; the figures of the page are of others.
template <class Scalar_, int kMaxDelay = 4>
class ServoEstimator {
 public:
  using Scalar = Scalar_;
  using Options = ServoEstimatorOptions<Scalar>;
  using Filter = ServoFilter<Scalar>;

  /// Starts of omega_n dt, from 0.025 to 1.35 in equal ratios, each with the stated delay and one sample more.
  static constexpr int kRates = 6;
  static constexpr int kStarts = 2 * kRates;
  /// A command or position beyond this is refused: its square would leave the range of float.
  static constexpr Scalar kLargest = Scalar(1e12);
  /// Counts of samples stop here.
  static constexpr std::int32_t kMostSamples = 2000000000;

  /// Takes the options and starts anew. invalid_argument leaves everything as it was.
  EHSID_RARE Status configure(const Options& options) {
    if (!options.valid(kMaxDelay)) {
      return Status::invalid_argument;
    }
    options_ = options;
    commands_ = {};
    sine_ = {};
    // One behind the other: a new object in one piece would need as much stack.
    filter_ = {};
    for (auto& one : bank_) {
      one = {};
    }
    started_ = false;
    hole_ = false;
    resets_ = 0;
    tracked_ = 0;
    leader_ = 0;
    sign_ = Scalar(1);
    delay_ = options.delay;
    least_noise_ = std::numeric_limits<Scalar>::min();
    command_square_ = before_ = reference_ = rest_position_ = Scalar(0);
    averaged_ = 0;
    per_second_ = Scalar(1) / options.dt_s;
    rest_.restart(samples_of(Scalar(0.15), 16));
    begin_anew();
    return Status::ok;
  }

  /// One sample: the command sent at t_k and the position measured at t_k.
  ///
  /// ok; filling before the first motion; no_information at rest; reset where all begins anew; invalid_argument before
  /// configure(); invalid_input or out_of_range,
  /// where nothing has changed but that the next good sample is taken as the first behind a hole.
  Status step(Scalar command, Scalar position) {
    if (!(options_.dt_s > Scalar(0))) {
      return Status::invalid_argument;
    }
    if (!is_finite(command) || !is_finite(position)) {
      hole_ = true;
      return Status::invalid_input;
    }
    if (!(std::abs(command) <= kLargest && std::abs(position) <= kLargest)) {
      hole_ = true;
      return Status::out_of_range;
    }
    if (!started_ || hole_) {
      reference_ = position;
      before_ = position;
      reopen(Scalar(0));
      hole_ = false;
    }
    rest_.take(position);
    Status status = Status::filling;
    if (phase_ == Phase::waiting) {
      wait(position);
    } else if (phase_ == Phase::starting) {
      status = start(position);
    } else {
      status = track(position);
    }
    before_ = position;
    move_on(command);
    started_ = true;
    return status;
  }

  /// What is known of the servo now.
  EHSID_RARE TrackedServo<Scalar> servo() const {
    TrackedServo<Scalar> told;
    if (!filter_.started()) {
      return told;
    }
    const auto& state = filter_.state();
    // The share of the squared motion that neither the model nor the noise explains; where the disturbance is small, the
    // filter explains the rest by it. It widens every interval.
    const Scalar part =
        state.disturbance < Scalar(0.3) ? state.disturbance / Scalar(0.3) : Scalar(1);
    const Scalar structural = part * part;
    const bool enough = run_.windows() >= Scalar(2) && run_.log_ratio() != Scalar(0);
    const Scalar scatter = enough ? run_.variance() : Scalar(0);
    const Scalar unexplained = scatter * run_.windows() - Scalar(1.3) * run_.noise_share();
    const Scalar excess = enough && unexplained > Scalar(0) ? structural * unexplained : Scalar(0);
    // Innovations that are too large, or large and not white, widen what P says.
    const Scalar ratio = state.innovation_product / (state.innovation_square + Scalar(1e-9));
    const Scalar correlation = ratio < Scalar(0)      ? Scalar(0)
                               : ratio > Scalar(0.95) ? Scalar(0.95)
                                                      : ratio;
    const Scalar of_sums =
        state.innovation_square * (Scalar(1) + correlation) / (Scalar(1) - correlation);
    const Scalar wider = of_sums > Scalar(1) ? of_sums : Scalar(1);
    // K of the free runs counts as far as it differs from that of the filter by more than its scatter.
    const Scalar shift = enough ? run_.log_ratio() : Scalar(0);
    const Scalar doubt = Scalar(3) * scatter / (shift * shift + Scalar(1e-12));
    const Scalar weight = enough && doubt < Scalar(1) ? Scalar(1) - doubt : Scalar(0);
    const Scalar moved = weight * shift;
    const Scalar gain_variance = (Scalar(1) - weight) * wider * filter_.covariance(3, 3) +
                                 weight * scatter + moved * moved / Scalar(4) +
                                 Scalar(0.2025) * excess + structural * run_.gain_scatter();
    const Scalar dt = options_.dt_s;
    set(told.gain, sign_ * state.gain * bounded_exp(moved) / dt, gain_variance, Scalar(1));
    set(told.omega_n, state.rate / dt, wider * filter_.covariance(4, 4) + Scalar(6.25) * excess,
        Scalar(1.5));
    // xi is wanted to 0.15 at least.
    const Scalar xi_share = state.damping > Scalar(0.3) ? state.damping : Scalar(0.3);
    set(told.xi, state.damping, wider * filter_.covariance(5, 5) + Scalar(3.6) * excess,
        Scalar(1.5) / xi_share);
    if (sine_.sine()) {
      refuse(told.omega_n, TrustReason::single_sine);
      refuse(told.xi, TrustReason::single_sine);
    }
    return told;
  }

  /// Eq. (6) of servo(): theta = (a1, a2, a3, b1, b2, b3), where b1 belongs to the command of delay() samples ago, and its
  /// covariance J P J'. Its intervals are as wide as those of servo(). `Real` may be double where Scalar is float: a servo that
  /// is sampled fast shows in the last digits of a1, a2, a3. filling before there are values, or a status of discretise();
  /// nothing is changed then.
  template <class Real>
  EHSID_RARE Status model(Vector<Real, 6>& theta, SquareMatrix<Real, 6>& covariance) const {
    const TrackedServo<Scalar> told = servo();
    if (!is_finite(told.gain.value)) {
      return Status::filling;
    }
    const ContinuousServo<Real> found{static_cast<Real>(told.gain.value),
                                      static_cast<Real>(told.omega_n.value),
                                      static_cast<Real>(told.xi.value)};
    Eigen::Matrix<Real, 6, 3> jacobian;
    const Status status = discretise(found, static_cast<Real>(options_.dt_s), theta, &jacobian);
    if (is_error(status)) {
      return status;
    }
    // The deviations are those of servo(), their correlations those of the filter.
    const TrackedValue<Scalar>* const values[] = {&told.gain, &told.omega_n, &told.xi};
    Eigen::Matrix<Real, 3, 3> parameters;
    for (int i = 0; i < 3; ++i) {
      const TrackedValue<Scalar>& value = *values[i];
      const Scalar scale = value.half_width / (kHalfInterval * std::abs(value.value) *
                                               std::sqrt(filter_.covariance(3 + i, 3 + i)));
      jacobian.col(i) *= static_cast<Real>(scale);
      for (int j = 0; j < 3; ++j) {
        parameters(i, j) = static_cast<Real>(filter_.covariance(3 + i, 3 + j));
      }
    }
    const Eigen::Matrix<Real, 6, 3> weighted = jacobian * parameters;
    covariance.noalias() = weighted * jacobian.transpose();
    return Status::ok;
  }

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&ServoEstimator::options_);
    visit(&ServoEstimator::per_second_);
    visit(&ServoEstimator::filter_);
    visit(&ServoEstimator::bank_);
    visit(&ServoEstimator::rest_);
    visit(&ServoEstimator::run_);
    visit(&ServoEstimator::sine_);
    visit(&ServoEstimator::commands_, each_command);
    visit(&ServoEstimator::last_);
    visit(&ServoEstimator::before_);
    visit(&ServoEstimator::reference_);
    visit(&ServoEstimator::rest_position_);
    visit(&ServoEstimator::command_square_);
    visit(&ServoEstimator::least_noise_);
    visit(&ServoEstimator::sign_);
    visit(&ServoEstimator::thirds_);
    visit(&ServoEstimator::paths_);
    visit(&ServoEstimator::pulls_);
    visit(&ServoEstimator::together_);
    visit(&ServoEstimator::low_);
    visit(&ServoEstimator::high_);
    visit(&ServoEstimator::averaged_);
    visit(&ServoEstimator::waited_);
    visit(&ServoEstimator::peak_);
    visit(&ServoEstimator::peak_samples_);
    visit(&ServoEstimator::tracked_);
    visit(&ServoEstimator::settling_);
    visit(&ServoEstimator::cooling_);
    visit(&ServoEstimator::resets_);
    visit(&ServoEstimator::delay_);
    visit(&ServoEstimator::leader_);
    visit(&ServoEstimator::phase_);
    visit(&ServoEstimator::started_);
    visit(&ServoEstimator::hole_);
    visit(&ServoEstimator::resting_);
    visit(&ServoEstimator::known_);
    visit(&ServoEstimator::suspected_);
    visit(&ServoEstimator::fitted_);
    visit(&ServoEstimator::placed_);
  }

  /// Bytes of a snapshot with the longest delay.
  static constexpr std::size_t most_snapshot_bytes() {
    return ehsid::snapshot_bytes<ServoEstimator>(shape(kMaxDelay));
  }
  /// Bytes that save() writes and restore() expects, which the delay decides.
  std::size_t snapshot_bytes() const {
    return ehsid::snapshot_bytes<ServoEstimator>(shape(options_.delay));
  }

  /// Writes the state to `to`, which has room for snapshot_bytes(). The bytes are the same on every machine.
  void save(std::uint8_t* to) const { write_snapshot(to, header(), *this); }

  /// What restore() would find wrong with these bytes; SnapshotFault::none where it would take them over. Needs room on the
  /// stack for another estimator.
  SnapshotFault check(const std::uint8_t* bytes, std::size_t count) const {
    ServoEstimator found = *this;
    return found.read(bytes, count, options_);
  }

  /// Takes over `count` bytes that save() wrote: what follows is the same bit for bit. invalid_argument, and nothing changed,
  /// where check() finds a fault: damaged, of another precision or delay, or of other options. Needs the stack of check().
  Status restore(const std::uint8_t* bytes, std::size_t count) {
    ServoEstimator found = *this;
    if (found.read(bytes, count, options_) != SnapshotFault::none) {
      return Status::invalid_argument;
    }
    *this = found;
    return Status::ok;
  }

  /// Standing still: the parameters wait.
  bool resting() const { return resting_; }
  /// How often all began anew since configure().
  std::int32_t resets() const { return resets_; }
  const Options& options() const { return options_; }
  /// The filter in charge; before its start the most likely one.
  const Filter& filter() const { return filter_; }
  /// Effective delay in samples: the stated one, or one more.
  std::int32_t delay() const { return delay_; }

 private:
  enum class Phase : std::uint8_t { waiting, starting, tracking };

  /// Disturbance below which a filter fits its servo, and beyond which such a filter has lost it.
  static constexpr Scalar kFitted = Scalar(0.02);
  static constexpr Scalar kLost = Scalar(0.6);
  static constexpr Scalar kHalfInterval = Scalar(1.645);  // of 90 %, in deviations
  static constexpr std::uint32_t kMagic = 0x45485356U;    // "EHSV"

  /// As a model without outputs, whose commands reach back by the delay and one more.
  static constexpr ModelShape shape(std::int32_t delay) { return {0, 2, delay, false}; }

  SnapshotHeader header() const {
    ByteStream settings = ByteStream::writing(nullptr);
    stream_fields(settings, shape(options_.delay), options_);
    return {kMagic,
            kSnapshotVersion,
            static_cast<std::uint16_t>(sizeof(Scalar)),
            0,  // no forgetting policy
            shape(options_.delay),
            static_cast<std::uint32_t>(snapshot_bytes()),
            settings.checksum()};
  }

  SnapshotFault read(const std::uint8_t* bytes, std::size_t count, const Options& own) {
    const SnapshotFault fault = read_snapshot(bytes, count, header(), *this);
    if (fault != SnapshotFault::none) {
      return fault;
    }
    const bool same = options_.dt_s == own.dt_s && options_.delay == own.delay &&
                      options_.drift == own.drift && options_.tolerance == own.tolerance &&
                      per_second_ == Scalar(1) / own.dt_s;
    return same && possible() && saves_as(bytes, count) ? SnapshotFault::none
                                                        : SnapshotFault::impossible;
  }

  /// Whether save() would write these bytes again: of a bool, for one, only two values do.
  bool saves_as(const std::uint8_t* bytes, std::size_t count) const {
    std::uint32_t wanted = 0;
    ByteStream reader = ByteStream::reading(bytes + (count - kChecksumBytes));
    reader.values(&wanted, 1);
    SnapshotHeader own = header();
    ByteStream writer = ByteStream::writing(nullptr);
    stream_fields(writer, own.shape, own);
    stream_fields(writer, own.shape, *this);
    return writer.checksum() == wanted;
  }

  /// Whether counts and what becomes a whole number are in the ranges in which a step leaves them, and what is told is
  /// finite. Sums and filters may hold numbers that are not: hostile samples do that, and all begins anew then.
  bool possible() const {
    bool good = rest_.possible(kLargest) && run_.possible() && sine_.possible() &&
                filter_.possible() && phase_ <= Phase::tracking &&
                (phase_ == Phase::waiting || filter_.started()) && std::abs(sign_) == Scalar(1) &&
                delay_ >= options_.delay && delay_ <= options_.delay + 1 && leader_ >= -1 &&
                leader_ < kStarts;
    for (const auto& one : bank_) {
      good = one.possible() && good;
    }
    for (const Scalar sum :
         {command_square_, least_noise_, thirds_, paths_, pulls_, together_, peak_}) {
      good = is_finite(sum) && good;
    }
    for (const Scalar position :
         {before_, reference_, rest_position_, low_, high_, last_[0], last_[1], last_[2]}) {
      good = std::abs(position) <= kLargest && good;
    }
    for (const Scalar command : commands_) {
      good = std::abs(command) <= kLargest && good;
    }
    for (const std::int32_t count :
         {averaged_, waited_, peak_samples_, tracked_, settling_, cooling_, resets_}) {
      good = count >= 0 && count <= kMostSamples && good;
    }
    const TrackedServo<Scalar> told = servo();
    for (const auto* value : {&told.gain, &told.omega_n, &told.xi}) {
      const bool none = value->value != value->value;
      good = (none || (is_finite(value->value) && is_finite(value->half_width))) && good;
    }
    return good;
  }

  /// A time in samples, at least `least`.
  EHSID_ONCE std::int32_t samples_of(Scalar seconds, std::int32_t least) const {
    const Scalar samples = seconds * per_second_;
    const Scalar most = Scalar(1e9);
    const auto found = static_cast<std::int32_t>(samples < most ? samples : most);
    return found > least ? found : least;
  }

  EHSID_RARE void set(TrackedValue<Scalar>& to, Scalar value, Scalar variance, Scalar times) const {
    // Not beyond a factor of 1e3, nor without a number.
    const Scalar half = variance < Scalar(1e6) ? kHalfInterval * std::sqrt(variance) : Scalar(1e3);
    to.value = value;
    to.half_width = half * std::abs(value);
    if (phase_ == Phase::waiting || run_.windows() < Scalar(3.4)) {
      to.reason = TrustReason::starting;
    } else if (suspected_ || filter_.state().outliers > 1) {
      to.reason = TrustReason::change_suspected;
    } else if (half < times * options_.tolerance && run_.share() > Scalar(0.7)) {
      to.trusted = true;
      to.reason = TrustReason::trusted;
    } else if (resting_) {
      to.reason = TrustReason::resting;
    } else if (run_.share() <= Scalar(0.7)) {
      to.reason = TrustReason::model_does_not_fit;
    } else {
      to.reason = TrustReason::not_precise;
    }
  }

  static void refuse(TrackedValue<Scalar>& value, TrustReason reason) {
    if (value.reason != TrustReason::starting) {
      value.trusted = false;
      value.reason = reason;
    }
  }

  EHSID_RARE void begin_anew() {
    phase_ = Phase::waiting;
    run_.restart();
    waited_ = 0;
    averaged_ = 0;
    peak_ = Scalar(0);
    peak_samples_ = 0;
    thirds_ = paths_ = pulls_ = together_ = Scalar(0);
    last_[0] = last_[1] = last_[2] = before_;
    low_ = high_ = before_;
    resting_ = false;
    known_ = false;
    placed_ = false;
    fitted_ = false;
    suspected_ = false;
    settling_ = 0;
    cooling_ = 0;
  }

  /// Before the first motion: the noise of the sensor, the gain to within a factor, its sign.
  EHSID_RARE void wait(Scalar position) {
    const Scalar third = position - Scalar(3) * last_[0] + Scalar(3) * last_[1] - last_[2];
    const Scalar path = position - before_;
    last_[2] = last_[1];
    last_[1] = last_[0];
    last_[0] = position;
    if (++waited_ <= 3) {
      low_ = high_ = position;
      return;
    }
    thirds_ += third * third;
    paths_ += std::abs(path);
    pulls_ += std::abs(command_at(options_.delay));
    together_ += path * command_at(options_.delay);
    low_ = position < low_ ? position : low_;
    high_ = position > high_ ? position : high_;
    const std::int32_t wanted = samples_of(Scalar(0.3), 40);
    const auto count = static_cast<Scalar>(waited_ - 3);
    const Scalar noise = thirds_ / (Scalar(20) * count);
    const bool moves =
        high_ - low_ > Scalar(10) * std::sqrt(noise) && pulls_ > Scalar(0) && paths_ > Scalar(0);
    if (waited_ - 3 < (wanted < 400 ? wanted : 400)) {
      return;
    }
    if (!moves) {
      if (waited_ > 4 * wanted) {  // what was long ago says nothing of the noise of now
        waited_ = 3;
        low_ = high_ = position;
        thirds_ = paths_ = pulls_ = together_ = Scalar(0);
      }
      return;
    }
    const Scalar mean_path = paths_ / count;
    least_noise_ = Scalar(1e-6) * mean_path * mean_path;
    least_noise_ = least_noise_ > Scalar(1e-30) ? least_noise_ : Scalar(1e-30);
    sign_ = together_ < Scalar(0) ? Scalar(-1) : Scalar(1);
    const Scalar gain = Scalar(0.7) * paths_ / pulls_;
    const std::array<Scalar, 4> deviations{Scalar(1), Scalar(0.35), Scalar(0.55),
                                           Scalar(0.2) * std::sqrt(command_square_)};
    for (int i = 0; i < kStarts; ++i) {
      const Scalar rate = bounded_exp(Scalar(-3.7) + Scalar(0.8) * static_cast<Scalar>(i % kRates));
      bank_[static_cast<std::size_t>(i)].start(gain, rate, Scalar(0.4), deviations, command_square_,
                                               noise > least_noise_ ? noise : least_noise_);
    }
    filter_ = bank_[kRates / 2];
    delay_ = options_.delay;
    reference_ = position;
    leader_ = -1;
    phase_ = Phase::starting;
  }

  /// Every start takes the sample; the most likely one is in charge, and wins once it leads clearly.
  EHSID_RARE Status start(Scalar position) {
    const Scalar measured = sign_ * (position - reference_);
    if (rest_.resting() && bank_[0].state().samples > 10) {
      for (auto& one : bank_) {
        one.settle(measured, command_square_);
      }
      shift(measured, position);
      return Status::no_information;
    }
    typename Filter::Tuning with = tuning();
    with.adaptation = adaptation(bank_[0].state().samples);
    for (auto& one : bank_) {
      one.update(measured, with);
      if (!one.finite()) {
        one.state().likelihood = Scalar(-1e30);
      }
    }
    shift(measured, position);
    const int best = most_likely();
    const auto samples = bank_[0].state().samples;
    if (best != leader_) {
      run_.restart();
    }
    leader_ = best;
    filter_ = bank_[static_cast<std::size_t>(best)];
    delay_ = options_.delay + (best >= kRates ? 1 : 0);
    if (!filter_.finite()) {
      return lost();
    }
    if (samples >= 40) {
      static_cast<void>(run_.take(filter_.state(), sign_ * position, samples_of(Scalar(2), 8)));
    }
    const std::int32_t least = samples_of(Scalar(1.5), 150);
    const std::int32_t most = samples_of(Scalar(9), 150);
    if (samples >= most || (samples >= least && leads(best))) {
      take_charge(best);
    }
    return Status::ok;
  }

  /// One more sample of delay has to be 5 nats more likely.
  Scalar score(int i) const {
    return bank_[static_cast<std::size_t>(i)].state().likelihood -
           (i >= kRates ? Scalar(5) : Scalar(0));
  }
  int most_likely() const {
    int best = 0;
    for (int i = 1; i < kStarts; ++i) {
      best = score(i) > score(best) ? i : best;
    }
    return best;
  }
  /// Whether every start with another omega_n is less likely by 10 nats.
  bool leads(int best) const {
    const auto& first = bank_[static_cast<std::size_t>(best)].state();
    for (const auto& one : bank_) {
      const Scalar apart = bounded_log(one.state().rate / first.rate);
      if (std::abs(apart) > Scalar(0.2) && one.state().likelihood > first.likelihood - Scalar(10)) {
        return false;
      }
    }
    return true;
  }

  /// The winner goes on alone, with the spread of the others as uncertainty. A filter that is linearised anew at each sample
  /// takes itself for too certain (G. Huang, A. Mourikis, S. Roumeliotis, IJRR 29 (2010) 502): it gets some more.
  EHSID_RARE void take_charge(int best) {
    const auto& first = bank_[static_cast<std::size_t>(best)].state();
    Scalar weights = Scalar(0);
    std::array<Scalar, 3> spread{};
    for (const auto& one : bank_) {
      if (!one.finite()) {  // a lost start says nothing of the spread
        continue;
      }
      const Scalar behind = one.state().likelihood - first.likelihood;
      const Scalar root = bounded_exp(behind / Scalar(4));  // down to -16 nats
      const Scalar weight = root * root * root * root;
      const Scalar apart[] = {bounded_log(one.state().gain / first.gain),
                              bounded_log(one.state().rate / first.rate),
                              bounded_log(one.state().damping / first.damping)};
      weights += weight;
      for (std::size_t i = 0; i < 3; ++i) {
        spread[i] += weight * apart[i] * apart[i];
      }
    }
    const Scalar more[] = {Scalar(0.03), Scalar(0.05), Scalar(0.1)};
    for (int i = 0; i < 3; ++i) {
      filter_.covariance(3 + i, 3 + i) +=
          spread[static_cast<std::size_t>(i)] / weights + more[i] * more[i];
    }
    phase_ = Phase::tracking;
    tracked_ = 0;
  }

  Status track(Scalar position) {
    const Scalar measured = sign_ * (position - reference_);
    tracked_ += tracked_ < kMostSamples ? 1 : 0;
    if (resting_) {
      const Scalar noise = std::sqrt(filter_.state().noise);
      const Scalar quiet = rest_.threshold(position);
      // R of a filter that was led astray may be far beyond the noise of now.
      const Scalar most =
          Scalar(8) * noise < Scalar(100) * quiet ? Scalar(8) * noise : Scalar(100) * quiet;
      const Scalar wide = most > quiet ? most : quiet;
      if (std::abs(position - rest_position_) <= wide) {
        rest_position_ += Scalar(0.01) * (position - rest_position_);
        filter_.let_drift(tuning());
        filter_.state().position = Scalar(0);
        reference_ = position;
        return Status::no_information;
      }
      resting_ = false;
      rest_.moved();
      reference_ = position;
      reopen(Scalar(0));
      return Status::ok;
    }
    const bool hold = sine_.sine();
    if (hold && !known_ && !placed_) {
      place();
    }
    placed_ = hold && placed_;
    typename Filter::Tuning with = tuning();
    if (settling_ == 0) {
      with.adaptation = adaptation(filter_.state().samples);
    }
    with.hold_servo = hold;
    const Scalar rate = filter_.state().rate;
    const Scalar damping = filter_.state().damping;
    filter_.update(measured, with);
    if (!filter_.finite()) {
      return lost();
    }
    // The coefficients follow the parameters where these have moved, and at times in any case.
    if (std::abs(filter_.state().rate - rate) + std::abs(filter_.state().damping - damping) * rate >
            Scalar(1e-3) * rate ||
        filter_.state().samples % 8 == 0) {
      filter_.renew();
    }
    settling_ -= settling_ > 0 ? 1 : 0;
    suspected_ = suspected_ && settling_ > 0;
    cooling_ -= cooling_ > 0 ? 1 : 0;
    if (filter_.state().outliers >= Filter::kPatience && cooling_ == 0 && settling_ == 0 &&
        filter_.state().disturbance < Scalar(0.3)) {
      widen(hold);
    }
    // A filter that needed no disturbance and now needs much has lost a servo that changed: the starts find it sooner.
    fitted_ = fitted_ || filter_.state().disturbance < kFitted;
    if (fitted_ && filter_.state().disturbance > kLost) {
      return again();
    }
    shift(measured, position);
    if (rest_.resting()) {
      resting_ = true;
      rest_position_ = position;
      filter_.settle(Scalar(0), command_square_);
      reference_ = position;
      run_.interrupt();
      return Status::ok;
    }
    // A window that ends with an outlier ends with the next good sample.
    const bool good =
        filter_.state().outliers == 0 || filter_.state().outliers >= Filter::kPatience;
    if (good && run_.take(filter_.state(), sign_ * position, samples_of(Scalar(2), 8)) &&
        run_.failures() >= 12 && tracked_ >= samples_of(Scalar(2.5), 450)) {
      return again();
    }
    return Status::ok;
  }

  /// A filter whose numbers are not finite has nothing to tell.
  EHSID_RARE Status lost() {
    filter_ = {};
    return again();
  }

  /// Everything begins anew; servo() tells the old values, not trusted, until there are new ones.
  EHSID_RARE Status again() {
    resets_ += resets_ < kMostSamples ? 1 : 0;
    begin_anew();
    return Status::reset;
  }

  /// Four innovations in a row beyond four deviations: the plant has changed, and neither noise is to blame for a while.
  EHSID_RARE void widen(bool hold) {
    constexpr Scalar kWider = Scalar(0.04);
    filter_.covariance(3, 3) += kWider;
    if (!hold) {
      filter_.covariance(4, 4) += kWider / Scalar(4);
      filter_.covariance(5, 5) += kWider;
    }
    settling_ = static_cast<std::int32_t>(Scalar(8) / filter_.state().rate) + 1;
    suspected_ = true;
    cooling_ = static_cast<std::int32_t>(Scalar(20) / filter_.state().rate) + 1;
  }

  /// One sine shows size and phase of the response, and every servo on that curve fits. Where nothing else has been seen, the
  /// filter is moved along the curve to xi = 0.45, and K gets the uncertainty of that choice.
  EHSID_RARE void place() {
    constexpr Scalar kDamping = Scalar(0.45);
    auto& state = filter_.state();
    const Scalar angle2 = sine_.squared_angle();
    const Scalar ratio2 = angle2 / (state.rate * state.rate);
    const Scalar real = Scalar(1) - ratio2;
    const Scalar imaginary2 = Scalar(4) * state.damping * state.damping * ratio2;
    const Scalar size2 = Scalar(1) / (real * real + imaginary2);
    const Scalar positive = real > Scalar(0.05) ? real : Scalar(0.05);
    Scalar tangent = std::sqrt(imaginary2) / positive;
    tangent = (tangent < Scalar(2) ? tangent : Scalar(2)) + Scalar(1e-6);
    // tangent = 2 xi r / (1 - r^2)
    const Scalar r = (std::sqrt(kDamping * kDamping + tangent * tangent) - kDamping) / tangent;
    const Scalar r2 = r * r > Scalar(1e-4) ? r * r : Scalar(1e-4);
    const Scalar new_size2 =
        (Scalar(1) - r2) * (Scalar(1) - r2) + Scalar(4) * kDamping * kDamping * r2;
    state.gain *= std::sqrt(size2 * new_size2);
    state.damping = kDamping;
    const Scalar rate = std::sqrt(angle2 / r2);
    state.rate = rate < Scalar(0.01) ? Scalar(0.01) : rate > Scalar(3) ? Scalar(3) : rate;
    filter_.renew();
    for (int i = 3; i < 6; ++i) {
      for (int j = 0; j < Filter::kStates; ++j) {
        filter_.covariance(i, j) = Scalar(0);
      }
    }
    const Scalar deviation = Scalar(2.5) * r2 + Scalar(0.02);
    filter_.covariance(3, 3) = deviation * deviation;
    filter_.covariance(4, 4) = Scalar(0.25);
    filter_.covariance(5, 5) = Scalar(0.25);
    placed_ = true;
    run_.restart();
  }

  /// The states of motion are open again: behind a hole, or as the servo begins to move.
  EHSID_RARE void reopen(Scalar position) {
    const Scalar shifted = command_at(delay_) - filter_.state().bias;
    const Scalar square = shifted * shifted > command_square_ ? shifted * shifted : command_square_;
    filter_.settle(position, square);
    if (phase_ == Phase::starting) {
      for (auto& one : bank_) {
        one.settle(position, square);
      }
    }
    run_.interrupt();
    settling_ = 12;
    suspected_ = false;
  }

  /// The reference of the position follows the measured one, so that float32 loses no digits far from zero; not an outlier.
  void shift(Scalar measured, Scalar position) {
    if (phase_ == Phase::starting) {
      for (auto& one : bank_) {
        one.state().position -= measured;
      }
      reference_ = position;
    } else if (filter_.state().outliers == 0 || filter_.state().outliers >= Filter::kPatience) {
      filter_.state().position -= measured;
      reference_ = position;
    }
  }

  /// What a filter is told while neither noise is adapted.
  typename Filter::Tuning tuning() const {
    return {options_.drift * options_.drift * options_.dt_s, command_square_, least_noise_,
            Scalar(0), false};
  }

  /// Step of the noise: the larger of 1 / (k + 60) and 0.3 / (1 s or 200 samples), at most 0.01; twice as fast and without
  /// that limit while the starts compete, whose likelihoods mean little before the noise is right.
  Scalar adaptation(std::int32_t samples) const {
    const bool starting = phase_ == Phase::starting;
    const Scalar slow = Scalar(0.3) / static_cast<Scalar>(samples_of(Scalar(1), 200));
    const Scalar fast = Scalar(starting ? 2 : 1) / (static_cast<Scalar>(samples) + Scalar(60));
    const Scalar step = fast > slow ? fast : slow;
    const Scalar most = starting ? Scalar(1) : Scalar(0.01);
    return step < most ? step : most;
  }

  /// The command that acts until the next sample, and what it says of itself.
  void move_on(Scalar command) {
    Scalar newer = command;
    for (Scalar& kept : commands_) {
      const Scalar older = kept;
      kept = newer;
      newer = older;
    }
    if (!resting_) {
      averaged_ += averaged_ < kMostSamples ? 1 : 0;
      const Scalar step = Scalar(1) / static_cast<Scalar>(averaged_);
      const Scalar least = options_.dt_s / Scalar(2);
      const Scalar share = step > least ? step : least < Scalar(1) ? least : Scalar(1);
      command_square_ += share * (command * command - command_square_);
      // A mean that remembers commands far beyond those of the last 400 samples is theirs.
      peak_ = command * command > peak_ ? command * command : peak_;
      if (++peak_samples_ >= 400) {
        if (peak_ > Scalar(0) && command_square_ > Scalar(1e3) * peak_) {
          command_square_ = peak_;
        }
        peak_ = Scalar(0);
        peak_samples_ = 0;
      }
    }
    if (phase_ == Phase::waiting) {
      return;
    }
    const Scalar apart = Scalar(1) / filter_.state().rate + Scalar(0.5);
    const auto spacing = static_cast<std::int32_t>(apart > Scalar(1) ? apart : Scalar(1));
    sine_.take(command, spacing, options_.dt_s * Scalar(0.2));
    if (sine_.clearly_none() && sine_.samples_not_sine() > samples_of(Scalar(5), 1) &&
        phase_ == Phase::tracking && run_.windows() > Scalar(4) &&
        kHalfInterval * std::sqrt(filter_.covariance(4, 4)) < Scalar(1.5) * options_.tolerance) {
      known_ = true;
    }
    const typename Filter::Tuning with = tuning();
    if (phase_ == Phase::starting) {
      for (int i = 0; i < kStarts; ++i) {
        auto& one = bank_[static_cast<std::size_t>(i)];
        if (one.state().samples % 8 == 0) {
          one.renew();
        }
        one.predict(command_at(options_.delay + (i >= kRates ? 1 : 0) - 1), with);
      }
      run_.predict(filter_, command_at(delay_ - 1));
    } else if (!resting_) {
      run_.predict(filter_, command_at(delay_ - 1));
      filter_.predict(command_at(delay_ - 1), with);
    }
  }

  /// The command of so many samples ago; 0 is the last one.
  Scalar command_at(std::int32_t ago) const { return commands_[static_cast<std::size_t>(ago)]; }

  // All zero before configure(): an estimator that is static costs no flash for its start.
  Options options_{Scalar(0), 0, Scalar(0), Scalar(0)};
  Scalar per_second_ = Scalar(0);  // samples
  Filter filter_{};
  RestDetector<Scalar> rest_{};
  FreeRun<Scalar> run_{};
  SingleSine<Scalar> sine_{};
  std::array<Scalar, static_cast<std::size_t>(kMaxDelay) + 2> commands_{};  // newest first
  std::array<Scalar, 3> last_{};                                            // positions
  Scalar before_ = Scalar(0);
  Scalar reference_ = Scalar(0);  // the state's position is relative to this
  Scalar rest_position_ = Scalar(0);
  Scalar command_square_ = Scalar(0);
  Scalar least_noise_ = Scalar(0);
  Scalar sign_ = Scalar(0);
  Scalar thirds_ = Scalar(0);
  Scalar paths_ = Scalar(0);
  Scalar pulls_ = Scalar(0);
  Scalar together_ = Scalar(0);
  Scalar low_ = Scalar(0);
  Scalar high_ = Scalar(0);
  std::int32_t averaged_ = 0;  // commands in their mean square
  std::int32_t waited_ = 0;
  Scalar peak_ = Scalar(0);
  std::int32_t peak_samples_ = 0;
  std::int32_t tracked_ = 0;   // samples since the bank has decided
  std::int32_t settling_ = 0;  // samples for which the noise is not adapted
  std::int32_t cooling_ = 0;   // samples for which the variances are not widened again
  std::int32_t resets_ = 0;
  std::int32_t delay_ = 0;
  std::int32_t leader_ = 0;
  Phase phase_ = Phase::waiting;
  bool started_ = false;
  bool hole_ = false;
  bool resting_ = false;
  bool known_ = false;      // omega_n and xi were seen under a command that is no sine
  bool suspected_ = false;  // a change of the plant, since the variances were widened
  bool fitted_ = false;     // the disturbance was small once
  bool placed_ = false;     // moved along the curve of one sine
  std::array<Filter, static_cast<std::size_t>(kStarts)> bank_{};  // last: the others are near
};

}  // namespace ehsid
