// SPDX-License-Identifier: MIT
// The estimator a controller links: ARX regressor, RLS, reset, and monitors of convergence and whiteness behind one call.
#pragma once

#include <ehsid/arx.hpp>
#include <ehsid/forgetting.hpp>
#include <ehsid/monitor.hpp>
#include <ehsid/parts.hpp>
#include <ehsid/reset.hpp>
#include <ehsid/rls.hpp>
#include <ehsid/scaling.hpp>
#ifndef EHSID_WITHOUT_EIGEN
#include <ehsid/servo_model.hpp>
#endif
#include <ehsid/snapshot.hpp>
#include <ehsid/whiteness.hpp>

#include <array>
#include <type_traits>

namespace ehsid {

/// Settings of an OnlineEstimator. Every default is usable; give at least the scaling.
/// Recursion: options of the recursion, RlsOptions but for that of instrumental_variables.hpp.
template <class Scalar, int kN, class Forgetting, class Recursion = RlsOptions<Scalar>>
struct EstimatorOptions {
  Scaling<Scalar> scaling{};
  Forgetting forgetting{};
  Recursion rls{};
  RmseResetOptions<Scalar> reset{};
  ConvergenceOptions<Scalar> convergence{};
  /// Not read by a recursion with a running model, which begins anew by itself.
  bool reset_enabled = true;
  /// Start values in the units of the signals, and their variances in scaled units and units of sigma^2.
  Vector<Scalar, kN> theta0 = Vector<Scalar, kN>::Zero(capacity(kN));
  Vector<Scalar, kN> variance0 = Vector<Scalar, kN>::Constant(capacity(kN), Scalar(1e6));
  /// Largest plausible |scaled command| or |scaled position|: beyond it a sample is refused.
  Scalar input_limit = Scalar(1e4);

  /// All but theta0 and variance0, which the recursion checks, and those of parts that are left out.
  template <class Parts = AllParts>
  bool valid() const {
    return scaling.valid() && forgetting.valid() && rls.valid() &&
           (!Parts::kReset || reset.valid()) && (!Parts::kConvergence || convergence.valid()) &&
           is_finite(input_limit) && input_limit > Scalar(0);
  }
};

/// Online identification of a model whose regressor is made from commands and positions.
///
/// Model: Arx<...>, or a class with the same members. Forgetting: see forgetting.hpp. Recursion: Rls, or
/// InstrumentalVariables for a noisy position sensor. The estimator has the parts of its recursion, see parts.hpp; options
/// of a part that is left out are not read.
template <class Model_, class Forgetting_,
          class Recursion_ = Rls<typename Model_::Scalar, Model_::kN, Forgetting_>>
class OnlineEstimator {
 public:
  using Model = Model_;
  using Forgetting = Forgetting_;
  using Scalar = typename Model::Scalar;
  static constexpr int kN = Model::kN;
  using Recursion = Recursion_;
  using Parts = typename Recursion::Parts;
  using Options = EstimatorOptions<Scalar, kN, Forgetting, typename Recursion::Options>;
  using Parameters = Vector<Scalar, kN>;
  using Covariance = SquareMatrix<Scalar, kN>;
  using Reset = std::conditional_t<Parts::kReset, RmseReset<Scalar>, NoMonitor>;
  using Convergence =
      std::conditional_t<Parts::kConvergence, ConvergenceMonitor<Scalar>, NoMonitor>;
  using Whiteness = std::conditional_t<Parts::kWhiteness, WhitenessMonitor<Scalar>, NoMonitor>;
  static_assert(Parts::kStart || !Parts::kReset, "a reset needs the start values: kStart");

  /// What a snapshot holds behind its header, in this order. A copy of an estimator's state, so that settings of the
  /// policy and sizes, which are not saved, are there before the rest is read.
  struct Contents {
    std::uint8_t enabled;
    typename Recursion::State recursion;
    typename Model::State history;
    typename Reset::State reset;
    typename Convergence::State convergence;
    typename Whiteness::State whiteness;

