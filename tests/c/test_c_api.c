/* SPDX-License-Identifier: MIT
 * What the C functions refuse, and that a refusal changes nothing; every kernel. */
#include "check.h"

#include <ehsid/c_api.h>

#include <math.h>

#define N 4
static const int32_t kSteps = 200;

typedef union bench {
  uint64_t words[EHSID_STORAGE_WORDS(N)];
  unsigned char bytes[EHSID_STORAGE_BYTES(N)];
} bench;

static ehsid_configuration usual(void) {
  ehsid_configuration made;
  memset(&made, 0xA5, sizeof made);
  CHECK(ehsid_default_configuration(&made, EHSID_KERNEL(exponential, N), 2, 2, 1, false) ==
        EHSID_OK);
  return made;
}

static ehsid_estimator* started(bench* storage) {
  const ehsid_configuration configuration = usual();
  ehsid_estimator* estimator = NULL;
  plant p = {7U, 0.0F, 0.0F, 0.0F, 0.0F};
  memset(storage, 0, sizeof *storage);
  CHECK(ehsid_init(&estimator, storage, sizeof *storage, &configuration) == EHSID_OK);
  for (int32_t k = 0; k < kSteps; ++k) {
    float command;
    float position;
    next_sample(&p, k, &command, &position);
    CHECK(!ehsid_is_error(ehsid_step(estimator, command, position)));
  }
  return estimator;
}

static void test_status_names(void) {
  static const char* const names[] = {"ok",
                                      "filling",
                                      "no_information",
                                      "disabled",
                                      "reset",
                                      "invalid_input",
                                      "out_of_range",
                                      "numerical_limit",
                                      "invalid_argument",
                                      "storage_too_small",
                                      "not_initialised"};
  for (int i = 0; i <= EHSID_NOT_INITIALISED; ++i) {
    CHECK(strcmp(ehsid_status_name((ehsid_status)i), names[i]) == 0);
    CHECK(ehsid_is_error((ehsid_status)i) == (i >= EHSID_INVALID_INPUT));
  }
  CHECK(strcmp(ehsid_status_name((ehsid_status)(EHSID_NOT_INITIALISED + 1)), "unknown") == 0);
}

static void test_it_estimates(void) {
  bench storage;
  ehsid_estimator* estimator = started(&storage);
  float theta[N];
  float deviation[N];
  float variance[N];
  ehsid_report report;
  CHECK(ehsid_parameters(estimator) == N);
  CHECK(ehsid_theta(estimator, theta, N) == EHSID_OK);
  CHECK(ehsid_standard_deviation(estimator, deviation, N) == EHSID_OK);
  CHECK(ehsid_covariance_diagonal(estimator, variance, N) == EHSID_OK);
  CHECK(ehsid_read(estimator, &report) == EHSID_OK);
  /* Truth -1.6, 0.68, 0.05, 0; six of the reported deviations, which chance exceeds once in 5e8. */
  static const float truth[N] = {-1.6F, 0.68F, 0.05F, 0.0F};
  for (int i = 0; i < N; ++i) {
    CHECK(deviation[i] > 0.0F && deviation[i] < 0.1F);
    CHECK(fabsf(theta[i] - truth[i]) < 6.0F * deviation[i]);
    /* A square root, a square and four products, each rounded by 6e-8. */
    CHECK(fabsf(variance[i] - deviation[i] * deviation[i]) < 1e-6F * variance[i]);
  }
  /* e is uniform: its deviation 0.01 / sqrt(3); a fit above 50 % says that most of y is predicted. */
  CHECK(report.residual_variance > 0.5F * 1e-4F / 3.0F && report.residual_variance < 2e-4F / 3.0F);
  CHECK(report.fit_percent > 50.0F && report.fit_percent < 100.0F);
  CHECK(report.resets == 0 && report.enabled);
}

/* The storage is byte for byte what it was. */
#define REFUSES(call, status)                               \
  do {                                                      \
    bench before_ = storage;                                \
    CHECK((call) == (status));                              \
    CHECK(memcmp(&before_, &storage, sizeof storage) == 0); \
  } while (0)

