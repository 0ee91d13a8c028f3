// SPDX-License-Identifier: MIT
// Checks of arguments in front of the kernels.
#include "c_kernel.hpp"

#include <ehsid/servo_estimator.hpp>
#include <ehsid/servo_model.hpp>

#include <new>

struct ehsid_servo_estimator {
  using Estimator = ehsid::ServoEstimator<float, EHSID_MAX_DELAY>;
  static constexpr std::uint32_t kMagic = 0x45485356U;  // "EHSV"
  std::uint32_t magic;
  Estimator estimator;
};

namespace {

using ehsid::SnapshotFault;
using ehsid::Status;

static_assert(EHSID_MAX_ORDER == ehsid::kMaxOrder, "c_api.h and any_arx.hpp disagree");
static_assert(EHSID_MAX_DELAY == ehsid::kMaxDelay, "c_api.h and any_arx.hpp disagree");
static_assert(EHSID_MAX_PARAMETERS == 2 * ehsid::kMaxOrder + 1, "one more for the constant term");
#define EHSID_NUMBER(policy) k_##policy,
enum Listed { EHSID_EACH_POLICY(EHSID_NUMBER) kListed };
static_assert(kListed == ehsid::kPolicies,
              "c_api.h does not list every policy of forgetting.hpp: run script/policies.py");
#undef EHSID_NUMBER
static_assert(EHSID_MAX_UPPER == ehsid::UdFactors<float, EHSID_MAX_PARAMETERS>::kUpper,
              "c_api.h and ud.hpp disagree");

constexpr ehsid_status to_c(Status status) { return static_cast<ehsid_status>(status); }

static_assert(to_c(Status::ok) == EHSID_OK && to_c(Status::filling) == EHSID_FILLING &&
                  to_c(Status::no_information) == EHSID_NO_INFORMATION &&
                  to_c(Status::disabled) == EHSID_DISABLED && to_c(Status::reset) == EHSID_RESET &&
                  to_c(Status::invalid_input) == EHSID_INVALID_INPUT &&
                  to_c(Status::out_of_range) == EHSID_OUT_OF_RANGE &&
                  to_c(Status::numerical_limit) == EHSID_NUMERICAL_LIMIT &&
                  to_c(Status::invalid_argument) == EHSID_INVALID_ARGUMENT,
              "c_api.h and types.hpp number the status differently");

constexpr ehsid_snapshot_fault to_c(SnapshotFault fault) {
  return static_cast<ehsid_snapshot_fault>(fault);
}

static_assert(to_c(SnapshotFault::none) == EHSID_SNAPSHOT_FITS &&
                  to_c(SnapshotFault::not_a_snapshot) == EHSID_SNAPSHOT_UNKNOWN &&
                  to_c(SnapshotFault::other_version) == EHSID_SNAPSHOT_OTHER_VERSION &&
                  to_c(SnapshotFault::damaged) == EHSID_SNAPSHOT_DAMAGED &&
                  to_c(SnapshotFault::other_model) == EHSID_SNAPSHOT_OTHER_MODEL &&
                  to_c(SnapshotFault::other_configuration) == EHSID_SNAPSHOT_OTHER_CONFIGURATION &&
                  to_c(SnapshotFault::impossible) == EHSID_SNAPSHOT_IMPOSSIBLE,
              "c_api.h and snapshot.hpp number the faults differently");

using Reading = ehsid::ServoReadingStatus;

constexpr ehsid_servo_status to_c(Reading status) {
  return static_cast<ehsid_servo_status>(status);
}

static_assert(to_c(Reading::ok) == EHSID_SERVO_OK &&
                  to_c(Reading::not_finite) == EHSID_SERVO_NOT_FINITE &&
                  to_c(Reading::invalid_argument) == EHSID_SERVO_INVALID_ARGUMENT &&
                  to_c(Reading::no_integrator) == EHSID_SERVO_NO_INTEGRATOR &&
                  to_c(Reading::poles_not_separable) == EHSID_SERVO_POLES_NOT_SEPARABLE &&
                  to_c(Reading::pole_near_zero) == EHSID_SERVO_POLE_NEAR_ZERO &&
                  to_c(Reading::negative_real_pole) == EHSID_SERVO_NEGATIVE_REAL_POLE &&
                  to_c(Reading::unstable_pole) == EHSID_SERVO_UNSTABLE_POLE &&
                  to_c(Reading::aliasing) == EHSID_SERVO_ALIASING &&
                  to_c(Reading::no_gain) == EHSID_SERVO_NO_GAIN &&
                  to_c(Reading::numerical_limit) == EHSID_SERVO_NUMERICAL_LIMIT,
              "c_api.h and servo_model.hpp number the readings differently");

using ehsid::TrustReason;

constexpr ehsid_trust to_c(TrustReason reason) { return static_cast<ehsid_trust>(reason); }

static_assert(to_c(TrustReason::trusted) == EHSID_TRUSTED &&
                  to_c(TrustReason::starting) == EHSID_STARTING &&
                  to_c(TrustReason::resting) == EHSID_RESTING &&
                  to_c(TrustReason::single_sine) == EHSID_SINGLE_SINE &&
                  to_c(TrustReason::change_suspected) == EHSID_CHANGE_SUSPECTED &&
                  to_c(TrustReason::model_does_not_fit) == EHSID_MODEL_DOES_NOT_FIT &&
                  to_c(TrustReason::not_precise) == EHSID_NOT_PRECISE,
              "c_api.h and servo_estimator.hpp number the reasons differently");
static_assert(sizeof(ehsid_servo_estimator) <= sizeof(std::uint64_t) * EHSID_SERVO_STORAGE_WORDS,
              "EHSID_SERVO_STORAGE_WORDS is too small");
static_assert(ehsid_servo_estimator::Estimator::most_snapshot_bytes() == EHSID_SERVO_SNAPSHOT_BYTES,
              "EHSID_SERVO_SNAPSHOT_BYTES is not what a snapshot takes");

constexpr ehsid_tracked_value to_c(const ehsid::TrackedValue<float>& told) {
  return {told.value, told.half_width, told.trusted, to_c(told.reason)};
}

/// EHSID_OK where there is an estimator.
ehsid_status check(const ehsid_servo_estimator* estimator) {
  if (estimator == nullptr) {
    return EHSID_INVALID_ARGUMENT;
  }
  return estimator->magic == ehsid_servo_estimator::kMagic ? EHSID_OK : EHSID_NOT_INITIALISED;
}
ehsid_status check(const ehsid_estimator* estimator) {
  if (estimator == nullptr) {
    return EHSID_INVALID_ARGUMENT;
  }
  return estimator->magic == ehsid::c::kMagic ? EHSID_OK : EHSID_NOT_INITIALISED;
}

/// The same, and whether there is room for `needed` things behind `pointer`.
template <class Estimator>
ehsid_status check(const Estimator* estimator, const void* pointer, std::size_t room,
                   std::size_t needed) {
  const ehsid_status status = check(estimator);
  if (status != EHSID_OK) {
    return status;
  }
  if (pointer == nullptr) {
    return EHSID_INVALID_ARGUMENT;
  }
  return room >= needed ? EHSID_OK : EHSID_STORAGE_TOO_SMALL;
}

/// Six coefficients and a constant term.
constexpr int kMostOfServo = 7;

/// The servo in the first kSize of `stride` parameters; covariance by rows of `stride` numbers.
template <int kSize>
ehsid::ServoReading<float> read_servo(const float* theta, const float* covariance, int stride,
                                      float dt_s) {
  ehsid::Vector<float, kSize> parameters;
  ehsid::SquareMatrix<float, kSize> spread;
  for (int i = 0; i < kSize; ++i) {
    parameters[i] = theta[i];
    for (int j = 0; j < kSize; ++j) {
      spread(i, j) = covariance[stride * i + j];
    }
  }
  if constexpr (kSize == 5) {
    return ehsid::identify_integrating_servo(parameters, spread, dt_s);
  } else {
    return ehsid::identify_servo(parameters, spread, dt_s);
  }
}

ehsid_servo to_c(const ehsid::ServoReading<float>& found) {
  return {to_c(found.status), found.gain,        found.omega_n, found.xi,
          found.gain_std,     found.omega_n_std, found.xi_std};
}

bool orders_fit(const ehsid_kernel& kernel, std::int32_t na, std::int32_t nb, std::int32_t nk,
                bool offset) {
  return na >= 1 && na <= EHSID_MAX_ORDER && nb >= 1 && nb <= EHSID_MAX_ORDER && nk >= 0 &&
         nk <= EHSID_MAX_DELAY && na + nb + (offset ? 1 : 0) == kernel.parameters &&
         (kernel.outputs == 0 || na == kernel.outputs);
}

}  // namespace

