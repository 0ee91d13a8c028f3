/* SPDX-License-Identifier: MIT
 * The covariance of an estimate, and the servo that its parameters describe. */
#include "check.h"

#include <ehsid/c_api.h>

#include <math.h>

#define N 6

static void test_covariance(void) {
  uint64_t storage[EHSID_STORAGE_WORDS(N)];
  ehsid_configuration configuration;
  ehsid_estimator* estimator = NULL;
  plant p = {7U, 0.0F, 0.0F, 0.0F, 0.0F};
  float covariance[N * N];
  float variance[N];
  CHECK(ehsid_default_configuration(&configuration, EHSID_KERNEL(constant, N), 3, 3, 1, false) ==
        EHSID_OK);
  CHECK(ehsid_init(&estimator, storage, sizeof storage, &configuration) == EHSID_OK);
  for (int k = 0; k < 200; ++k) {
    float command;
    float position;
    next_sample(&p, k, &command, &position);
    CHECK(!ehsid_is_error(ehsid_step(estimator, command, position)));
  }
  CHECK(ehsid_covariance(estimator, covariance, N * N) == EHSID_OK);
  CHECK(ehsid_covariance_diagonal(estimator, variance, N) == EHSID_OK);
  for (int i = 0; i < N; ++i) {
    CHECK(covariance[N * i + i] == variance[i]);
    for (int j = 0; j < i; ++j) {
      const float product = covariance[N * i + j] * covariance[N * i + j];
      CHECK(covariance[N * i + j] == covariance[N * j + i]);
      CHECK(product > 0.0F && product < variance[i] * variance[j]);
    }
  }
  CHECK(ehsid_covariance(estimator, covariance, N * N - 1) == EHSID_STORAGE_TOO_SMALL);
  CHECK(ehsid_covariance(estimator, NULL, N * N) == EHSID_INVALID_ARGUMENT);
  CHECK(ehsid_covariance(NULL, covariance, N * N) == EHSID_INVALID_ARGUMENT);
}

/* Model (16) of the paper, as docs/servo_model.md reads it. */
static void test_servo(void) {
  float theta[N] = {-2.2390F, 1.7820F, -0.5427F, 0.3850F, -0.5810F, 0.2954F};
  float covariance[N * N] = {0.0F};
  ehsid_servo servo;
  CHECK(ehsid_identify_servo(theta, covariance, 0.05F, &servo) == EHSID_OK);
  CHECK(servo.status == EHSID_SERVO_OK);
  CHECK(fabsf(servo.gain - 6.556F) < 0.01F);
  CHECK(fabsf(servo.omega_n - 12.95F) < 0.01F);
  CHECK(fabsf(servo.xi - 0.471F) < 0.001F);
  CHECK(servo.omega_n_std > 0.0F && servo.omega_n_std < 0.01F); /* theta has the digits of float */
  const float rounding = servo.gain_std;
  covariance[3 * N + 3] = 1e-4F; /* b1 alone: dK = db1 / (dt Q(1)) = K db1 / (b1 + b2 + b3) */
  CHECK(ehsid_identify_servo(theta, covariance, 0.05F, &servo) == EHSID_OK);
  CHECK(fabsf(servo.gain_std - 0.01F * servo.gain / 0.0994F) < 0.01F * servo.gain_std);
  CHECK(servo.gain_std > rounding);

  CHECK(ehsid_identify_servo(theta, covariance, 0.0F, &servo) == EHSID_OK);
  CHECK(servo.status == EHSID_SERVO_INVALID_ARGUMENT);
  CHECK(isnan(servo.gain));
  theta[0] = NAN;
  CHECK(ehsid_identify_servo(theta, covariance, 0.05F, &servo) == EHSID_OK);
  CHECK(servo.status == EHSID_SERVO_NOT_FINITE);
  CHECK(ehsid_identify_servo(NULL, covariance, 0.05F, &servo) == EHSID_INVALID_ARGUMENT);
  CHECK(ehsid_identify_servo(theta, NULL, 0.05F, &servo) == EHSID_INVALID_ARGUMENT);
  CHECK(ehsid_identify_servo(theta, covariance, 0.05F, NULL) == EHSID_INVALID_ARGUMENT);
}