    template <class Visit>
    EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
      visit(&Contents::enabled);
      visit(&Contents::recursion);
      visit(&Contents::history);
      visit(&Contents::reset);
      visit(&Contents::convergence);
      visit(&Contents::whiteness);
    }
  };

  /// Bytes of a snapshot; where the orders are chosen at run time, the most that there can be.
  static constexpr std::size_t kSnapshotBytes = ehsid::snapshot_bytes<Contents>(Model::kLargest);
  /// The whole state as bytes: store them, restore them into an estimator with the same options, on any machine.
  using Snapshot = std::array<std::uint8_t, kSnapshotBytes>;

  OnlineEstimator() { static_cast<void>(configure(Options{})); }
  explicit OnlineEstimator(const Model& model) : model_(model) {
    Options options;
    options.theta0 = Parameters::Zero(model_.size());
    options.variance0 = Parameters::Constant(model_.size(), Recursion::kDefaultVariance);
    static_cast<void>(configure(options));
  }

  /// Takes the options over and starts anew from them. invalid_argument leaves everything as it was.
  Status configure(const Options& options) {
    if (!options.template valid<Parts>() || options.theta0.size() != model_.size()) {
      return Status::invalid_argument;
    }
    if (start(scaled(options.theta0, options.scaling), options.variance0) != Status::ok) {
      return Status::invalid_argument;
    }
    // Their options have been checked: these cannot refuse.
    static_cast<void>(recursion_.configure(options.forgetting, options.rls));
    if constexpr (Parts::kReset) {
      static_cast<void>(reset_.configure(options.reset));
    }
    if constexpr (Parts::kConvergence) {
      static_cast<void>(monitor_.configure(options.convergence));
    }
    scaling_ = options.scaling;
    input_limit_ = options.input_limit;
    reset_enabled_ = options.reset_enabled;
    enabled_ = true;
    forget_samples();
    whiteness_.restart();
    return Status::ok;
  }

  /// Starts anew from an estimate made elsewhere, e.g. offline, after configure().
  ///
  /// theta in the units of the signals; P = U D U' in scaled units and units of sigma^2; sigma^2 in squared
  /// units of the position, 0 for unknown. Where sigma^2 is known, errors far beyond it raise the reset from the
  /// first sample on: the plant is not the one that was known. A reset, then or later, goes back to variance0
  /// of the options, not to this P. invalid_argument leaves everything as it was.
  Status seed(const Parameters& theta, const UdFactors<Scalar, kN>& factors,
              Scalar noise_variance) {
    const Scalar scaled_variance =
        noise_variance / scaling_.position_scale / scaling_.position_scale;
    if (recursion_.seed(scaled(theta, scaling_), factors, scaled_variance) != Status::ok) {
      return Status::invalid_argument;
    }
    if constexpr (Parts::kReset) {
      reset_.restart(scaled_variance);
    }
    monitor_.restart();
    forget_samples();
    whiteness_.restart();
    return Status::ok;
  }

  /// One sample: the command sent at t_k and the position measured at t_k, in the units of the scaling.
  ///
  /// ok, filling, no_information, disabled, reset, or an error. After invalid_input and out_of_range, which a recursion with
  /// a running model also says of a glitch,
  /// the estimate is bit for bit what it was; the history has a hole, so it fills anew before
  /// the next estimate.
  Status step(Scalar command, Scalar position) {
    if (!is_finite(command) || !is_finite(position)) {
      forget_samples();
      return Status::invalid_input;
    }
    const Scalar u = scaling_.scale_command(command);
    const Scalar y = scaling_.scale_position(position);
    if (!plausible(u) || !plausible(y)) {
      forget_samples();
      return Status::out_of_range;
    }
    model_.advance_command(u);
    Status status = enabled_ ? Status::filling : Status::disabled;
    if (enabled_ && model_.ready()) {
      if constexpr (Model::kIntegrates) {
        status = estimate(model_.regressor(), model_.output(y));
      } else {
        status = estimate(model_.regressor(), y);
      }
      if (status == Status::out_of_range) {
        forget_samples();
        return status;
      }
    } else {
      whiteness_.interrupted();
    }
    model_.advance_output(y);
    return status;
  }