const char* ehsid_status_name(ehsid_status status) {
  switch (status) {
    case EHSID_STORAGE_TOO_SMALL:
      return "storage_too_small";
    case EHSID_NOT_INITIALISED:
      return "not_initialised";
    default:
      return to_string(static_cast<Status>(status));
  }
}

const char* ehsid_servo_status_name(ehsid_servo_status status) {
  return to_string(static_cast<Reading>(status));
}

const char* ehsid_trust_name(ehsid_trust reason) {
  return to_string(static_cast<TrustReason>(reason));
}

const char* ehsid_snapshot_fault_name(ehsid_snapshot_fault fault) {
  return to_string(static_cast<SnapshotFault>(fault));
}

bool ehsid_is_error(ehsid_status status) { return status >= EHSID_INVALID_INPUT; }

ehsid_status ehsid_default_configuration(ehsid_configuration* configuration,
                                         const ehsid_kernel* kernel, int32_t na, int32_t nb,
                                         int32_t nk, bool offset) {
  if (configuration == nullptr || kernel == nullptr || !orders_fit(*kernel, na, nb, nk, offset)) {
    return EHSID_INVALID_ARGUMENT;
  }
  *configuration = ehsid_configuration{};
  kernel->defaults(*configuration);
  configuration->kernel = kernel;
  configuration->na = na;
  configuration->nb = nb;
  configuration->nk = nk;
  configuration->offset = offset;
  return EHSID_OK;
}

