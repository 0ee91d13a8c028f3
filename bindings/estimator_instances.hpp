// SPDX-License-Identifier: MIT
// The bodies behind any_estimator.hpp: conversion of settings and loops over arrays; no maths of their own.
#pragma once

// Where the number of rounds is not known, more than two at once gain nothing, and take twice as long to compile.
#if defined(__GNUC__) && !defined(EHSID_UNROLL)
#define EHSID_UNROLL _Pragma("GCC unroll 2")
#endif

#include "any_estimator.hpp"

#include <ehsid/arx_estimator.hpp>
#include <ehsid/integrating.hpp>

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <utility>

namespace ehsid::bindings {

/// Each compiled estimator takes any number of parameters up to kMaxParameters.
inline constexpr int kSize = up_to(kMaxParameters);

template <class Scalar, std::size_t kPlace>
PolicyAt<kPlace, Scalar> to_policy(const PolicySettings<kPlace>& given) {
  using Policy = PolicyAt<kPlace, Scalar>;
  Policy policy;
  std::size_t at = 0;
  Policy::settings([&](const SettingInfo& /*setting*/, auto member) {
    member(policy) = static_cast<Scalar>(given.values[at++]);
  });
  policy.restart();
  return policy;
}

template <class Scalar>
RlsOptions<Scalar> to_options(const RlsOptions<double>& given) {
  return {static_cast<Scalar>(given.information_margin),
          static_cast<Scalar>(given.covariance_ceiling)};
}

/// Fills a vector from Python's values; keeps `vector` where none were given.
template <class Scalar>
void assign(Vector<Scalar, kSize>& vector, const std::vector<double>& values, const char* name) {
  if (values.empty()) {
    return;
  }
  if (values.size() != static_cast<std::size_t>(vector.size())) {
    throw std::invalid_argument(std::string(name) + " has " + std::to_string(values.size()) +
                                " values; expected " + std::to_string(vector.size()) +
                                ", one a parameter");
  }
  for (int i = 0; i < vector.size(); ++i) {
    vector[i] = static_cast<Scalar>(values[static_cast<std::size_t>(i)]);
  }
}

inline void require(Status status, const char* what) {
  if (status != Status::ok) {
    throw std::invalid_argument(what);
  }
}

inline constexpr const char* kBadStart =
    "start values refused: theta0 must be finite, variance0 finite and > 0 in the chosen "
    "precision; "
    "float32 takes |theta0| below 9e18 and n * variance0 from 3e-39 to 8e37, both of the scaled "
    "signals";

inline constexpr const char* kBadScaling =
    "Scaling: in the chosen precision a scale, its square or that of position_scale / "
    "command_scale is zero or not "
    "finite; expected both scales between 1e-9 and 1e9";

template <class Scalar>
std::vector<double> to_double(const Vector<Scalar, kSize>& values) {
  return {values.data(), values.data() + values.size()};
}

inline std::uint8_t* as_bytes(std::string& bytes) {
  return reinterpret_cast<std::uint8_t*>(bytes.data());
}
inline const std::uint8_t* as_bytes(const std::string& bytes) {
  return reinterpret_cast<const std::uint8_t*>(bytes.data());
}

/// Row by row; the matrices are symmetric.
template <class Scalar>
std::vector<double> to_double_matrix(const SquareMatrix<Scalar, kSize>& values) {
  return {values.data(), values.data() + values.size()};
}

/// P in double, of factors in the precision of the estimator: sums of entries that cancel, such as the variance of
/// 1 + a1 + .. + a_na of a plant that integrates, keep the digits that the factors have.
template <class Scalar, int kN>
SquareMatrix<double, kN> wide_covariance(const UdFactors<Scalar, kN>& factors) {
  UdFactors<double, kN> wide;
  wide.resize(factors.size());
  std::copy(factors.u.begin(), factors.u.end(), wide.u.begin());
  std::copy(factors.d.begin(), factors.d.end(), wide.d.begin());
  return wide.matrix();
}

/// One row of a trajectory. An innovation exists only where the sample was estimated.
template <class Scalar, class Estimator>
void write_row(const Estimator& estimator, Status status, std::size_t row,
               const TrajectoryView<Scalar>& out) {
  const auto n = static_cast<std::size_t>(estimator.size());
  const auto theta = estimator.theta_hat();
  const auto deviation = estimator.standard_deviation();
  for (std::size_t i = 0; i < n; ++i) {
    out.theta[row * n + i] = theta[static_cast<int>(i)];
    out.deviation[row * n + i] = deviation[static_cast<int>(i)];
  }
  const bool estimated =
      status == Status::ok || status == Status::reset || status == Status::no_information;
  out.innovation[row] =
      estimated ? estimator.innovation() : std::numeric_limits<Scalar>::quiet_NaN();
  out.forgetting_factor[row] = estimator.forgetting_factor();
  out.residual_variance[row] = estimator.residual_variance();
  out.status[row] = static_cast<std::uint8_t>(status);
}

template <class Scalar, class Policy>
class RlsInstance final : public AnyRls {
 public:
  using Recursion = Rls<Scalar, kSize, Policy>;