  /// Bumpless: while switched off the history moves on, so estimation resumes with the first sample.
  void enable(bool on) {
    if constexpr (Recursion::kFollowsModel) {
      recursion_.clear_history();  // its filters see no sample while switched off
    }
    enabled_ = on;
  }
  bool enabled() const { return enabled_; }

  /// lambda and P back to their start values, theta kept (Fig. 4).
  void reset() {
    recursion_.reset();
    monitor_.restart();
    whiteness_.restart();
  }

  /// (a1 .. a_na, b1 .. b_nb [, c]) in the units of the signals (about the offsets of the scaling).
  Parameters theta_hat() const { return in_units(recursion_.theta_hat()); }

  /// Standard deviations of theta_hat, in the same units: roots of the diagonal of covariance(). Where the residuals are
  /// not white theta is biased, and the true value may lie further away.
  Parameters standard_deviation() const {
    Parameters deviation = recursion_.standard_deviation();
    const Scalar inflation = inflated();
    for (int i = 0; i < model_.size(); ++i) {
      deviation[i] = bounded_product(deviation[i], inflation);
    }
    return in_units(deviation);
  }

  /// The covariance of theta_hat in the same units: Rls::parameter_variance() P where the residuals are white, else this
  /// times the square of whiteness().inflation(), so that what is made of it knows of the residuals, too.
  Covariance covariance() const {
    Covariance p = recursion_.P();
    const Scalar inflation = inflated();
    const Scalar variance = bounded_product(recursion_.parameter_variance(), inflation * inflation);
    for (int i = 0; i < model_.size(); ++i) {
      for (int j = 0; j < model_.size(); ++j) {
        const Scalar scale = bounded_product(bounded_product(variance, unit(i)), unit(j));
        p(i, j) = bounded_product(p(i, j), scale);
      }
    }
    return p;
  }

#ifndef EHSID_WITHOUT_EIGEN
  /// K, omega_n and xi of the servo that theta_hat() is, with deviations from covariance(): identify_servo() of the two,
  /// without the constant term where there is one. With what the residuals say, where the parts for it are there: with
  /// noise on the position sensor those of least squares are not white, and a ServoEstimator is what to take.
  ///
  /// dt_s: sampling period, s, > 0. For na = nb = 3, or na = 2 beside a known integrator, and nk >= 1; other orders are an
  /// error of the compiler, or where they are chosen at run time invalid_argument in the status. It takes about 1 kB of
  /// stack: call it from a background task.
  template <class Of = Model>
  ServoReading<Scalar> servo(Scalar dt_s) const {
    constexpr int kOfServo = Of::kIntegrates ? 5 : 6;
    static_assert(Of::kOrdersAtRunTime || has_orders_of_servo(Of::kLargest.na, Of::kLargest.nb,
                                                              Of::kLargest.nk, Of::kIntegrates),
                  "servo() reads a model of third order: na = 3 (2 beside a known integrator), nb "
                  "= 3, nk >= 1");
    ServoReading<Scalar> reading;
    if (!has_orders_of_servo(model_.na(), model_.nb(), model_.nk(), Of::kIntegrates)) {
      reading.status = ServoReadingStatus::invalid_argument;
      return reading;
    }
    const Parameters all = theta_hat();
    const Covariance spread_of_all = covariance();
    const Vector<Scalar, kOfServo> theta = all.template head<kOfServo>();
    const SquareMatrix<Scalar, kOfServo> spread =
        spread_of_all.template topLeftCorner<kOfServo, kOfServo>();
    if constexpr (Of::kIntegrates) {
      reading = identify_integrating_servo(theta, spread, dt_s);
    } else {
      reading = identify_servo(theta, spread, dt_s);
    }
    if constexpr (Parts::kConvergence && Parts::kWhiteness) {
      judge(reading, whiteness_.white(), settled(), converged(), residual_variance());
    }
    return reading;
  }
#endif

