// SPDX-License-Identifier: MIT
// Estimator for coloured equation noise: A(q^-1) y(k) = q^-nk B(q^-1) u(k) + C(q^-1) e(k), C = 1 + c1 q^-1 + ... + c_na q^-na.
//
//   phi_e(k) = (phi(k), e_hat(k-1) .. e_hat(k-na)),   theta_e = (theta, c1 .. c_na)
//   epsilon(k) = y(k) - phi_e'(k) theta_e(k-1),       e_hat(k) = y(k) - phi_e'(k) theta_e(k)
//   psi(k) = phi_e(k) / C(fading q^-1)                of the running C
//
// Recursive maximum likelihood; extended least squares, psi = phi_e, in the samples of settling.
// Source: L. Ljung, T. Soderstrom, Theory and Practice of Recursive Identification, MIT Press 1983, sec. 3.7 (RML1 with
// residuals a posteriori). Noise of the position sensor is the case C = A: it is covered too, but instruments
// (output_error.hpp) need not estimate C for it.
#pragma once

#include <ehsid/arx.hpp>
#include <ehsid/arx_estimator.hpp>
#include <ehsid/forgetting.hpp>
#include <ehsid/gradient_recursion.hpp>

namespace ehsid {

/// Model of the noise and its filters. Plain data; newest first.
template <class Scalar, int kNa, int kAll>
struct NoiseModelState {
  static constexpr int kOfGradient = capacity(kNa) * capacity(kAll);

  Array<Scalar, kNa> c;            // of the running model: the last stable one
  Array<Scalar, kNa> residuals;    // e_hat(k-1) .. e_hat(k-na)
  Array<Scalar, kOfGradient> psi;  // psi(k-1) .. psi(k-na), one number for each parameter each
  std::int32_t samples;  // taken since the start or a reset, up to the samples of settling
  std::int32_t
      filled;  // samples that the filters have seen without a hole, up to those of settling

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&NoiseModelState::c, each_output);
    visit(&NoiseModelState::residuals, each_output);
    visit(&NoiseModelState::psi, [](const ModelShape& of) { return of.na * of.size(); });
    visit(&NoiseModelState::samples);
    visit(&NoiseModelState::filled);
  }
};

/// Recursion and model of the noise.
template <class Scalar, int kNa, int kAll, class Forgetting>
struct ArmaxState {
  RlsState<Scalar, kAll, Forgetting> recursion;
  NoiseModelState<Scalar, kNa, kAll> noise;

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&ArmaxState::recursion);
    visit(&ArmaxState::noise);
  }
};

/// The recursion for coloured equation noise, see the top of the file. Takes the place of Rls in OnlineEstimator.
///
/// kNa: past outputs in the regressor, and the order of C. kN: parameters of the model. Both > 0, or both up_to(most).
/// update() is transactional: the whole step is computed, checked, and only then kept.
template <class Scalar_, int kNa_, int kN_, class Forgetting_>
class Armax : public GradientRecursion<Scalar_, kNa_, kN_, true, Forgetting_> {
  using Base = GradientRecursion<Scalar_, kNa_, kN_, true, Forgetting_>;

 public:
  using Scalar = Scalar_;
  using Forgetting = Forgetting_;
  static constexpr int kNa = kNa_;
  static constexpr int kN = kN_;
  static constexpr int kAll = Base::kAll;
  using State = ArmaxState<Scalar, kNa, kAll, Forgetting>;
  using Base::na;
  using Base::size;
  using typename Base::Options;
  using typename Base::Parameters;
  using typename Base::Regressor;

  explicit Armax(const Forgetting& forgetting = Forgetting{}, const Options& options = Options{}) {
    if (configure(forgetting, options) != Status::ok) {
      static_cast<void>(configure(Forgetting{}, Options{}));
    }
  }

  /// Sets policy and options; the estimate stays. invalid_argument leaves all as it was.
  Status configure(const Forgetting& forgetting, const Options& options) {
    if (!options.valid() || inner_.configure(forgetting, options.rls) != Status::ok) {
      return Status::invalid_argument;
    }
    options_ = options;
    return Status::ok;
  }

