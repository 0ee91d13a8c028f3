/* SPDX-License-Identifier: MIT
 * Prints what the C functions answer to bad calls: what is wrong, the call, the status; tabs in between. The output
 * is kept in bad_calls.txt, from which docs/bad_input.md takes it. No refused call changes the estimator. */
#include "check.h"

#include <ehsid/c_api.h>

#include <math.h>

#define N 4

typedef union bench {
  uint64_t words[EHSID_STORAGE_WORDS(N)];
  unsigned char bytes[EHSID_STORAGE_BYTES(N) + 8];
} bench;

static void say(const char* wrong, const char* call, ehsid_status status) {
  printf("%s\t%s\t%s\n", wrong, call, ehsid_status_name(status));
}

static ehsid_configuration usual(void) {
  ehsid_configuration made;
  memset(&made, 0, sizeof made);
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
  for (int k = 0; k < 200; ++k) {
    float command;
    float position;
    next_sample(&p, k, &command, &position);
    CHECK(!ehsid_is_error(ehsid_step(estimator, command, position)));
  }
  return estimator;
}

static void default_configurations(void) {
  ehsid_configuration made;
  const ehsid_kernel* kernel = EHSID_KERNEL(exponential, N);
#define DEFAULT(wrong, ...)                                   \
  say(wrong, "ehsid_default_configuration(" #__VA_ARGS__ ")", \
      ehsid_default_configuration(__VA_ARGS__))
  DEFAULT("no configuration", NULL, kernel, 2, 2, 1, false);
  DEFAULT("no kernel", &made, NULL, 2, 2, 1, false);
  DEFAULT("an order of 0", &made, kernel, 0, 4, 1, false);
  DEFAULT("an order of 7", &made, kernel, 7, 2, 1, false);
  DEFAULT("a delay below 0", &made, kernel, 2, 2, -1, false);
  DEFAULT("a delay of 21 samples", &made, kernel, 2, 2, 21, false);
  DEFAULT("orders of another number of parameters", &made, kernel, 3, 2, 1, false);
  DEFAULT("a constant term that the kernel has no room for", &made, kernel, 2, 2, 1, true);
#undef DEFAULT
}

/* One member is set before ehsid_init(). */
#define INIT(wrong, member, value)                                                       \
  do {                                                                                   \
    bench storage;                                                                       \
    ehsid_estimator* estimator = NULL;                                                   \
    ehsid_configuration c = usual();                                                     \
    c.member = value;                                                                    \
    say(wrong, "c." #member " = " #value "; ehsid_init(&estimator, storage, bytes, &c)", \
        ehsid_init(&estimator, &storage, sizeof storage, &c));                           \
    CHECK(estimator == NULL);                                                            \
  } while (0)

static void configurations(void) {
  INIT("no kernel", kernel, NULL);
  INIT("an order beyond that of the kernel", na, 3);
  INIT("a delay below 0", nk, -1);
  INIT("a scale of zero", command_scale, 0.0F);
  INIT("a negative scale", position_scale, -1.0F);
  INIT("a scale that is not a number", position_scale, NAN);
  INIT("an infinite offset", command_offset, INFINITY);
  INIT("a forgetting rate of 0", forgetting.lambda0, 0.0F);
  INIT("a forgetting rate above 1", forgetting.lambda0, 1.5F);
  INIT("a forgetting rate that is not a number", forgetting.lambda0, NAN);
  INIT("a start variance of 0", variance0, 0.0F);
  INIT("an infinite start variance", variance0, INFINITY);
  INIT("a ceiling of 0", covariance_ceiling, 0.0F);
  INIT("an input limit of 0", input_limit, 0.0F);
  INIT("a window below one sample", reset_short_window, 0.5F);
  INIT("a long window shorter than the short one", reset_long_window, 1.0F);
  INIT("a negative cool-down", reset_cool_down, -1);
  INIT("a tolerance of 0", convergence_tolerance, 0.0F);
  INIT("a hold of 0 samples", convergence_hold, 0);
}

