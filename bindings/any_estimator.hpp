// SPDX-License-Identifier: MIT
// One Python class for every order, precision and policy: what the compiled estimators have in common.
// Without the recursion, so that a change of it compiles none of the binding files again.
#pragma once

#include <ehsid/any_arx.hpp>
#include <ehsid/forgetting.hpp>
#include <ehsid/gradient_options.hpp>
#include <ehsid/monitor.hpp>
#include <ehsid/reset.hpp>
#include <ehsid/rls_options.hpp>
#include <ehsid/scaling.hpp>
#include <ehsid/snapshot.hpp>

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace ehsid::bindings {

/// na and nb of the largest model, and its constant term.
inline constexpr int kMaxParameters = 2 * kMaxOrder + 1;

/// The value of each setting of a policy.
using SettingValues = std::vector<double>;

template <class Policy>
SettingValues default_settings() {
  const Policy defaults;
  SettingValues values;
  Policy::settings(
      [&](const SettingInfo& /*setting*/, auto member) { values.push_back(member(defaults)); });
  return values;
}

/// The policy at a place of `Policies` before precision and number of parameters are known.
template <std::size_t kPlace>
struct PolicySettings {
  using Policy = PolicyAt<kPlace, double>;
  SettingValues values = default_settings<Policy>();
};

template <std::size_t... kPlaces>
std::variant<PolicySettings<kPlaces>...> any_policy(std::index_sequence<kPlaces...>);
using ForgettingSettings = decltype(any_policy(std::make_index_sequence<kPolicies>{}));

/// Settings as Python gives them, in double; rounded once to the precision of the estimator.
struct RlsSettings {
  int n = 1;
  ForgettingSettings forgetting;
  RlsOptions<double> options;
  std::vector<double> theta0;     // empty: default
  std::vector<double> variance0;  // empty: default
};

/// Which recursion an estimator runs.
enum class Method : std::uint8_t { rls, instrumental_variables };

struct EstimatorSettings {
  int na = 1;
  int nb = 1;
  int nk = 1;
  bool offset = false;
  ForgettingSettings forgetting;
  Scaling<double> scaling;
  RlsOptions<double> rls;
  std::optional<RmseResetOptions<double>> reset;
  ConvergenceOptions<double> convergence;
  std::vector<double> theta0;
  std::vector<double> variance0;
  std::optional<double> input_limit;
  Method method = Method::rls;
  GradientOptions<double> gradient;  // its own rls is not read
  bool integrator = false;           // known: na poles beside it

  int n() const { return na + nb + (offset ? 1 : 0); }
};

/// Where a run writes, row by row; columns of the caller's arrays, `theta` and `deviation` with n a row.
template <class Scalar>
struct TrajectoryView {
  Scalar* theta;
  Scalar* deviation;
  Scalar* innovation;
  Scalar* forgetting_factor;
  Scalar* residual_variance;
  std::uint8_t* status;
  bool* converged;  // null where the recursion alone runs
};

/// An object that run() changes while other threads of Python go on. Only read and written with the GIL.
struct OneThread {
  bool running = false;
};

/// What Python reads of an estimate. Numbers in double hold every float32 exactly.
class AnyRecursion : public OneThread {
 public:
  virtual ~AnyRecursion() = default;
  virtual int n() const = 0;
  virtual bool single() const = 0;
  virtual std::vector<double> theta_hat() const = 0;
  virtual std::vector<double> standard_deviation() const = 0;
  virtual std::vector<double> gain() const = 0;
  virtual std::vector<double> P() const = 0;  // n * n, symmetric
  virtual double innovation() const = 0;
  virtual double forgetting_factor() const = 0;
  virtual double residual_variance() const = 0;
  virtual void reset() = 0;
  virtual std::string save() const = 0;
  virtual SnapshotFault restore(const std::string& bytes) = 0;
};

class AnyRls : public AnyRecursion {
 public:
  virtual Status update(const double* phi, double y) = 0;
  virtual double predict(const double* phi) const = 0;
  virtual void reset_all() = 0;
  virtual Status start_from_covariance(const std::vector<double>& theta0,
                                       const std::vector<double>& p0) = 0;
  virtual void run(const float* phi, const float* y, std::size_t rows, TrajectoryView<float>) = 0;
  virtual void run(const double* phi, const double* y, std::size_t rows,
                   TrajectoryView<double>) = 0;
};

class AnyEstimator : public AnyRecursion {
 public:
  virtual ModelShape orders() const = 0;
  /// u: n * n, unit upper triangular; d: n.
  virtual Status seed(const std::vector<double>& theta, const std::vector<double>& u,
                      const std::vector<double>& d, double noise_variance) = 0;
  virtual Status step(double command, double position) = 0;
  virtual void run(const float* u, const float* y, std::size_t rows, TrajectoryView<float>) = 0;
  virtual void run(const double* u, const double* y, std::size_t rows, TrajectoryView<double>) = 0;
  virtual std::vector<double> covariance() const = 0;  // n * n
  virtual void enable(bool on) = 0;
  virtual bool enabled() const = 0;
  virtual bool settled() const = 0;
  virtual bool converged() const = 0;
  virtual bool white() const = 0;
  virtual double whiteness() const = 0;
  virtual double excitation() const = 0;
  virtual int resets() const = 0;
  virtual bool integrates() const = 0;
};

/// Where a run of a bank writes, a row for every `every`-th sample: a number for each estimator, `theta` and `deviation` n.
template <class Scalar>
struct BankView {
  TrajectoryView<Scalar> to;
  std::size_t every;  // 0 writes nothing
};

/// Numbers of a record, `samples` rows: one for each estimator, or a lone one for all.
template <class Scalar>
struct BankColumn {
  const Scalar* numbers;
  bool shared;
};

/// Many estimators of the same orders, precision and policy across SIMD lanes.
class AnyBank {
 public:
  virtual ~AnyBank() = default;
  virtual std::size_t size() const = 0;
  virtual const char* instructions() const = 0;
  /// Brings `one`, the estimator that the bank was given at this index, to the state of now.
  virtual void get(std::size_t index, AnyEstimator& one) const = 0;
  virtual void set(std::size_t index, AnyEstimator& one) = 0;
  /// threads >= 1.
  virtual void run(BankColumn<float> u, BankColumn<float> y, std::size_t samples, unsigned threads,
                   BankView<float>) = 0;
  virtual void run(BankColumn<double> u, BankColumn<double> y, std::size_t samples,
                   unsigned threads, BankView<double>) = 0;
};

/// A bank of these estimators, which are at least one. Throws std::invalid_argument where they are not alike, run another
/// method than rls, or where this machine does not have the instructions: "baseline", "avx2" or "avx512", "" for its best.
template <class Scalar>
std::unique_ptr<AnyBank> make_bank(const std::vector<AnyEstimator*>& estimators,
                                   const std::string& instructions);

/// The compiled estimator for these settings, in float or double.
template <class Scalar>
std::unique_ptr<AnyRls> make_rls(const RlsSettings& settings);
template <class Scalar>
std::unique_ptr<AnyEstimator> make_estimator(const EstimatorSettings& settings);
/// The same for instrumental variables. Throws std::invalid_argument where the policy is neither constant nor exponential.
template <class Scalar>
std::unique_ptr<AnyEstimator> make_instrumental_estimator(const EstimatorSettings& settings);

}  // namespace ehsid::bindings
