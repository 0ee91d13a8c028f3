// SPDX-License-Identifier: MIT
// The bodies behind any_estimator.hpp: conversion of settings and loops over arrays; no maths of their own.
#pragma once

#include "any_estimator.hpp"

#include <ehsid/any_arx.hpp>

#include <array>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

namespace ehsid::bindings {

inline constexpr int kMaxParameters = 2 * kMaxOrder + 1;

template <class Scalar, class Policy, int kN>
typename Policy::template Type<Scalar, kN> to_policy(const ForgettingSettings& settings) {
  using Type = typename Policy::template Type<Scalar, kN>;
  const auto& given = std::get<typename Policy::Settings>(settings);
  Type policy;
  if constexpr (std::is_same_v<Policy, ConstantPolicy>) {
    policy.lambda = static_cast<Scalar>(given.lambda);
  } else if constexpr (std::is_same_v<Policy, ExponentialPolicy>) {
    policy.lambda0 = static_cast<Scalar>(given.lambda0);
    policy.lambda_initial = static_cast<Scalar>(given.lambda_initial);
    policy.restart();
  } else if constexpr (std::is_same_v<Policy, ErrorDrivenPolicy>) {
    policy.memory = static_cast<Scalar>(given.memory);
    policy.lambda_min = static_cast<Scalar>(given.lambda_min);
    policy.noise_variance = static_cast<Scalar>(given.noise_variance);
  } else if constexpr (std::is_same_v<Policy, FRatioPolicy>) {
    policy.eta = static_cast<Scalar>(given.eta);
    policy.critical_ratio = static_cast<Scalar>(given.critical_ratio);
  } else if constexpr (std::is_same_v<Policy, DirectionalPolicy>) {
    policy.lambda = static_cast<Scalar>(given.lambda);
    policy.epsilon = static_cast<Scalar>(given.epsilon);
  } else {
    if (given.drift.size() != 1 && given.drift.size() != static_cast<std::size_t>(kN)) {
      throw std::invalid_argument("RandomWalk: drift has " + std::to_string(given.drift.size()) +
                                  " values; expected 1, or one for each of the " +
                                  std::to_string(kN) + " parameters");
    }
    for (std::size_t i = 0; i < policy.drift.size(); ++i) {
      policy.drift[i] =
          static_cast<Scalar>(given.drift.size() == 1 ? given.drift[0] : given.drift[i]);
    }
  }
  return policy;
}

template <class Scalar>
RlsOptions<Scalar> to_options(const RlsOptions<double>& given) {
  return {static_cast<Scalar>(given.information_margin),
          static_cast<Scalar>(given.covariance_ceiling)};
}

/// Fills a vector from Python's values; keeps `vector` where none were given.
template <class Scalar, int kN>
void assign(Vector<Scalar, kN>& vector, const std::vector<double>& values, const char* name) {
  if (values.empty()) {
    return;
  }
  if (values.size() != static_cast<std::size_t>(kN)) {
    throw std::invalid_argument(std::string(name) + " has " + std::to_string(values.size()) +
                                " values; expected " + std::to_string(kN) + ", one a parameter");
  }
  for (int i = 0; i < kN; ++i) {
    vector[i] = static_cast<Scalar>(values[static_cast<std::size_t>(i)]);
  }
}

inline void require(Status status, const char* what) {
  if (status != Status::ok) {
    throw std::invalid_argument(what);
  }
}

inline constexpr const char* kBadStart =
    "start values refused: theta0 must be finite, variance0 finite and > 0 in the chosen precision";

template <class Scalar, int kN>
std::vector<double> to_double(const Vector<Scalar, kN>& values) {
  std::vector<double> out(static_cast<std::size_t>(kN));
  for (int i = 0; i < kN; ++i) {
    out[static_cast<std::size_t>(i)] = static_cast<double>(values[i]);
  }
  return out;
}

template <class Scalar, int kN>
std::vector<double> to_double_matrix(const SquareMatrix<Scalar, kN>& values) {
  std::vector<double> out;
  out.reserve(static_cast<std::size_t>(kN * kN));
  for (int i = 0; i < kN; ++i) {
    for (int j = 0; j < kN; ++j) {
      out.push_back(static_cast<double>(values(i, j)));
    }
  }
  return out;
}

template <class Plain>
std::string to_bytes(const Plain& plain) {
  std::string bytes(sizeof plain, '\0');
  std::memcpy(bytes.data(), &plain, sizeof plain);
  return bytes;
}

template <class Plain>
bool from_bytes(const std::string& bytes, Plain& plain) {
  if (bytes.size() != sizeof plain) {
    return false;
  }
  std::memcpy(static_cast<void*>(&plain), bytes.data(), sizeof plain);
  return true;
}

/// One row of a trajectory. An innovation exists only where the sample was estimated.
template <class Scalar, class Estimator>
void write_row(const Estimator& estimator, Status status, std::size_t row,
               const TrajectoryView<Scalar>& out) {
  constexpr std::size_t kN = Estimator::kN;
  const auto theta = estimator.theta_hat();
  const auto deviation = estimator.standard_deviation();
  for (std::size_t i = 0; i < kN; ++i) {
    out.theta[row * kN + i] = theta[static_cast<int>(i)];
    out.deviation[row * kN + i] = deviation[static_cast<int>(i)];
  }
  const bool estimated =
      status == Status::ok || status == Status::reset || status == Status::no_information;
  out.innovation[row] =
      estimated ? estimator.innovation() : std::numeric_limits<Scalar>::quiet_NaN();
  out.forgetting_factor[row] = estimator.forgetting_factor();
  out.residual_variance[row] = estimator.residual_variance();
  out.status[row] = static_cast<std::uint8_t>(status);
}

template <class Scalar, class Policy, int kN>
class RlsInstance final : public AnyRls {
 public:
  using Recursion = Rls<Scalar, kN, typename Policy::template Type<Scalar, kN>>;