static void storages(void) {
  bench storage;
  ehsid_estimator* estimator = NULL;
  const ehsid_configuration c = usual();
  say("no place for the pointer", "ehsid_init(NULL, storage, bytes, &c)",
      ehsid_init(NULL, &storage, sizeof storage, &c));
  say("no storage", "ehsid_init(&estimator, NULL, bytes, &c)",
      ehsid_init(&estimator, NULL, sizeof storage, &c));
  say("no configuration", "ehsid_init(&estimator, storage, bytes, NULL)",
      ehsid_init(&estimator, &storage, sizeof storage, NULL));
  say("one byte too few", "ehsid_init(&estimator, storage, needed - 1, &c)",
      ehsid_init(&estimator, &storage, ehsid_storage_bytes(c.kernel) - 1, &c));
  say("storage that is not aligned", "ehsid_init(&estimator, storage + 1, bytes, &c)",
      ehsid_init(&estimator, storage.bytes + 1, sizeof storage - 1, &c));
  memset(&storage, 0, sizeof storage);
  say("a sample before ehsid_init()", "ehsid_step(zeroed, 1, 1)",
      ehsid_step((ehsid_estimator*)&storage, 1.0F, 1.0F));
  CHECK(estimator == NULL);
}

/* The state must be the same behind the refused call as before it. */
#define CALL(wrong, shown, call)                                             \
  do {                                                                       \
    unsigned char before[EHSID_SNAPSHOT_BYTES(N)];                           \
    unsigned char after[EHSID_SNAPSHOT_BYTES(N)];                            \
    size_t written = 0;                                                      \
    CHECK(ehsid_save(estimator, before, sizeof before, NULL) == EHSID_OK);   \
    say(wrong, shown, call);                                                 \
    CHECK(ehsid_save(estimator, after, sizeof after, &written) == EHSID_OK); \
    CHECK(memcmp(before, after, written) == 0);                              \
  } while (0)

static void samples(void) {
  bench storage;
  ehsid_estimator* estimator = started(&storage);
  float theta_before[N];
  float theta_after[N];
  CHECK(ehsid_theta(estimator, theta_before, N) == EHSID_OK);
  CALL("no estimator", "ehsid_step(NULL, 1, 1)", ehsid_step(NULL, 1.0F, 1.0F));
  /* These three keep the estimate, and start the history anew. */
  say("a command that is not a number", "ehsid_step(e, NAN, 1)", ehsid_step(estimator, NAN, 1.0F));
  say("an infinite position", "ehsid_step(e, 1, INFINITY)", ehsid_step(estimator, 1.0F, INFINITY));
  say("a position beyond input_limit", "ehsid_step(e, 1, 1e30F)",
      ehsid_step(estimator, 1.0F, 1e30F));
  CHECK(ehsid_theta(estimator, theta_after, N) == EHSID_OK);
  CHECK(memcmp(theta_before, theta_after, sizeof theta_before) == 0);
}

static void queries(void) {
  bench storage;
  ehsid_estimator* estimator = started(&storage);
  float numbers[N];
  float matrix[N * N];
  unsigned char snapshot[EHSID_SNAPSHOT_BYTES(N)];
  CALL("no estimator", "ehsid_theta(NULL, theta, 4)", ehsid_theta(NULL, numbers, N));
  CALL("nowhere to write", "ehsid_theta(e, NULL, 4)", ehsid_theta(estimator, NULL, N));
  CALL("room for too few numbers", "ehsid_theta(e, theta, 3)",
       ehsid_theta(estimator, numbers, N - 1));
  CALL("room for too few numbers", "ehsid_standard_deviation(e, deviation, 3)",
       ehsid_standard_deviation(estimator, numbers, N - 1));
  CALL("room for too few numbers", "ehsid_covariance_diagonal(e, variance, 3)",
       ehsid_covariance_diagonal(estimator, numbers, N - 1));
  CALL("no estimator", "ehsid_covariance(NULL, covariance, 16)",
       ehsid_covariance(NULL, matrix, N * N));
  CALL("nowhere to write", "ehsid_covariance(e, NULL, 16)",
       ehsid_covariance(estimator, NULL, N * N));
  CALL("room for the diagonal alone", "ehsid_covariance(e, covariance, 4)",
       ehsid_covariance(estimator, matrix, N));
  CALL("nowhere to write", "ehsid_read(e, NULL)", ehsid_read(estimator, NULL));
  CALL("nowhere to write", "ehsid_save(e, NULL, bytes, NULL)",
       ehsid_save(estimator, NULL, sizeof snapshot, NULL));
  CALL("room for too few bytes", "ehsid_save(e, bytes, 10, NULL)",
       ehsid_save(estimator, snapshot, 10, NULL));
  CALL("no estimator", "ehsid_reset(NULL)", ehsid_reset(NULL));
  CALL("no estimator", "ehsid_enable(NULL, true)", ehsid_enable(NULL, true));
}

