// SPDX-License-Identifier: MIT
// K, omega_n and xi of a servo while it runs, each with an interval and a word on whether it can be trusted, from the command
// and the position of a noisy sensor: ServoFilter with a bank of starts, a rule for rest, a check by free runs and a way to
// begin anew. The measured figures, and when the estimator of Eq. (8) is the better choice: docs/which_estimator.md.
//
// This file has what is called and what is kept. The headers at its end have the bodies of the longer functions.
#pragma once

#include <ehsid/free_run.hpp>
#include <ehsid/servo_discretisation.hpp>
#include <ehsid/servo_filter.hpp>
#include <ehsid/servo_rest.hpp>
#include <ehsid/servo_starts.hpp>
#include <ehsid/single_sine.hpp>
#include <ehsid/snapshot.hpp>
#include <ehsid/tracked_servo.hpp>
#include <ehsid/types.hpp>

#include <array>
#include <cmath>
#include <limits>

namespace ehsid {

/// Static memory, no heap, bounded time. kMaxDelay: the longest delay that can be chosen.
///
/// The constants below were set on 480 simulated servos, half of them nonlinear; the figures of the page are of others.
template <class Scalar_, int kMaxDelay = 4>
class ServoEstimator {
 public:
  using Scalar = Scalar_;
  using Options = ServoEstimatorOptions<Scalar>;
  using Filter = ServoFilter<Scalar>;
  using Starts = ServoStarts<Scalar>;

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
    filter_ = {};
    starts_.clear();
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
  /// configure(); invalid_input or out_of_range, where nothing has changed but that the next good sample is taken as the
  /// first behind a hole.
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
  EHSID_RARE TrackedServo<Scalar> servo() const;

  /// Eq. (6) of servo(): theta = (a1, a2, a3, b1, b2, b3), where b1 belongs to the command of delay() samples ago, and its
  /// covariance J P J'. Its intervals are as wide as those of servo(). `Real` may be double where Scalar is float: a servo that
  /// is sampled fast shows in the last digits of a1, a2, a3. filling before there are values, or a status of discretise();
  /// nothing is changed then.
  template <class Real>
  EHSID_RARE Status model(Vector<Real, 6>& theta, SquareMatrix<Real, 6>& covariance) const;

  /// Standing still: the parameters wait.
  bool resting() const { return resting_; }
  /// How often all began anew since configure().
  std::int32_t resets() const { return resets_; }
  const Options& options() const { return options_; }
  /// The filter in charge; before its start the most likely one.
  const Filter& filter() const { return filter_; }
  /// Effective delay in samples: the stated one, or one more.
  std::int32_t delay() const { return delay_; }

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

  /// For the snapshot: the members in the order of its bytes.
  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&ServoEstimator::options_);
    visit(&ServoEstimator::per_second_);
    visit(&ServoEstimator::filter_);
    visit(&ServoEstimator::starts_);
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
    visit(&ServoEstimator::pushed_);
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

 private:
  enum class Phase : std::uint8_t { waiting, starting, tracking };

  /// Disturbance below which a filter fits its servo, and beyond which such a filter has lost it.
  static constexpr Scalar kFitted = Scalar(0.02);
  static constexpr Scalar kLost = Scalar(0.6);
  static constexpr Scalar kHalfInterval = Scalar(1.645);  // of 90 %, in deviations
  static constexpr std::uint32_t kMagic = 0x45485356U;    // "EHSV"

  /// As a model without outputs, whose commands reach back by the delay and one more.
  static constexpr ModelShape shape(std::int32_t delay) { return {0, 2, delay, false}; }

  // servo_estimator_start.hpp
  EHSID_RARE void begin_anew();
  EHSID_RARE Status again();
  EHSID_RARE Status lost();
  EHSID_RARE void wait(Scalar position);
  EHSID_RARE Status start(Scalar position);
  EHSID_RARE void take_charge(int best);

  // servo_estimator_track.hpp
  Status track(Scalar position);
  EHSID_RARE void keep();
  EHSID_RARE void forget_the_stop(Scalar position);
  EHSID_RARE Status rest(Scalar position);
  EHSID_RARE void widen(bool hold);
  EHSID_RARE void place();
  EHSID_RARE Status seek(Scalar position);
  EHSID_RARE void reopen(Scalar position);
  void shift(Scalar measured, Scalar position);
  void move_on(Scalar command);
  typename Filter::Tuning tuning() const;
  Scalar adaptation(std::int32_t samples) const;
  EHSID_ONCE std::int32_t samples_of(Scalar seconds, std::int32_t least) const;

  // servo_estimator_told.hpp
  EHSID_RARE void set(TrackedValue<Scalar>& to, Scalar value, Scalar variance, Scalar times) const;
  static void refuse(TrackedValue<Scalar>& value, TrustReason reason);

  // servo_estimator_saved.hpp
  SnapshotHeader header() const;
  SnapshotFault read(const std::uint8_t* bytes, std::size_t count, const Options& own);
  bool saves_as(const std::uint8_t* bytes, std::size_t count) const;
  bool possible() const;

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
  std::array<Scalar, 2> last_{};  // positions of two and three samples ago, waiting
  Scalar before_ = Scalar(0);     // the position of a sample ago
  Scalar reference_ = Scalar(0);  // of the state's position; while it waits, behind the position
  Scalar rest_position_ = Scalar(0);   // where the servo stands still
  Scalar command_square_ = Scalar(0);  // mean, without rest
  Scalar least_noise_ = Scalar(0);
  Scalar sign_ = Scalar(0);  // of K
  // While it waits for a motion: sums, and the range of the positions.
  Scalar thirds_ = Scalar(0);    // squares of third differences
  Scalar paths_ = Scalar(0);     // sizes of the paths
  Scalar pulls_ = Scalar(0);     // sizes of the commands
  Scalar pushed_ = Scalar(0);    // commands, with a short memory
  Scalar together_ = Scalar(0);  // those times the way, with the same memory
  Scalar low_ = Scalar(0);
  Scalar high_ = Scalar(0);
  std::int32_t averaged_ = 0;      // commands in their mean square
  std::int32_t waited_ = 0;        // samples in these sums, and the three before them
  Scalar peak_ = Scalar(0);        // largest squared command of the last 400 samples at most
  std::int32_t peak_samples_ = 0;  // how many of them
  std::int32_t tracked_ = 0;       // samples since the bank has decided
  std::int32_t settling_ = 0;      // samples for which the noise is not adapted
  std::int32_t cooling_ = 0;       // samples for which the variances are not widened again
  std::int32_t resets_ = 0;
  std::int32_t delay_ = 0;  // the stated one or one more
  std::int32_t leader_ =
      0;  // the most likely start, -1: none yet; then the place of the newer state that is kept
  Phase phase_ = Phase::waiting;
  bool started_ = false;
  bool hole_ = false;  // the last sample was refused
  bool resting_ = false;
  bool known_ = false;      // omega_n and xi were seen under a command that is no sine
  bool suspected_ = false;  // a change of the plant, since the variances were widened
  bool fitted_ = false;     // the disturbance was small once
  bool placed_ = false;     // moved along the curve of one sine, and no other command since
  Starts starts_{};         // last, so that the others are near to one address
};

}  // namespace ehsid

#include <ehsid/servo_estimator_saved.hpp>
#include <ehsid/servo_estimator_start.hpp>
#include <ehsid/servo_estimator_told.hpp>
#include <ehsid/servo_estimator_track.hpp>