static void test_refusals_change_nothing(void) {
  bench storage;
  ehsid_estimator* estimator = started(&storage);
  ehsid_estimator* other = NULL;
  ehsid_configuration configuration = usual();
  ehsid_estimate estimate;
  unsigned char bytes[EHSID_SNAPSHOT_BYTES(N)];
  float numbers[N];
  size_t written = 77;
  memset(&estimate, 0, sizeof estimate);
  memset(bytes, 0, sizeof bytes);
  REFUSES(ehsid_step(NULL, 0.0F, 0.0F), EHSID_INVALID_ARGUMENT);
  REFUSES(ehsid_theta(estimator, NULL, N), EHSID_INVALID_ARGUMENT);
  REFUSES(ehsid_theta(estimator, numbers, N - 1), EHSID_STORAGE_TOO_SMALL);
  REFUSES(ehsid_standard_deviation(estimator, numbers, 0), EHSID_STORAGE_TOO_SMALL);
  REFUSES(ehsid_covariance_diagonal(NULL, numbers, N), EHSID_INVALID_ARGUMENT);
  REFUSES(ehsid_read(estimator, NULL), EHSID_INVALID_ARGUMENT);
  REFUSES(ehsid_reset(NULL), EHSID_INVALID_ARGUMENT);
  REFUSES(ehsid_enable(NULL, false), EHSID_INVALID_ARGUMENT);
  REFUSES(ehsid_seed(estimator, NULL), EHSID_INVALID_ARGUMENT);
  REFUSES(ehsid_seed(estimator, &estimate), EHSID_INVALID_ARGUMENT); /* d = 0 */
  REFUSES(ehsid_save(estimator, NULL, sizeof bytes, &written), EHSID_INVALID_ARGUMENT);
  REFUSES(ehsid_save(estimator, bytes, 8, &written), EHSID_STORAGE_TOO_SMALL);
  CHECK(written == 77);
  REFUSES(ehsid_restore(estimator, NULL, 0), EHSID_INVALID_ARGUMENT);
  REFUSES(ehsid_restore(estimator, bytes, 8), EHSID_INVALID_ARGUMENT);
  REFUSES(ehsid_restore(estimator, bytes, ehsid_snapshot_bytes(configuration.kernel)),
          EHSID_INVALID_ARGUMENT);
  REFUSES(ehsid_init(NULL, &storage, sizeof storage, &configuration), EHSID_INVALID_ARGUMENT);
  REFUSES(ehsid_init(&other, NULL, sizeof storage, &configuration), EHSID_INVALID_ARGUMENT);
  REFUSES(ehsid_init(&other, &storage, sizeof storage, NULL), EHSID_INVALID_ARGUMENT);
  REFUSES(
      ehsid_init(&other, &storage, ehsid_storage_bytes(configuration.kernel) - 1, &configuration),
      EHSID_STORAGE_TOO_SMALL);
  REFUSES(ehsid_init(&other, storage.bytes + 1, sizeof storage - 1, &configuration),
          EHSID_STORAGE_TOO_SMALL);
  configuration.seed = &estimate;
  REFUSES(ehsid_init(&other, &storage, sizeof storage, &configuration), EHSID_INVALID_ARGUMENT);
  configuration = usual();
  configuration.nb = 3;
  REFUSES(ehsid_init(&other, &storage, sizeof storage, &configuration), EHSID_INVALID_ARGUMENT);
  configuration = usual();
  configuration.nk = -1;
  REFUSES(ehsid_init(&other, &storage, sizeof storage, &configuration), EHSID_INVALID_ARGUMENT);
  configuration = usual();
  configuration.kernel = NULL;
  REFUSES(ehsid_init(&other, &storage, sizeof storage, &configuration), EHSID_INVALID_ARGUMENT);
  configuration = usual();
  configuration.forgetting.lambda0 = 1.5F;
  REFUSES(ehsid_init(&other, &storage, sizeof storage, &configuration), EHSID_INVALID_ARGUMENT);
  configuration = usual();
  configuration.variance0 = NAN;
  REFUSES(ehsid_init(&other, &storage, sizeof storage, &configuration), EHSID_INVALID_ARGUMENT);
  CHECK(other == NULL);
  CHECK(ehsid_default_configuration(NULL, configuration.kernel, 2, 2, 1, false) ==
        EHSID_INVALID_ARGUMENT);
  CHECK(ehsid_default_configuration(&configuration, configuration.kernel, 2, 2, 1, true) ==
        EHSID_INVALID_ARGUMENT);
  CHECK(ehsid_default_configuration(&configuration, configuration.kernel, 2, 2, 21, false) ==
        EHSID_INVALID_ARGUMENT);
  CHECK(ehsid_storage_bytes(NULL) == 0 && ehsid_snapshot_bytes(NULL) == 0);
}