  /// As Rls::start(), for a regressor whose first na entries are past outputs; C starts as 1.
  Status start(const Parameters& theta0, const Parameters& variances, int outputs) {
    const auto n = static_cast<int>(theta0.size());
    if (!Extent<kNa>::accepts(outputs) || outputs > n || variances.size() != n) {
      return Status::invalid_argument;
    }
    Gradient theta = Gradient::Zero(n + outputs);
    Gradient p0 = Gradient::Constant(n + outputs, kNoiseVariance);
    theta.head(n) = theta0;
    p0.head(n) = variances;
    if (inner_.start(theta, p0) != Status::ok) {
      return Status::invalid_argument;
    }
    past_outputs_.resize(outputs);
    state_ = NoiseModelState<Scalar, kNa, kAll>{};
    settle();
    return Status::ok;
  }

  /// As Rls::seed(); C starts as 1.
  Status seed(const Parameters& theta, const UdFactors<Scalar, kN>& factors,
              Scalar noise_variance) {
    const int n = size();
    if (theta.size() != n || factors.size() != n || !factors.usable()) {
      return Status::invalid_argument;
    }
    Gradient all = Gradient::Zero(n + na());
    Gradient diagonal = Gradient::Constant(n + na(), kNoiseVariance);
    for (int i = 0; i < n; ++i) {
      all[i] = theta[i];
      diagonal[i] = factors.d[static_cast<std::size_t>(i)];
    }
    UdFactors<Scalar, kAll> whole;
    if (!whole.set_diagonal(diagonal)) {
      return Status::invalid_argument;
    }
    for (int i = 0; i < n * (n - 1) / 2;
         ++i) {  // the columns of the noise stand behind those of the model
      whole.u[static_cast<std::size_t>(i)] = factors.u[static_cast<std::size_t>(i)];
    }
    const Status status = inner_.seed(all, whole, noise_variance);
    if (status == Status::ok) {
      state_ = NoiseModelState<Scalar, kNa, kAll>{};
      settle();
    }
    return status;
  }

  /// Past samples are missing: the filters start from zero. Past settling nothing is learned from as many samples.
  void clear_history() {
    state_.filled = 0;
    state_.residuals.fill(Scalar(0));
    state_.psi.fill(Scalar(0));
  }

  /// One sample: phi(k) as in Eq. (8) and y(k). As Rls::update(); after no_information, and after filling behind a hole,
  /// only the filters have moved on.
  Status update(const Regressor& phi, Scalar y) {
    const int n = size();
    const int all = n + na();
    Gradient regressor(all);
    for (int i = 0; i < n; ++i) {
      regressor[i] = phi[i];
    }
    for (int i = 0; i < na(); ++i) {
      regressor[n + i] = state_.residuals[static_cast<std::size_t>(i)];
    }
    Gradient psi = regressor;
    if (settled()) {
      const Array<Scalar, kNa> filter = contracted<kNa>(na(), state_.c, options_.fading);
      for (int lag = 0; lag < na(); ++lag) {
        const Scalar f = filter[static_cast<std::size_t>(lag)];
        const Scalar* past = state_.psi.data() + lag * all;
        EHSID_UNROLL
        for (int i = 0; i < all; ++i) {
          psi[i] -= f * past[i];
        }
      }
    }
    const Scalar predicted = inner_.predict(regressor);
    if (!all_squarable(all, psi) || !is_squarable(predicted)) {
      return is_finite(y) && all_finite(n, phi) ? Status::numerical_limit : Status::invalid_input;
    }
    Status status = Status::filling;
    if (!settled() || state_.filled >= options_.settling) {
      status = learn(psi, y, predicted);
    }
    if (is_error(status)) {
      return status;
    }
    // The step is kept. Nothing below can fail.
    if (status == Status::ok) {
      follow();
    }
    state_.filled += state_.filled < options_.settling ? 1 : 0;
    push(psi, residual(regressor, y));
    return status;
  }