ehsid_status ehsid_use_textbook(ehsid_configuration* configuration) {
  if (configuration == nullptr) {
    return EHSID_INVALID_ARGUMENT;
  }
  const ehsid::RlsOptions<float> guards = ehsid::RlsOptions<float>::textbook();
  configuration->information_margin = guards.information_margin;
  configuration->covariance_ceiling = guards.covariance_ceiling;
  configuration->reset_enabled = false;
  return EHSID_OK;
}

size_t ehsid_storage_bytes(const ehsid_kernel* kernel) {
  return kernel == nullptr ? 0 : kernel->storage_bytes;
}

size_t ehsid_snapshot_bytes(const ehsid_kernel* kernel) {
  return kernel == nullptr ? 0 : kernel->most_snapshot_bytes;
}

ehsid_status ehsid_init(ehsid_estimator** estimator, void* storage, size_t bytes,
                        const ehsid_configuration* configuration) {
  if (estimator == nullptr || storage == nullptr || configuration == nullptr ||
      configuration->kernel == nullptr) {
    return EHSID_INVALID_ARGUMENT;
  }
  const ehsid_configuration& c = *configuration;
  if (!orders_fit(*c.kernel, c.na, c.nb, c.nk, c.offset)) {
    return EHSID_INVALID_ARGUMENT;
  }
  const bool aligned = reinterpret_cast<std::uintptr_t>(storage) % alignof(std::uint64_t) == 0;
  if (!aligned || bytes < c.kernel->storage_bytes) {
    return EHSID_STORAGE_TOO_SMALL;
  }
  const ehsid_status status = to_c(c.kernel->init(storage, c));
  if (status == EHSID_OK) {
    *estimator = static_cast<ehsid_estimator*>(storage);
  }
  return status;
}

ehsid_status ehsid_step(ehsid_estimator* estimator, float command, float position) {
  const ehsid_status status = check(estimator);
  return status != EHSID_OK ? status : to_c(estimator->kernel->step(*estimator, command, position));
}

ehsid_status ehsid_reset(ehsid_estimator* estimator) {
  const ehsid_status status = check(estimator);
  if (status == EHSID_OK) {
    estimator->kernel->reset(*estimator);
  }
  return status;
}

