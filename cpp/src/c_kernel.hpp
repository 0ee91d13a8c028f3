// SPDX-License-Identifier: MIT
// What stands behind an ehsid_kernel: one compiled estimator as a table of functions. No algorithms.
#pragma once

#include <ehsid/c_api.h>
#include <ehsid/any_arx.hpp>
#include <ehsid/arx_estimator.hpp>
#include <ehsid/fit.hpp>
#include <ehsid/forgetting.hpp>
#include <ehsid/instrumental_variables.hpp>

#include <cstring>
#include <new>
#include <type_traits>

/// The head of every storage.
struct ehsid_estimator {
  std::uint32_t magic;
  const ehsid_kernel* kernel;
};

struct ehsid_kernel {
  std::int32_t parameters;
  std::int32_t outputs;  // na, where the kernel has one only; else 0
  bool integrates;       // the integrator is known
  std::size_t storage_bytes;
  std::size_t most_snapshot_bytes;
  void (*defaults)(ehsid_configuration&);
  ehsid::Status (*init)(void*, const ehsid_configuration&);
  ehsid::Status (*step)(ehsid_estimator&, float, float);
  void (*reset)(ehsid_estimator&);
  ehsid::Status (*seed)(ehsid_estimator&, const ehsid_estimate&);
  void (*enable)(ehsid_estimator&, bool);
  void (*theta)(const ehsid_estimator&, float*);
  void (*standard_deviation)(const ehsid_estimator&, float*);
  void (*covariance)(const ehsid_estimator&, float*, bool diagonal_only);
  void (*read)(const ehsid_estimator&, ehsid_report&);
  ehsid::ModelShape (*orders)(const ehsid_estimator&);
  std::size_t (*snapshot_bytes)(const ehsid_estimator&);
  void (*save)(const ehsid_estimator&, std::uint8_t*);
  ehsid::SnapshotFault (*check)(const ehsid_estimator&, const std::uint8_t*, std::size_t);
  ehsid::Status (*restore)(ehsid_estimator&, const std::uint8_t*, std::size_t);
};

namespace ehsid::c {

inline constexpr std::uint32_t kMagic = 0x45485343U;  // "EHSC"

/// Visits each setting of a policy with the member of ehsid_forgetting that has its name.
template <class Policy, class C, class Copy>
void policy_settings(Policy& policy, C& c, Copy copy) {
  Policy::settings(
      [&](const SettingInfo& /*setting*/, auto member) { copy(member(policy), member(c)); });
}

inline RlsOptions<float>& guards(RlsOptions<float>& options) { return options; }
inline RlsOptions<float>& guards(GradientOptions<float>& options) { return options.rls; }

/// Visits every setting but orders and start.
template <class Options, class C, class Copy>
void settings(Options& options, C& c, Copy copy) {
  copy(options.scaling.command_scale, c.command_scale);
  copy(options.scaling.position_scale, c.position_scale);
  copy(options.scaling.command_offset, c.command_offset);
  copy(options.scaling.position_offset, c.position_offset);
  policy_settings(options.forgetting, c.forgetting, copy);
  copy(guards(options.rls).information_margin, c.information_margin);
  copy(guards(options.rls).covariance_ceiling, c.covariance_ceiling);
  copy(options.reset_enabled, c.reset_enabled);
  copy(options.reset.short_window, c.reset_short_window);
  copy(options.reset.long_window, c.reset_long_window);
  copy(options.reset.trigger_ratio, c.reset_trigger_ratio);
  copy(options.reset.release_ratio, c.reset_release_ratio);
  copy(options.reset.cool_down, c.reset_cool_down);
  copy(options.reset.floor, c.reset_floor);
  copy(options.convergence.tolerance, c.convergence_tolerance);
  copy(options.convergence.magnitude, c.convergence_magnitude);
  copy(options.convergence.hold, c.convergence_hold);
  copy(options.input_limit, c.input_limit);
}

/// The estimator of one policy and size in the caller's storage. Model: AnyArx, or one around it.
template <class Policy, int kN, class Recursion = Rls<float, kN, Policy>,
          class Model = AnyArx<float, kN>>
struct Instance : ehsid_estimator {
  using Estimator = OnlineEstimator<Model, Policy, Recursion>;
  using Options = typename Estimator::Options;