static void test_storage_that_was_never_initialised(void) {
  bench storage;
  float numbers[N];
  ehsid_report report;
  memset(&storage, 0, sizeof storage);
  ehsid_estimator* estimator = (ehsid_estimator*)(void*)&storage;
  CHECK(ehsid_step(estimator, 0.0F, 0.0F) == EHSID_NOT_INITIALISED);
  CHECK(ehsid_theta(estimator, numbers, N) == EHSID_NOT_INITIALISED);
  CHECK(ehsid_read(estimator, &report) == EHSID_NOT_INITIALISED);
  CHECK(ehsid_save(estimator, &storage, sizeof storage, NULL) == EHSID_NOT_INITIALISED);
  CHECK(ehsid_parameters(estimator) == 0);
}

#define KERNELS(policy)                                                          \
  {EHSID_KERNEL(policy, 2),  EHSID_KERNEL(policy, 3),  EHSID_KERNEL(policy, 4),  \
   EHSID_KERNEL(policy, 5),  EHSID_KERNEL(policy, 6),  EHSID_KERNEL(policy, 7),  \
   EHSID_KERNEL(policy, 8),  EHSID_KERNEL(policy, 9),  EHSID_KERNEL(policy, 10), \
   EHSID_KERNEL(policy, 11), EHSID_KERNEL(policy, 12), EHSID_KERNEL(policy, 13)},

/* All policies and sizes start from their defaults in storage of their size and estimate. */
static void test_every_kernel(void) {
  static const ehsid_kernel* const kernels[][12] = {EHSID_EACH_POLICY(KERNELS)};
  for (size_t policy = 0; policy < sizeof kernels / sizeof kernels[0]; ++policy) {
    for (int32_t n = 2; n <= EHSID_MAX_PARAMETERS; ++n) {
      uint64_t storage[EHSID_STORAGE_WORDS(EHSID_MAX_PARAMETERS)];
      const ehsid_kernel* kernel = kernels[policy][n - 2];
      const bool offset = n == EHSID_MAX_PARAMETERS;
      const int32_t na = n / 2;
      const int32_t nb = n - na - (offset ? 1 : 0);
      ehsid_configuration configuration;
      ehsid_estimator* estimator = NULL;
      plant p = {3U, 0.0F, 0.0F, 0.0F, 0.0F};
      CHECK(ehsid_storage_bytes(kernel) <= (size_t)EHSID_STORAGE_BYTES(n));
      CHECK(ehsid_snapshot_bytes(kernel) <= (size_t)EHSID_SNAPSHOT_BYTES(n));
      CHECK(ehsid_default_configuration(&configuration, kernel, na, nb, 1, offset) == EHSID_OK);
      CHECK(ehsid_init(&estimator, storage, ehsid_storage_bytes(kernel), &configuration) ==
            EHSID_OK);
      CHECK(ehsid_parameters(estimator) == (size_t)n);
      int taken = 0;
      for (int k = 0; k < 300; ++k) {
        float command;
        float position;
        next_sample(&p, k, &command, &position);
        taken += ehsid_step(estimator, command, position) == EHSID_OK;
      }
      ehsid_report report;
      CHECK(ehsid_read(estimator, &report) == EHSID_OK);
      CHECK(taken > 100);
      CHECK(report.fit_percent > 0.0F);
    }
  }
}

int main(void) {
  test_status_names();
  test_it_estimates();
  test_refusals_change_nothing();
  test_storage_that_was_never_initialised();
  test_every_kernel();
  return failures == 0 ? 0 : 1;
}