  explicit RlsInstance(const RlsSettings& given) {
    require(rls_.configure(to_policy<Scalar, Policy, kN>(given.forgetting),
                           to_options<Scalar>(given.options)),
            "forgetting or options are outside their documented ranges");
    typename Recursion::Parameters theta0 = Recursion::Parameters::Zero();
    typename Recursion::Parameters variance0 =
        Recursion::Parameters::Constant(Recursion::kDefaultVariance);
    assign<Scalar, kN>(theta0, given.theta0, "theta0");
    assign<Scalar, kN>(variance0, given.variance0, "variance0");
    require(rls_.start(theta0, variance0), kBadStart);
  }

  int n() const override { return kN; }
  bool single() const override { return std::is_same_v<Scalar, float>; }
  std::vector<double> theta_hat() const override { return to_double<Scalar, kN>(rls_.theta_hat()); }
  std::vector<double> standard_deviation() const override {
    return to_double<Scalar, kN>(rls_.standard_deviation());
  }
  std::vector<double> gain() const override { return to_double<Scalar, kN>(rls_.gain()); }
  std::vector<double> P() const override { return to_double_matrix<Scalar, kN>(rls_.P()); }
  double innovation() const override { return static_cast<double>(rls_.innovation()); }
  double forgetting_factor() const override {
    return static_cast<double>(rls_.forgetting_factor());
  }
  double residual_variance() const override {
    return static_cast<double>(rls_.residual_variance());
  }
  void reset() override { rls_.reset(); }
  void reset_all() override { rls_.reset_all(); }
  std::string save() const override { return to_bytes(kTag) + to_bytes(rls_.state()); }
  Status restore(const std::string& bytes) override {
    const std::string tag = to_bytes(kTag);
    typename Recursion::State state;
    return bytes.compare(0, tag.size(), tag) == 0 && from_bytes(bytes.substr(tag.size()), state)
               ? rls_.restore(state)
               : Status::invalid_argument;
  }
  Status update(const double* phi, double y) override {
    return rls_.update(regressor(phi), static_cast<Scalar>(y));
  }
  double predict(const double* phi) const override {
    return static_cast<double>(rls_.predict(regressor(phi)));
  }
  Status start_from_covariance(const std::vector<double>& theta0,
                               const std::vector<double>& p0) override {
    typename Recursion::Parameters theta = Recursion::Parameters::Zero();
    assign<Scalar, kN>(theta, theta0, "theta0");
    typename Recursion::Covariance covariance;
    for (int i = 0; i < kN; ++i) {
      for (int j = 0; j < kN; ++j) {
        covariance(i, j) = static_cast<Scalar>(p0[static_cast<std::size_t>(i * kN + j)]);
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
  /// What a saved state is of. The state alone does not say: several have the same size.
  static constexpr std::array<std::uint32_t, 4> kTag = {
      0x524c5331U,  // "RLS1", the number is the version of the layout
      static_cast<std::uint32_t>(sizeof(Scalar)), static_cast<std::uint32_t>(kN),
      Recursion::Forgetting::kId};

  template <class Number>
  static typename Recursion::Regressor regressor(const Number* phi) {
    typename Recursion::Regressor vector;
    for (int i = 0; i < kN; ++i) {
      vector[i] = static_cast<Scalar>(phi[i]);
    }
    return vector;
  }

  template <class Number>
  void run_in(const Number* phi, const Number* y, std::size_t rows, TrajectoryView<Number> out) {
    if constexpr (std::is_same_v<Number, Scalar>) {
      for (std::size_t row = 0; row < rows; ++row) {
        const Status status = rls_.update(regressor(phi + row * kN), y[row]);
        write_row(rls_, status, row, out);
      }
    }
  }

  Recursion rls_;
};

template <class Scalar, class Policy, int kN>
class EstimatorInstance final : public AnyEstimator {
 public:
  using Estimator = OnlineEstimator<AnyArx<Scalar, kN>, typename Policy::template Type<Scalar, kN>>;
  using Recursion = typename Estimator::Recursion;

  explicit EstimatorInstance(const EstimatorSettings& given)
      : estimator_(AnyArx<Scalar, kN>(given.na, given.nb, given.nk)) {
    typename Estimator::Options options;
    options.scaling = {static_cast<Scalar>(given.scaling.command_scale),
                       static_cast<Scalar>(given.scaling.position_scale),
                       static_cast<Scalar>(given.scaling.command_offset),
                       static_cast<Scalar>(given.scaling.position_offset)};
    options.forgetting = to_policy<Scalar, Policy, kN>(given.forgetting);
    options.rls = to_options<Scalar>(given.rls);
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
    assign<Scalar, kN>(options.theta0, given.theta0, "theta0");
    assign<Scalar, kN>(options.variance0, given.variance0, "variance0");
    if (given.input_limit) {
      options.input_limit = static_cast<Scalar>(*given.input_limit);
    }
    if (!options.valid()) {
      throw std::invalid_argument("an option is outside its documented range");
    }
    require(estimator_.configure(options), kBadStart);
  }

  int n() const override { return kN; }
  bool single() const override { return std::is_same_v<Scalar, float>; }
  std::vector<double> theta_hat() const override {
    return to_double<Scalar, kN>(estimator_.theta_hat());
  }
  std::vector<double> standard_deviation() const override {
    return to_double<Scalar, kN>(estimator_.standard_deviation());
  }
  std::vector<double> gain() const override {
    return to_double<Scalar, kN>(estimator_.recursion().gain());
  }
  std::vector<double> P() const override {
    return to_double_matrix<Scalar, kN>(estimator_.recursion().P());
  }
  std::vector<double> covariance() const override {
    return to_double_matrix<Scalar, kN>(estimator_.covariance());
  }
  double innovation() const override { return static_cast<double>(estimator_.innovation()); }
  double forgetting_factor() const override {
    return static_cast<double>(estimator_.forgetting_factor());
  }
  double residual_variance() const override {
    return static_cast<double>(estimator_.residual_variance());
  }
  void reset() override { estimator_.reset(); }
  std::string save() const override { return to_bytes(estimator_.save()); }
  Status restore(const std::string& bytes) override {
    typename Estimator::Snapshot snapshot;
    return from_bytes(bytes, snapshot) ? estimator_.restore(snapshot) : Status::invalid_argument;
  }
  Status seed(const std::vector<double>& theta, const std::vector<double>& u,
              const std::vector<double>& d, double noise_variance) override {
    typename Recursion::Parameters start;
    typename Recursion::Parameters diagonal;
    assign<Scalar, kN>(start, theta, "theta");
    assign<Scalar, kN>(diagonal, d, "d");
    UdFactors<Scalar, kN> factors;
    if (theta.empty() || d.empty() || !factors.set_diagonal(diagonal)) {
      return Status::invalid_argument;
    }
    for (int j = 1; j < kN; ++j) {
      for (int i = 0; i < j; ++i) {
        factors.u[factors.at(i, j)] = static_cast<Scalar>(u[static_cast<std::size_t>(i * kN + j)]);
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
  bool converged() const override { return estimator_.converged(); }
  double excitation() const override {
    return static_cast<double>(estimator_.monitor().excitation());
  }
  int resets() const override { return estimator_.change_detector().alarms(); }

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

/// Runs `make` for the compiled size that equals n.
template <int kFirst, class Make, int... kSteps>
auto for_size(int n, Make make, std::integer_sequence<int, kSteps...>) {
  decltype(make(std::integral_constant<int, kFirst>{})) made;
  ((n == kFirst + kSteps
        ? static_cast<void>(made = make(std::integral_constant<int, kFirst + kSteps>{}))
        : static_cast<void>(0)),
   ...);
  return made;
}

template <class Scalar, class Policy>
std::unique_ptr<AnyRls> make_rls(const RlsSettings& settings) {
  return for_size<1>(
      settings.n,
      [&](auto size) -> std::unique_ptr<AnyRls> {
        return std::make_unique<RlsInstance<Scalar, Policy, size()>>(settings);
      },
      std::make_integer_sequence<int, kMaxParameters>{});
}

template <class Scalar, class Policy>
std::unique_ptr<AnyEstimator> make_estimator(const EstimatorSettings& settings) {
  return for_size<2>(
      settings.na + settings.nb + (settings.offset ? 1 : 0),
      [&](auto size) -> std::unique_ptr<AnyEstimator> {
        return std::make_unique<EstimatorInstance<Scalar, Policy, size()>>(settings);
      },
      std::make_integer_sequence<int, kMaxParameters - 1>{});
}

}  // namespace ehsid::bindings