  Estimator estimator;
  FitMonitor<float> fit{};

  Instance(const ehsid_configuration& c)
      : ehsid_estimator{kMagic, c.kernel},
        estimator(Model(AnyArx<float, kN>(static_cast<int>(c.na), static_cast<int>(c.nb),
                                          static_cast<int>(c.nk)))) {}

  static Instance& of(ehsid_estimator& head) { return static_cast<Instance&>(head); }
  static const Instance& of(const ehsid_estimator& head) {
    return static_cast<const Instance&>(head);
  }

  static void defaults(ehsid_configuration& c) {
    Options options;
    settings(options, c, [](const auto& from, auto& to) { to = from; });
    c.variance0 = options.variance0[0];
    c.seed = nullptr;
  }

  /// Made beside the storage and copied when all was accepted: what was there stays otherwise.
  static Status init(void* storage, const ehsid_configuration& c) {
    Instance made(c);
    Options options;
    settings(options, c, [](auto& to, const auto& from) { to = from; });
    options.variance0.setConstant(c.variance0);
    Status status = made.estimator.configure(options);
    if (status == Status::ok && c.seed != nullptr) {
      status = seed(made, *c.seed);
    }
    if (status == Status::ok) {
      static_cast<void>(::new (storage) Instance(made));
    }
    return status;
  }

  static Status step(ehsid_estimator& head, float command, float position) {
    Instance& self = of(head);
    const Status status = self.estimator.step(command, position);
    // After a detected change the innovation is no longer there: P and lambda have restarted.
    if (status == Status::ok || status == Status::no_information) {
      self.fit.update(position, self.estimator.innovation());
    }
    return status;
  }

  static void reset(ehsid_estimator& head) { of(head).estimator.reset(); }

  static Status seed(ehsid_estimator& head, const ehsid_estimate& estimate) {
    typename Estimator::Parameters theta;
    UdFactors<float, kN> factors;
    for (int i = 0; i < kN; ++i) {
      theta[i] = estimate.theta[i];
    }
    std::memcpy(factors.d.data(), estimate.d, sizeof factors.d);
    std::memcpy(factors.u.data(), estimate.u, sizeof factors.u);
    const Status status = of(head).estimator.seed(theta, factors, estimate.noise_variance);
    if (status == Status::ok) {
      of(head).fit.restart();
    }
    return status;
  }

  static void enable(ehsid_estimator& head, bool on) { of(head).estimator.enable(on); }

  static void theta(const ehsid_estimator& head, float* to) {
    copy(of(head).estimator.theta_hat(), to);
  }
  static void standard_deviation(const ehsid_estimator& head, float* to) {
    copy(of(head).estimator.standard_deviation(), to);
  }
  static void covariance(const ehsid_estimator& head, float* to, bool diagonal_only) {
    const typename Estimator::Covariance covariance = of(head).estimator.covariance();
    for (int i = 0; i < kN; ++i) {
      for (int j = diagonal_only ? i : 0; j < (diagonal_only ? i + 1 : kN); ++j) {
        *to++ = covariance(i, j);
      }
    }
  }

  static void read(const ehsid_estimator& head, ehsid_report& report) {
    const Estimator& estimator = of(head).estimator;
    report.innovation = estimator.innovation();
    report.forgetting_factor = estimator.forgetting_factor();
    report.residual_variance = estimator.residual_variance();
    report.fit_percent = of(head).fit.percent();
    report.excitation = estimator.monitor().excitation();
    report.resets = estimator.change_detector().alarms();
    report.whiteness = estimator.whiteness().statistic();
    report.white = estimator.whiteness().white();
    report.settled = estimator.settled();
    report.converged = estimator.converged();
    report.enabled = estimator.enabled();
  }

  static ModelShape orders(const ehsid_estimator& head) {
    const Model& model = of(head).estimator.model();
    return {model.na(), model.nb(), model.nk(), model.offset()};
  }