  /// position(k+1) .. position(k+kSteps) predicted after step k, on the commands of the same samples, with
  /// theta_hat of now. Only meaningful once the history is full, see Model::ready().
  template <int kSteps>
  Vector<Scalar, kSteps> predict_ahead(const Vector<Scalar, kSteps>& commands) const {
    Vector<Scalar, kSteps> scaled;
    for (int i = 0; i < kSteps; ++i) {
      scaled[i] = scaling_.scale_command(commands[i]);
    }
    Vector<Scalar, kSteps> positions =
        model_.template predict_ahead<kSteps>(recursion_.theta_hat(), scaled);
    for (int i = 0; i < kSteps; ++i) {
      positions[i] = scaling_.unscale_position(positions[i]);
    }
    return positions;
  }

  /// epsilon(k) of the last estimated sample, in units of the position.
  Scalar innovation() const {
    return bounded_product(recursion_.innovation(), scaling_.position_scale);
  }
  Scalar forgetting_factor() const { return recursion_.forgetting_factor(); }
  /// sigma^2, in squared units of the position.
  Scalar residual_variance() const {
    return bounded_product(recursion_.residual_variance(),
                           scaling_.position_scale * scaling_.position_scale);
  }
  /// Every deviation of white residuals is inside the tolerance; where the residuals are not white theta may be further
  /// off. See monitor().
  bool settled() const {
    static_assert(Parts::kConvergence, "settled() needs kConvergence among the parts");
    return monitor_.converged();
  }
  /// Settled, and enough samples say that the residuals are white, so that the deviations hold. See whiteness().
  bool converged() const {
    static_assert(Parts::kWhiteness, "converged() needs kWhiteness among the parts");
    return settled() && whiteness_.enough() && whiteness_.white();
  }

  /// Number of parameters.
  int size() const { return model_.size(); }

  const Model& model() const { return model_; }
  const Recursion& recursion() const { return recursion_; }
  const Reset& change_detector() const { return reset_; }
  const Convergence& monitor() const { return monitor_; }
  const Whiteness& whiteness() const { return whiteness_; }
  const Scaling<Scalar>& scaling() const { return scaling_; }

  /// Bytes that save() writes and restore() expects.
  std::size_t snapshot_bytes() const { return ehsid::snapshot_bytes<Contents>(shape()); }

  /// Writes the state to `to`, which has room for snapshot_bytes().
  void save(std::uint8_t* to) const {
    Contents state = contents();
    write_snapshot(to, header(), state);
  }

  Snapshot save() const {
    Snapshot saved{};
    save(saved.data());
    return saved;
  }

  /// What restore() would find wrong with these bytes; SnapshotFault::none where it would take them over.
  SnapshotFault check(const std::uint8_t* bytes, std::size_t count) const {
    Contents found = contents();
    return read(bytes, count, found);
  }

  /// Takes over `count` bytes that save() wrote. invalid_argument, and nothing changed, where check() finds a fault: a
  /// snapshot that is damaged, or of another version, model, precision, policy or configuration.
  Status restore(const std::uint8_t* bytes, std::size_t count) {
    Contents found = contents();
    if (read(bytes, count, found) != SnapshotFault::none) {
      return Status::invalid_argument;
    }
    // The states have been checked: these cannot refuse.
    static_cast<void>(recursion_.restore(found.recursion));
    static_cast<void>(model_.restore(found.history));
    static_cast<void>(reset_.restore(found.reset));
    static_cast<void>(monitor_.restore(found.convergence));
    static_cast<void>(whiteness_.restore(found.whiteness));
    enabled_ = found.enabled == 1;
    return Status::ok;
  }