  RlsInstance(const RlsSettings& given, const Policy& forgetting) {
    require(rls_.configure(forgetting, to_options<Scalar>(given.options)),
            "forgetting or options are outside their documented ranges");
    typename Recursion::Parameters theta0 = Recursion::Parameters::Zero(given.n);
    typename Recursion::Parameters variance0 =
        Recursion::Parameters::Constant(given.n, Recursion::kDefaultVariance);
    assign<Scalar>(theta0, given.theta0, "theta0");
    assign<Scalar>(variance0, given.variance0, "variance0");
    require(rls_.start(theta0, variance0), kBadStart);
  }

  int n() const override { return rls_.size(); }
  bool single() const override { return std::is_same_v<Scalar, float>; }
  std::vector<double> theta_hat() const override { return to_double<Scalar>(rls_.theta_hat()); }
  std::vector<double> standard_deviation() const override {
    return to_double<Scalar>(rls_.standard_deviation());
  }
  std::vector<double> gain() const override { return to_double<Scalar>(rls_.gain()); }
  std::vector<double> P() const override { return to_double_matrix<Scalar>(rls_.P()); }
  double innovation() const override { return static_cast<double>(rls_.innovation()); }
  double forgetting_factor() const override {
    return static_cast<double>(rls_.forgetting_factor());
  }
  double residual_variance() const override {
    return static_cast<double>(rls_.residual_variance());
  }
  void reset() override { rls_.reset(); }
  void reset_all() override { rls_.reset_all(); }
  std::string save() const override {
    typename Recursion::State state = rls_.state();
    std::string bytes(header().bytes, '\0');
    write_snapshot(as_bytes(bytes), header(), state);
    return bytes;
  }
  SnapshotFault restore(const std::string& bytes) override {
    typename Recursion::State state = rls_.state();
    const SnapshotFault fault = read_snapshot(as_bytes(bytes), bytes.size(), header(), state);
    if (fault != SnapshotFault::none) {
      return fault;
    }
    return rls_.restore(state) == Status::ok ? SnapshotFault::none : SnapshotFault::impossible;
  }
  Status update(const double* phi, double y) override {
    return rls_.update(regressor(phi), static_cast<Scalar>(y));
  }
  double predict(const double* phi) const override {
    return static_cast<double>(rls_.predict(regressor(phi)));
  }
  Status start_from_covariance(const std::vector<double>& theta0,
                               const std::vector<double>& p0) override {
    typename Recursion::Parameters theta = Recursion::Parameters::Zero(n());
    assign<Scalar>(theta, theta0, "theta0");
    typename Recursion::Covariance covariance(n(), n());
    for (int i = 0; i < n(); ++i) {
      for (int j = 0; j < n(); ++j) {
        covariance(i, j) = static_cast<Scalar>(p0[static_cast<std::size_t>(i * n() + j)]);
      }
    }
    return rls_.start_from_covariance(theta, covariance);
  }
  void run(const float* phi, const float* y, std::size_t rows, TrajectoryView<float> out) override {
    run_in(phi, y, rows, out);
  }
  void run(const double* phi, const double* y, std::size_t rows,
           TrajectoryView<double> out) override {
    run_in(phi, y, rows, out);
  }

 private:
  /// Of a saved recursion. The start values belong to its configuration, because reset_all() goes back to them.
  SnapshotHeader header() const {
    constexpr std::uint32_t kMagic = 0x524c5331U;  // "RLS1"
    const ModelShape shape(n(), 0, 0, false);
    ByteStream writer = ByteStream::writing(nullptr);
    rls_.write_configuration(writer, shape);
    const typename Recursion::Parameters theta0 = rls_.start_theta();
    writer.values(theta0.data(), n());
    return make_header<Scalar, Policy, typename Recursion::State>(kMagic, shape, writer.checksum());
  }

  template <class Number>
  typename Recursion::Regressor regressor(const Number* phi) const {
    typename Recursion::Regressor vector(n());
    for (int i = 0; i < vector.size(); ++i) {
      vector[i] = static_cast<Scalar>(phi[i]);
    }
    return vector;
  }