  /// lambda and P back to their start values, theta kept; the estimator settles anew.
  void reset() {
    inner_.reset();
    settle();
  }
  /// The same with sigma^2 from elsewhere, see Rls::reset().
  void reset(Scalar noise_variance) {
    inner_.reset(noise_variance);
    settle();
  }

  /// Is psi the gradient of the error, so that sigma^2 P is the covariance of theta?
  bool settled() const { return state_.samples >= options_.settling; }

  /// c1 .. c_na of the running model of the noise.
  Vector<Scalar, kNa> noise_polynomial() const { return to_vector<kNa>(na(), state_.c); }

  State state() const { return {inner_.state(), state_}; }

  void write_configuration(ByteStream& writer, const ModelShape& of) const {
    const std::uint8_t method = 3;
    writer.values(&method, 1);
    write_options(writer, of);
  }

  /// May this saved state be taken over? See Rls::usable().
  bool usable(const State& saved) const {
    const auto& noise = saved.noise;
    return Base::Inner::usable(saved.recursion) && all_squarable(capacity(kNa), noise.c) &&
           all_squarable(capacity(kNa), noise.residuals) &&
           all_squarable(noise.kOfGradient, noise.psi) && noise.samples >= 0 &&
           noise.samples <= options_.settling && noise.filled >= 0 &&
           noise.filled <= options_.settling && roots_inside_unit_circle<kNa>(na(), noise.c);
  }

  /// Takes a saved state over. invalid_argument, and nothing changed, unless it is usable and of this size.
  Status restore(const State& saved) {
    if (!usable(saved) || inner_.restore(saved.recursion) != Status::ok) {
      return Status::invalid_argument;
    }
    state_ = saved.noise;
    return Status::ok;
  }

 private:
  using Base::estimated;
  using Base::inner_;
  using Base::learn;
  using Base::options_;
  using Base::past_outputs_;
  using Base::write_options;
  using typename Base::Gradient;

  // P0 of c, in units of sigma^2: with residuals of 0.01 to 0.1 of the scaled position a deviation of 0.1 to 1. With the
  // P0 of the model the first samples set C anywhere.
  static constexpr Scalar kNoiseVariance = Scalar(100);

  void settle() { state_.samples = 0; }

  /// The running C becomes that of theta, where that is stable.
  void follow() {
    Array<Scalar, kNa> c{};
    for (int i = 0; i < na(); ++i) {
      c[static_cast<std::size_t>(i)] = estimated(size() + i);
    }
    if (roots_inside_unit_circle<kNa>(na(), c)) {
      state_.c = c;
    }
    state_.samples += settled() ? 0 : 1;
  }

  /// e_hat(k), with the running C: it stays bounded where that of theta is unstable.
  Scalar residual(const Gradient& regressor, Scalar y) const {
    const int n = size();
    Scalar rest = y;
    for (int i = 0; i < n; ++i) {
      rest -= regressor[i] * estimated(i);
    }
    for (int i = 0; i < na(); ++i) {
      rest -= regressor[n + i] * state_.c[static_cast<std::size_t>(i)];
    }
    return is_squarable(rest) ? rest : Scalar(0);
  }

  void push(const Gradient& psi, Scalar rest) {
    const int all = size() + na();
    for (int lag = na() - 1; lag >= 0; --lag) {
      const auto at = static_cast<std::size_t>(lag);
      Scalar* to = state_.psi.data() + lag * all;
      for (int i = 0; i < all; ++i) {
        to[i] = lag == 0 ? psi[i] : (to - all)[i];
      }
      state_.residuals[at] = lag == 0 ? rest : state_.residuals[at - 1];
    }
  }

  NoiseModelState<Scalar, kNa, kAll> state_{};
};

/// As ArxEstimator, for coloured equation noise: recursive maximum likelihood of an ARMAX model with nc = na.
template <class Scalar, int kNa, int kNb, int kNk, class Forgetting = Exponential<Scalar>,
          bool kOffset = false>
using ArmaxArxEstimator =
    OnlineEstimator<Arx<Scalar, kNa, kNb, kNk, kOffset>, Forgetting,
                    Armax<Scalar, kNa, kNa + kNb + (kOffset ? 1 : 0), Forgetting>>;

}  // namespace ehsid