ehsid_status ehsid_seed(ehsid_estimator* estimator, const ehsid_estimate* estimate) {
  const ehsid_status status = check(estimator, estimate, 0, 0);
  return status != EHSID_OK ? status : to_c(estimator->kernel->seed(*estimator, *estimate));
}

ehsid_status ehsid_enable(ehsid_estimator* estimator, bool on) {
  const ehsid_status status = check(estimator);
  if (status == EHSID_OK) {
    estimator->kernel->enable(*estimator, on);
  }
  return status;
}

size_t ehsid_parameters(const ehsid_estimator* estimator) {
  return check(estimator) == EHSID_OK ? static_cast<std::size_t>(estimator->kernel->parameters) : 0;
}

ehsid_status ehsid_theta(const ehsid_estimator* estimator, float* theta, size_t count) {
  const ehsid_status status = check(estimator, theta, count, ehsid_parameters(estimator));
  if (status == EHSID_OK) {
    estimator->kernel->theta(*estimator, theta);
  }
  return status;
}

ehsid_status ehsid_standard_deviation(const ehsid_estimator* estimator, float* deviation,
                                      size_t count) {
  const ehsid_status status = check(estimator, deviation, count, ehsid_parameters(estimator));
  if (status == EHSID_OK) {
    estimator->kernel->standard_deviation(*estimator, deviation);
  }
  return status;
}

ehsid_status ehsid_covariance_diagonal(const ehsid_estimator* estimator, float* variance,
                                       size_t count) {
  const ehsid_status status = check(estimator, variance, count, ehsid_parameters(estimator));
  if (status == EHSID_OK) {
    estimator->kernel->covariance(*estimator, variance, true);
  }
  return status;
}

ehsid_status ehsid_covariance(const ehsid_estimator* estimator, float* covariance, size_t count) {
  const std::size_t n = ehsid_parameters(estimator);
  const ehsid_status status = check(estimator, covariance, count, n * n);
  if (status == EHSID_OK) {
    estimator->kernel->covariance(*estimator, covariance, false);
  }
  return status;
}

ehsid_status ehsid_read(const ehsid_estimator* estimator, ehsid_report* report) {
  const ehsid_status status = check(estimator, report, 0, 0);
  if (status == EHSID_OK) {
    estimator->kernel->read(*estimator, *report);
  }
  return status;
}

ehsid_status ehsid_save(const ehsid_estimator* estimator, void* bytes, size_t capacity,
                        size_t* written) {
  if (check(estimator) != EHSID_OK) {
    return check(estimator);
  }
  const std::size_t size = estimator->kernel->snapshot_bytes(*estimator);
  const ehsid_status status = check(estimator, bytes, capacity, size);
  if (status == EHSID_OK) {
    estimator->kernel->save(*estimator, static_cast<std::uint8_t*>(bytes));
    if (written != nullptr) {
      *written = size;
    }
  }
  return status;
}

ehsid_status ehsid_check_snapshot(const ehsid_estimator* estimator, const void* bytes, size_t count,
                                  ehsid_snapshot_fault* fault) {
  ehsid_status status = check(estimator, bytes, 0, 0);
  if (status == EHSID_OK && fault == nullptr) {
    status = EHSID_INVALID_ARGUMENT;
  }
  if (status == EHSID_OK) {
    *fault =
        to_c(estimator->kernel->check(*estimator, static_cast<const std::uint8_t*>(bytes), count));
  }
  return status;
}

ehsid_status ehsid_restore(ehsid_estimator* estimator, const void* bytes, size_t count) {
  const ehsid_status status = check(estimator, bytes, 0, 0);
  return status != EHSID_OK ? status
                            : to_c(estimator->kernel->restore(
                                  *estimator, static_cast<const std::uint8_t*>(bytes), count));
}

ehsid_status ehsid_identify_servo(const float* theta, const float* covariance, float dt_s,
                                  ehsid_servo* servo) {
  if (theta == nullptr || covariance == nullptr || servo == nullptr) {
    return EHSID_INVALID_ARGUMENT;
  }
  *servo = to_c(read_servo<6>(theta, covariance, 6, dt_s));
  return EHSID_OK;
}