static void servos(void) {
  const float theta[6] = {0};
  const float covariance[36] = {0};
  ehsid_servo servo;
  ehsid_servo before;
  memset(&servo, 0x5A, sizeof servo);
  before = servo;
  say("no parameters", "ehsid_identify_servo(NULL, covariance, 0.05F, &servo)",
      ehsid_identify_servo(NULL, covariance, 0.05F, &servo));
  say("no covariance", "ehsid_identify_servo(theta, NULL, 0.05F, &servo)",
      ehsid_identify_servo(theta, NULL, 0.05F, &servo));
  CHECK(memcmp(&servo, &before, sizeof servo) == 0);
  say("nowhere to write", "ehsid_identify_servo(theta, covariance, 0.05F, NULL)",
      ehsid_identify_servo(theta, covariance, 0.05F, NULL));
}

static void snapshots(void) {
  bench storage;
  bench other_storage;
  ehsid_estimator* estimator = started(&storage);
  ehsid_estimator* other = NULL;
  unsigned char bytes[EHSID_SNAPSHOT_BYTES(N)];
  unsigned char nothing[EHSID_SNAPSHOT_BYTES(N)];
  size_t count = 0;
  ehsid_configuration c = usual();
  c.nk = 2;
  memset(nothing, 0, sizeof nothing);
  CHECK(ehsid_init(&other, &other_storage, sizeof other_storage, &c) == EHSID_OK);
  CHECK(ehsid_save(other, bytes, sizeof bytes, &count) == EHSID_OK);
  CALL("no bytes", "ehsid_restore(e, NULL, count)", ehsid_restore(estimator, NULL, count));
  CALL("a snapshot cut by one byte", "ehsid_restore(e, bytes, count - 1)",
       ehsid_restore(estimator, bytes, count - 1));
  CALL("zeros for a snapshot", "ehsid_restore(e, zeros, count)",
       ehsid_restore(estimator, nothing, count));
  CALL("the snapshot of an estimator with another delay", "ehsid_restore(e, bytes, count)",
       ehsid_restore(estimator, bytes, count));
}

static void seeds(void) {
  bench storage;
  ehsid_estimator* estimator = started(&storage);
  ehsid_estimate seed;
  memset(&seed, 0, sizeof seed);
  for (int i = 0; i < N; ++i) {
    seed.d[i] = 1.0F;
  }
  CALL("no estimate", "ehsid_seed(e, NULL)", ehsid_seed(estimator, NULL));
  seed.theta[1] = NAN;
  CALL("a parameter that is not a number", "seed.theta[1] = NAN; ehsid_seed(e, &seed)",
       ehsid_seed(estimator, &seed));
  seed.theta[1] = 0.0F;
  seed.d[2] = -1.0F;
  CALL("a variance below 0", "seed.d[2] = -1; ehsid_seed(e, &seed)", ehsid_seed(estimator, &seed));
  seed.d[2] = 1.0F;
  seed.u[0] = INFINITY;
  CALL("an infinite number in U", "seed.u[0] = INFINITY; ehsid_seed(e, &seed)",
       ehsid_seed(estimator, &seed));
  seed.u[0] = 0.0F;
  seed.noise_variance = -1.0F;
  CALL("a noise below 0", "seed.noise_variance = -1; ehsid_seed(e, &seed)",
       ehsid_seed(estimator, &seed));
}

int main(void) {
  default_configurations();
  configurations();
  storages();
  samples();
  queries();
  servos();
  snapshots();
  seeds();
  return failures != 0;
}