  Status restore(const Snapshot& saved) { return restore(saved.data(), snapshot_bytes()); }

 private:
  template <class, class>
  friend class bank::Estimators;

  static constexpr std::uint32_t kMagic = 0x45485331U;  // "EHS1"

  Status estimate(const Parameters& phi, Scalar y) {
    Array<Scalar, kN> variances;
    const Status status = update(phi, y, variances);
    const Scalar leaving = phi[model_.na() + model_.nb() - 1];
    if (status == Status::no_information) {
      monitor_.skipped();
      whiteness_.skipped(leaving);
      return status;
    }
    if constexpr (Recursion::kFollowsModel) {
      if (status == Status::reset) {  // the recursion has begun anew by itself
        reset_.raise();
        monitor_.restart();
        whiteness_.restart();
        return status;
      }
    }
    if (status != Status::ok) {
      whiteness_.interrupted();
      return status;
    }
    if constexpr (Recursion::kFollowsModel) {
      monitor_.updated(recursion_.judged(), variances);
      // The errors of the start are not those of the method.
      if (recursion_.settled()) {
        whiteness_.updated(recursion_.judged(), leaving, Recursion::kOwnColour);
      }
      return status;
    } else {
      monitor_.updated(recursion_, variances);
      whiteness_.updated(recursion_, leaving);
      return watch(phi);
    }
  }

  /// The recursion's update, with all P_ii where a monitor reads them.
  EHSID_ALWAYS_INLINE Status update(const Parameters& phi, Scalar y, Array<Scalar, kN>& variances) {
    if constexpr (Parts::kConvergence) {
      return recursion_.update(phi, y, variances);
    } else {
      return recursion_.update(phi, y);
    }
  }

  /// After a step that was kept: has the plant changed?
  Status watch(const Parameters& phi) {
    if constexpr (!Recursion::kFollowsModel) {  // which begins anew by itself
      bool moved = false;
      if constexpr (Parts::kWhiteness) {
        moved = whiteness_.moved_far(recursion_, dot(size(), phi, recursion_.state().gain));
      }
      if constexpr (Parts::kReset) {
        if (reset_enabled_ && reset_.update(recursion_.normalised_square(), keeps())) {
          // The noise as it was before the change, not as its errors make it look.
          recursion_.reset(reset_.long_rmse() * reset_.long_rmse());
          monitor_.restart();
          whiteness_.restart();
          return Status::reset;
        }
        if (reset_enabled_ && moved) {
          reset_.suspect();
        }
      }
    }
    return Status::ok;
  }

  /// Does theta keep for long what it has learned, whatever the errors?
  bool keeps() const {
    if constexpr (Recursion::kFollowsModel || Forgetting::kFollowsErrors) {
      return false;
    } else {
      return recursion_.state().forgetting.loss() < RmseReset<Scalar>::kForgets;
    }
  }

  Status start(const Parameters& theta0, const Parameters& variance0) {
    if constexpr (Recursion::kFollowsModel) {
      return recursion_.start(theta0, variance0, model_.na());
    } else {
      return recursion_.start(theta0, variance0);
    }
  }

  /// Factor of the deviations where the residuals are not white.
  Scalar inflated() const {
    if constexpr (Parts::kWhiteness) {
      return whiteness_.inflation();
    } else {
      return Scalar(1);
    }
  }

  /// There is a hole in the record, or it begins: the regressor fills anew.
  void forget_samples() {
    model_.clear();
    if constexpr (Recursion::kFollowsModel) {
      recursion_.clear_history();
    }
  }

  ModelShape shape() const { return {model_.na(), model_.nb(), model_.nk(), model_.offset()}; }

  SnapshotHeader header() const {
    return make_header<Scalar, Forgetting, Contents>(kMagic, shape(), configuration());
  }