ehsid_status ehsid_read_servo(const ehsid_estimator* estimator, float dt_s, ehsid_servo* servo,
                              ehsid_trust* trust) {
  const ehsid_status status = check(estimator, servo, 0, 0);
  if (status != EHSID_OK) {
    return status;
  }
  const ehsid_kernel& kernel = *estimator->kernel;
  const ehsid::ModelShape orders = kernel.orders(*estimator);
  if (!ehsid::has_orders_of_servo(orders.na, orders.nb, orders.nk, kernel.integrates)) {
    return EHSID_INVALID_ARGUMENT;
  }
  float theta[kMostOfServo];
  float covariance[kMostOfServo * kMostOfServo];
  ehsid_report report;
  kernel.theta(*estimator, theta);
  kernel.covariance(*estimator, covariance, false);
  kernel.read(*estimator, report);
  ehsid::ServoReading<float> found =
      kernel.integrates ? read_servo<5>(theta, covariance, kernel.parameters, dt_s)
                        : read_servo<6>(theta, covariance, kernel.parameters, dt_s);
  judge(found, report.white, report.settled, report.converged, report.residual_variance);
  *servo = to_c(found);
  if (trust != nullptr) {
    *trust = to_c(found.reason);
  }
  return EHSID_OK;
}

ehsid_servo_settings ehsid_servo_defaults(float dt_s) {
  const ehsid::ServoEstimatorOptions<float> defaults;
  return {dt_s, defaults.delay, defaults.drift, defaults.tolerance};
}

ehsid_status ehsid_servo_init(ehsid_servo_estimator** estimator, void* storage, size_t bytes,
                              const ehsid_servo_settings* settings) {
  if (estimator == nullptr || storage == nullptr || settings == nullptr) {
    return EHSID_INVALID_ARGUMENT;
  }
  const bool aligned = reinterpret_cast<std::uintptr_t>(storage) % alignof(std::uint64_t) == 0;
  if (!aligned || bytes < sizeof(ehsid_servo_estimator)) {
    return EHSID_STORAGE_TOO_SMALL;
  }
  const ehsid_servo_estimator::Estimator::Options options{settings->dt_s, settings->delay,
                                                          settings->drift, settings->tolerance};
  if (!options.valid(EHSID_MAX_DELAY)) {
    return EHSID_INVALID_ARGUMENT;
  }
  auto* made = ::new (storage) ehsid_servo_estimator{ehsid_servo_estimator::kMagic, {}};
  static_cast<void>(made->estimator.configure(options));  // the options have been checked
  *estimator = made;
  return EHSID_OK;
}

ehsid_status ehsid_servo_step(ehsid_servo_estimator* estimator, float command, float position) {
  const ehsid_status status = check(estimator);
  return status != EHSID_OK ? status : to_c(estimator->estimator.step(command, position));
}

ehsid_status ehsid_servo_read(const ehsid_servo_estimator* estimator, ehsid_tracked_servo* told) {
  const ehsid_status status = check(estimator, told, 1, 1);
  if (status == EHSID_OK) {
    const ehsid::TrackedServo<float> servo = estimator->estimator.servo();
    *told = {to_c(servo.gain), to_c(servo.omega_n), to_c(servo.xi)};
  }
  return status;
}

ehsid_status ehsid_servo_save(const ehsid_servo_estimator* estimator, void* bytes, size_t capacity,
                              size_t* written) {
  if (check(estimator) != EHSID_OK) {
    return check(estimator);
  }
  const std::size_t size = estimator->estimator.snapshot_bytes();
  const ehsid_status status = check(estimator, bytes, capacity, size);
  if (status == EHSID_OK) {
    estimator->estimator.save(static_cast<std::uint8_t*>(bytes));
    if (written != nullptr) {
      *written = size;
    }
  }
  return status;
}

ehsid_status ehsid_servo_restore(ehsid_servo_estimator* estimator, const void* bytes,
                                 size_t count) {
  const ehsid_status status = check(estimator, bytes, 0, 0);
  return status != EHSID_OK
             ? status
             : to_c(estimator->estimator.restore(static_cast<const std::uint8_t*>(bytes), count));
}