/* An estimator with these orders after 900 samples of the same plant. */
static ehsid_estimator* run(uint64_t* storage, size_t bytes, const ehsid_kernel* kernel, int32_t nb,
                            int32_t nk, bool offset) {
  ehsid_configuration configuration;
  ehsid_estimator* estimator = NULL;
  plant p = {7U, 0.0F, 0.0F, 0.0F, 0.0F};
  CHECK(ehsid_default_configuration(&configuration, kernel, 3, nb, nk, offset) == EHSID_OK);
  CHECK(ehsid_init(&estimator, storage, bytes, &configuration) == EHSID_OK);
  for (int k = 0; k < 900; ++k) {
    float command;
    float position;
    next_sample(&p, k, &command, &position);
    CHECK(!ehsid_is_error(ehsid_step(estimator, command, position)));
  }
  return estimator;
}

static void test_servo_of_an_estimator(void) {
  uint64_t storage[EHSID_STORAGE_WORDS(N + 1)];
  float theta[N + 1];
  float covariance[(N + 1) * (N + 1)];
  float six[N * N];
  ehsid_servo servo;
  ehsid_servo expected;
  ehsid_trust trust = EHSID_NOT_PRECISE;
  ehsid_estimator* estimator =
      run(storage, sizeof storage, EHSID_KERNEL(f_ratio, 7), 3, 1, true); /* a constant term */
  CHECK(ehsid_theta(estimator, theta, N + 1) == EHSID_OK);
  CHECK(ehsid_covariance(estimator, covariance, (N + 1) * (N + 1)) == EHSID_OK);
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < N; ++j) {
      six[N * i + j] = covariance[(N + 1) * i + j];
    }
  }
  CHECK(ehsid_identify_servo(theta, six, 0.05F, &expected) == EHSID_OK);
  CHECK(ehsid_read_servo(estimator, 0.05F, &servo, &trust) == EHSID_OK);
  CHECK(memcmp(&servo, &expected, sizeof servo) == 0);
  CHECK(trust != EHSID_TRUSTED || servo.status == EHSID_SERVO_OK);
  CHECK(ehsid_read_servo(estimator, 0.05F, &servo, NULL) == EHSID_OK);
  CHECK(ehsid_read_servo(estimator, -1.0F, &servo, NULL) == EHSID_OK);
  CHECK(servo.status == EHSID_SERVO_INVALID_ARGUMENT);

  expected = servo;
  CHECK(ehsid_read_servo(estimator, 0.05F, NULL, &trust) == EHSID_INVALID_ARGUMENT);
  CHECK(ehsid_read_servo(NULL, 0.05F, &servo, &trust) == EHSID_INVALID_ARGUMENT);
  estimator = run(storage, sizeof storage, EHSID_KERNEL(f_ratio, 6), 3, 0, false); /* nk = 0 */
  CHECK(ehsid_read_servo(estimator, 0.05F, &servo, &trust) == EHSID_INVALID_ARGUMENT);
  estimator = run(storage, sizeof storage, EHSID_KERNEL(f_ratio, 6), 2, 1, true); /* nb = 2 */
  CHECK(ehsid_read_servo(estimator, 0.05F, &servo, &trust) == EHSID_INVALID_ARGUMENT);
  CHECK(memcmp(&servo, &expected, sizeof servo) == 0); /* an error changes nothing */
}

static void test_names(void) {
  CHECK(strcmp(ehsid_servo_status_name(EHSID_SERVO_OK), "ok") == 0);
  CHECK(strcmp(ehsid_servo_status_name(EHSID_SERVO_NUMERICAL_LIMIT), "numerical_limit") == 0);
  CHECK(strcmp(ehsid_trust_name(EHSID_NOT_PRECISE), "not_precise") == 0);
  CHECK(strcmp(ehsid_snapshot_fault_name(EHSID_SNAPSHOT_IMPOSSIBLE), "impossible") == 0);
  CHECK(strcmp(ehsid_trust_name((ehsid_trust)7), "unknown") == 0);
}

int main(void) {
  test_servo_of_an_estimator();
  test_names();
  test_covariance();
  test_servo();
  return failures == 0 ? 0 : 1;
}