  template <class Number>
  void run_in(const Number* phi, const Number* y, std::size_t rows, TrajectoryView<Number> out) {
    if constexpr (std::is_same_v<Number, Scalar>) {
      const auto n = static_cast<std::size_t>(rls_.size());
      for (std::size_t row = 0; row < rows; ++row) {
        const Status status = rls_.update(regressor(phi + row * n), y[row]);
        write_row(rls_, status, row, out);
      }
    }
  }

  Recursion rls_;
};

template <class Scalar, class Policy, class Recursion_ = Rls<Scalar, kSize, Policy>,
          class Model_ = AnyArx<Scalar, kSize>>
class EstimatorInstance final : public AnyEstimator {
 public:
  using Estimator = OnlineEstimator<Model_, Policy, Recursion_>;
  using Recursion = typename Estimator::Recursion;

  EstimatorInstance(const EstimatorSettings& given, const Policy& forgetting)
      : estimator_(Model_(AnyArx<Scalar, kSize>(given.na, given.nb, given.nk, given.offset))) {
    typename Estimator::Options options;
    options.theta0.setZero(n());
    options.variance0.setConstant(n(), Recursion::kDefaultVariance);
    options.scaling = {static_cast<Scalar>(given.scaling.command_scale),
                       static_cast<Scalar>(given.scaling.position_scale),
                       static_cast<Scalar>(given.scaling.command_offset),
                       static_cast<Scalar>(given.scaling.position_offset)};
    options.forgetting = forgetting;
    if constexpr (Recursion::kFollowsModel) {
      options.rls = {to_options<Scalar>(given.rls), given.gradient.settling,
                     static_cast<Scalar>(given.gradient.start_pole),
                     static_cast<Scalar>(given.gradient.fading),
                     static_cast<Scalar>(given.gradient.model_rate)};
    } else {
      options.rls = to_options<Scalar>(given.rls);
    }
    options.reset_enabled = given.reset.has_value();
    if (given.reset) {
      options.reset = {static_cast<Scalar>(given.reset->short_window),
                       static_cast<Scalar>(given.reset->long_window),
                       static_cast<Scalar>(given.reset->trigger_ratio),
                       static_cast<Scalar>(given.reset->release_ratio),
                       given.reset->cool_down,
                       static_cast<Scalar>(given.reset->floor)};
    }
    options.convergence = {static_cast<Scalar>(given.convergence.tolerance),
                           static_cast<Scalar>(given.convergence.magnitude),
                           given.convergence.hold};
    assign<Scalar>(options.theta0, given.theta0, "theta0");
    assign<Scalar>(options.variance0, given.variance0, "variance0");
    if (given.input_limit) {
      options.input_limit = static_cast<Scalar>(*given.input_limit);
      if (!(options.input_limit > Scalar(0))) {
        throw std::invalid_argument("input_limit must be > 0 in the chosen precision");
      }
    }
    if (!options.scaling.valid()) {
      throw std::invalid_argument(kBadScaling);
    }
    if (!options.valid()) {
      throw std::invalid_argument("an option is outside its documented range");
    }
    require(estimator_.configure(options), kBadStart);
  }