  static std::size_t snapshot_bytes(const ehsid_estimator& head) {
    return of(head).estimator.snapshot_bytes();
  }
  static void save(const ehsid_estimator& head, std::uint8_t* bytes) {
    of(head).estimator.save(bytes);
  }
  static SnapshotFault check(const ehsid_estimator& head, const std::uint8_t* bytes,
                             std::size_t count) {
    return of(head).estimator.check(bytes, count);
  }
  static Status restore(ehsid_estimator& head, const std::uint8_t* bytes, std::size_t count) {
    const Status status = of(head).estimator.restore(bytes, count);
    if (status == Status::ok) {
      of(head).fit.restart();
    }
    return status;
  }

 private:
  static void copy(const Vector<float, kN>& from, float* to) {
    for (int i = 0; i < kN; ++i) {
      to[i] = from[i];
    }
  }
};

/// kOutputs: na, where it is one only.
template <class Policy, int kN, class Recursion = Rls<float, kN, Policy>, int kOutputs = 0,
          class Model = AnyArx<float, kN>>
constexpr ehsid_kernel kernel() {
  using Made = Instance<Policy, kN, Recursion, Model>;
  static_assert(sizeof(Made) <= EHSID_STORAGE_BYTES(std::size_t{kN}),
                "c_api.h gives too little storage");
  static_assert(alignof(Made) <= alignof(std::uint64_t), "c_api.h aligns storage too little");
  static_assert(Made::Estimator::kSnapshotBytes <= EHSID_SNAPSHOT_BYTES(std::size_t{kN}),
                "c_api.h gives too few bytes for a snapshot");
  static_assert(UdFactors<float, kN>::kUpper <= EHSID_MAX_UPPER, "c_api.h gives U too little");
  static_assert(std::is_trivially_destructible<Made>::value,
                "nobody destroys what lives in storage");
  return {kN,
          kOutputs,
          Model::kIntegrates,
          sizeof(Made),
          Made::Estimator::kSnapshotBytes,
          Made::defaults,
          Made::init,
          Made::step,
          Made::reset,
          Made::seed,
          Made::enable,
          Made::theta,
          Made::standard_deviation,
          Made::covariance,
          Made::read,
          Made::orders,
          Made::snapshot_bytes,
          Made::save,
          Made::check,
          Made::restore};
}

}  // namespace ehsid::c

/// Defines ehsid_kernel_NAME_n. `const` and not constexpr, which MSVC would keep inside its file; the assertions hold that
/// it needs no constructor.
#define EHSID_DEFINE_KERNEL(NAME, n)                                                               \
  static_assert(ehsid::place_of_policy(#NAME) < ehsid::kPolicies, "no policy has this id");        \
  static_assert(                                                                                   \
      ehsid::c::kernel<ehsid::PolicyAt<ehsid::place_of_policy(#NAME), float>, (n)>().parameters == \
          (n),                                                                                     \
      "known to the compiler");                                                                    \
  extern "C" const ehsid_kernel ehsid_kernel_##NAME##_##n =                                        \
      ehsid::c::kernel<ehsid::PolicyAt<ehsid::place_of_policy(#NAME), float>, (n)>();
/// Defines ehsid_kernel_NAME_2 .. _13.
#define EHSID_DEFINE_KERNELS(NAME) \
  EHSID_DEFINE_KERNEL(NAME, 2)     \
  EHSID_DEFINE_KERNEL(NAME, 3)     \
  EHSID_DEFINE_KERNEL(NAME, 4)     \
  EHSID_DEFINE_KERNEL(NAME, 5)     \
  EHSID_DEFINE_KERNEL(NAME, 6)     \
  EHSID_DEFINE_KERNEL(NAME, 7)     \
  EHSID_DEFINE_KERNEL(NAME, 8)     \
  EHSID_DEFINE_KERNEL(NAME, 9)     \
  EHSID_DEFINE_KERNEL(NAME, 10)    \
  EHSID_DEFINE_KERNEL(NAME, 11)    \
  EHSID_DEFINE_KERNEL(NAME, 12)    \
  EHSID_DEFINE_KERNEL(NAME, 13)