  Contents contents() const {
    return {static_cast<std::uint8_t>(enabled_ ? 1 : 0),
            recursion_.state(),
            model_.state(),
            reset_.state(),
            monitor_.state(),
            whiteness_.state()};
  }

  /// Checksum of every option that decides how the estimator goes on. Not theta0, which only a start uses, and no option
  /// of the reset where that is switched off.
  std::uint32_t configuration() const {
    const ModelShape of = shape();
    ByteStream writer = ByteStream::writing(nullptr);
    recursion_.write_configuration(writer, of);
    stream_fields(writer, of, scaling_);
    if constexpr (Parts::kConvergence) {
      stream_fields(writer, of, monitor_.options());
    }
    const std::uint8_t enabled = reset_enabled_ ? 1 : 0;
    writer.values(&input_limit_, 1);
    writer.values(&enabled, 1);
    if constexpr (Parts::kReset) {
      if (reset_enabled_) {
        stream_fields(writer, of, reset_.options());
      }
    }
    return writer.checksum();
  }

  SnapshotFault read(const std::uint8_t* bytes, std::size_t count, Contents& found) const {
    const SnapshotFault fault = read_snapshot(bytes, count, header(), found);
    return fault != SnapshotFault::none || possible(found) ? fault : SnapshotFault::impossible;
  }

  /// Can an estimator with these options have this state? Then the numbers it reports are finite, too.
  bool possible(const Contents& found) const {
    return found.enabled <= 1 && recursion_.usable(found.recursion) &&
           model_.usable(found.history) && plausible(found.history) && Reset::usable(found.reset) &&
           Convergence::usable(found.convergence) && Whiteness::usable(found.whiteness);
  }

  bool plausible(const typename Model::State& history) const {
    bool good = true;
    if constexpr (!Model::kIntegrates) {
      for (const Scalar output : history.outputs) {
        good = plausible(output) && good;
      }
      for (const Scalar command : history.commands) {
        good = plausible(command) && good;
      }
    }
    return good;
  }

  bool plausible(Scalar scaled) const { return scaled <= input_limit_ && scaled >= -input_limit_; }

  Scalar unit(int i) const { return scaling_.parameter_unit(i, model_.na(), model_.nb()); }

  Parameters scaled(Parameters values, const Scaling<Scalar>& scaling) const {
    for (int i = 0; i < model_.size(); ++i) {
      values[i] /= scaling.parameter_unit(i, model_.na(), model_.nb());
    }
    return values;
  }

  Parameters in_units(Parameters values) const {
    for (int i = 0; i < model_.size(); ++i) {
      values[i] = bounded_product(values[i], unit(i));
    }
    return values;
  }

  Model model_{};
  Recursion recursion_{};
  Reset reset_{};
  Convergence monitor_{};
  Whiteness whiteness_{};
  Scaling<Scalar> scaling_{};
  Scalar input_limit_ = Scalar(1);
  bool reset_enabled_ = true;
  bool enabled_ = true;
};

/// The electro-hydraulic servo: ARX(na, nb, nk), third order for Eq. (6): ArxEstimator<float, 3, 3, 1>.
template <class Scalar, int kNa, int kNb, int kNk, class Forgetting = FRatio<Scalar>,
          bool kOffset = false>
using ArxEstimator = OnlineEstimator<Arx<Scalar, kNa, kNb, kNk, kOffset>, Forgetting>;

/// The same with some parts only, see parts.hpp; with none it is the smallest estimator that is still guarded.
template <class Scalar, int kNa, int kNb, int kNk, class Forgetting = Constant<Scalar>,
          class Parts = NoParts, bool kOffset = false>
using SmallArxEstimator =
    OnlineEstimator<Arx<Scalar, kNa, kNb, kNk, kOffset>, Forgetting,
                    Rls<Scalar, kNa + kNb + (kOffset ? 1 : 0), Forgetting, Parts>>;

}  // namespace ehsid