  ModelShape orders() const override {
    const auto& model = estimator_.model();
    return {model.na(), model.nb(), model.nk(), model.offset()};
  }
  bool integrates() const override { return Model_::kIntegrates; }
  int n() const override { return estimator_.size(); }
  bool single() const override { return std::is_same_v<Scalar, float>; }
  std::vector<double> theta_hat() const override {
    return to_double<Scalar>(estimator_.theta_hat());
  }
  std::vector<double> standard_deviation() const override {
    return to_double<Scalar>(estimator_.standard_deviation());
  }
  std::vector<double> gain() const override {
    return to_double<Scalar>(estimator_.recursion().gain());
  }
  std::vector<double> P() const override {
    return to_double_matrix<Scalar>(estimator_.recursion().P());
  }
  std::vector<double> covariance() const override {
    const auto state = estimator_.recursion().state();
    const auto p = [&] {
      if constexpr (Recursion::kFollowsModel) {
        // Behind the model's parameters are those of the noise.
        return wide_covariance(state.recursion.factors);
      } else {
        return wide_covariance(state.factors);
      }
    }();
    const ModelShape shape = orders();
    const auto& scaling = estimator_.scaling();
    const auto inflation = static_cast<double>(estimator_.whiteness().inflation());
    const double variance =
        static_cast<double>(estimator_.recursion().parameter_variance()) * inflation * inflation;
    std::vector<double> all;
    for (int i = 0; i < n(); ++i) {
      for (int j = 0; j < n(); ++j) {
        const double unit = static_cast<double>(scaling.parameter_unit(i, shape.na, shape.nb)) *
                            static_cast<double>(scaling.parameter_unit(j, shape.na, shape.nb));
        all.push_back(bounded_product(p(i, j), bounded_product(variance, unit)));
      }
    }
    return all;
  }
  double innovation() const override { return static_cast<double>(estimator_.innovation()); }
  double forgetting_factor() const override {
    return static_cast<double>(estimator_.forgetting_factor());
  }
  double residual_variance() const override {
    return static_cast<double>(estimator_.residual_variance());
  }
  void reset() override { estimator_.reset(); }
  std::string save() const override {
    std::string bytes(estimator_.snapshot_bytes(), '\0');
    estimator_.save(as_bytes(bytes));
    return bytes;
  }
  SnapshotFault restore(const std::string& bytes) override {
    const SnapshotFault fault = estimator_.check(as_bytes(bytes), bytes.size());
    if (fault == SnapshotFault::none) {
      static_cast<void>(estimator_.restore(as_bytes(bytes), bytes.size()));
    }
    return fault;
  }
  Status seed(const std::vector<double>& theta, const std::vector<double>& u,
              const std::vector<double>& d, double noise_variance) override {
    typename Recursion::Parameters start(n());
    typename Recursion::Parameters diagonal(n());
    assign<Scalar>(start, theta, "theta");
    assign<Scalar>(diagonal, d, "d");
    UdFactors<Scalar, kSize> factors;
    if (theta.empty() || d.empty() || !factors.set_diagonal(diagonal)) {
      return Status::invalid_argument;
    }
    for (int j = 1; j < n(); ++j) {
      for (int i = 0; i < j; ++i) {
        factors.u[factors.at(i, j)] = static_cast<Scalar>(u[static_cast<std::size_t>(i * n() + j)]);
      }
    }
    return estimator_.seed(start, factors, static_cast<Scalar>(noise_variance));
  }
  Status step(double command, double position) override {
    return estimator_.step(static_cast<Scalar>(command), static_cast<Scalar>(position));
  }
  void run(const float* u, const float* y, std::size_t rows, TrajectoryView<float> out) override {
    run_in(u, y, rows, out);
  }
  void run(const double* u, const double* y, std::size_t rows,
           TrajectoryView<double> out) override {
    run_in(u, y, rows, out);
  }
  void enable(bool on) override { estimator_.enable(on); }
  bool enabled() const override { return estimator_.enabled(); }
  bool settled() const override { return estimator_.settled(); }
  bool converged() const override { return estimator_.converged(); }
  bool white() const override { return estimator_.whiteness().white(); }
  double whiteness() const override {
    return static_cast<double>(estimator_.whiteness().statistic());
  }
  double excitation() const override {
    return static_cast<double>(estimator_.monitor().excitation());
  }
  int resets() const override { return estimator_.change_detector().alarms(); }

  /// The estimator itself, for a bank.
  Estimator& estimator() { return estimator_; }

 private:
  template <class Number>
  void run_in(const Number* u, const Number* y, std::size_t rows, TrajectoryView<Number> out) {
    if constexpr (std::is_same_v<Number, Scalar>) {
      for (std::size_t row = 0; row < rows; ++row) {
        const Status status = estimator_.step(u[row], y[row]);
        write_row(estimator_, status, row, out);
        out.converged[row] = estimator_.converged();
      }
    }
  }

  Estimator estimator_;
};

template <class Scalar>
std::unique_ptr<AnyRls> make_rls(const RlsSettings& settings) {
  return std::visit(
      [&](const auto& forgetting) -> std::unique_ptr<AnyRls> {
        const auto policy = to_policy<Scalar>(forgetting);
        return std::make_unique<RlsInstance<Scalar, std::decay_t<decltype(policy)>>>(settings,
                                                                                     policy);
      },
      settings.forgetting);
}

template <class Scalar>
std::unique_ptr<AnyEstimator> make_estimator(const EstimatorSettings& settings) {
  return std::visit(
      [&](const auto& forgetting) -> std::unique_ptr<AnyEstimator> {
        const auto policy = to_policy<Scalar>(forgetting);
        using Policy = std::decay_t<decltype(policy)>;
        if (settings.integrator) {
          using Known = EstimatorInstance<Scalar, Policy, Rls<Scalar, kSize, Policy>,
                                          Integrating<AnyArx<Scalar, kSize>>>;
          return std::make_unique<Known>(settings, policy);
        }
        return std::make_unique<EstimatorInstance<Scalar, Policy>>(settings, policy);
      },
      settings.forgetting);
}

}  // namespace ehsid::bindings
