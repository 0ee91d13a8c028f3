/* SPDX-License-Identifier: MIT
 * Snapshots in C: an estimator goes on from one bit for bit, and refuses all that is not exactly one of its own. */
#include "check.h"

#include <ehsid/c_api.h>

#include <stdlib.h>

#define N 6

typedef union bench {
  uint64_t words[EHSID_STORAGE_WORDS(N)];
  unsigned char bytes[EHSID_STORAGE_BYTES(N)];
} bench;

typedef struct snapshot {
  unsigned char bytes[EHSID_SNAPSHOT_BYTES(N) + 1];
  size_t count;
} snapshot;

static ehsid_configuration usual(const ehsid_kernel* kernel) {
  ehsid_configuration made;
  CHECK(ehsid_default_configuration(&made, kernel, 3, 3, 1, false) == EHSID_OK);
  return made;
}

static ehsid_estimator* started(bench* storage, const ehsid_configuration* configuration,
                                int samples, int memory) {
  ehsid_estimator* estimator = NULL;
  plant p = {7U, 0.0F, 0.0F, 0.0F, 0.0F};
  memset(storage, memory, sizeof *storage);
  CHECK(ehsid_init(&estimator, storage, sizeof *storage, configuration) == EHSID_OK);
  for (int k = 0; k < samples; ++k) {
    float command;
    float position;
    next_sample(&p, k, &command, &position);
    CHECK(!ehsid_is_error(ehsid_step(estimator, command, position)));
  }
  return estimator;
}

static snapshot saved(const ehsid_estimator* estimator, int memory) {
  snapshot made;
  memset(&made, memory, sizeof made);
  CHECK(ehsid_save(estimator, made.bytes, sizeof made.bytes, &made.count) == EHSID_OK);
  return made;
}

/* Refused for this reason, and the storage is byte for byte what it was. */
static bool refused(ehsid_estimator* estimator, bench* storage, const void* bytes, size_t count,
                    ehsid_snapshot_fault expected) {
  const bench before = *storage;
  ehsid_snapshot_fault fault = EHSID_SNAPSHOT_FITS;
  return ehsid_check_snapshot(estimator, bytes, count, &fault) == EHSID_OK && fault == expected &&
         ehsid_restore(estimator, bytes, count) == EHSID_INVALID_ARGUMENT &&
         memcmp(&before, storage, sizeof before) == 0;
}

/* With the first six bytes damaged it is no snapshot or one of another version. */
static ehsid_snapshot_fault fault_at(size_t byte) {
  return byte < 4   ? EHSID_SNAPSHOT_UNKNOWN
         : byte < 6 ? EHSID_SNAPSHOT_OTHER_VERSION
                    : EHSID_SNAPSHOT_DAMAGED;
}

static void test_damage(const ehsid_kernel* kernel) {
  bench storage;
  const ehsid_configuration configuration = usual(kernel);
  snapshot good = saved(started(&storage, &configuration, 300, 0), 0);
  ehsid_estimator* estimator = started(&storage, &configuration, 200, 0);
  size_t accepted = 0;
  for (size_t bit = 0; bit < 8 * good.count; ++bit) {
    good.bytes[bit / 8] ^= (unsigned char)(1U << bit % 8);
    accepted += !refused(estimator, &storage, good.bytes, good.count, fault_at(bit / 8));
    good.bytes[bit / 8] ^= (unsigned char)(1U << bit % 8);
  }
  CHECK(accepted == 0);
  for (size_t count = 0; count <= good.count + 1; ++count) {
    /* A copy of exactly this length, so that a sanitizer sees any byte read behind it. */
    unsigned char* copy = malloc(count + 1);
    CHECK(copy != NULL);
    if (copy != NULL && count != good.count) {
      memcpy(copy + 1, good.bytes, count); /* at an odd address */
      accepted += !refused(estimator, &storage, copy + 1, count,
                           count < 6 ? EHSID_SNAPSHOT_UNKNOWN : EHSID_SNAPSHOT_DAMAGED);
    }
    free(copy);
  }
  CHECK(accepted == 0);
  CHECK(ehsid_restore(estimator, good.bytes, good.count) == EHSID_OK);
}

static void test_it_goes_on(const ehsid_kernel* kernel) {
  bench storage;
  bench other;
  const ehsid_configuration configuration = usual(kernel);
  ehsid_estimator* estimator = started(&storage, &configuration, 300, 0x00);
  ehsid_estimator* restored = started(&other, &configuration, 50, 0xFF);
  plant p = {99U, 0.0F, 0.0F, 0.0F, 0.0F};
  unsigned char bytes[EHSID_SNAPSHOT_BYTES(N) + 1];
  size_t written = 0;
  CHECK(ehsid_save(estimator, bytes + 1, sizeof bytes - 1, &written) == EHSID_OK);
  CHECK(written <= ehsid_snapshot_bytes(kernel));
  CHECK(ehsid_save(estimator, bytes + 1, written - 1, &written) == EHSID_STORAGE_TOO_SMALL);
  CHECK(ehsid_restore(restored, bytes + 1, written) == EHSID_OK);
  for (int k = 0; k < 500; ++k) {
    float command;
    float position;
    next_sample(&p, k, &command, &position);
    CHECK(ehsid_step(estimator, command, position) == ehsid_step(restored, command, position));
  }
  const snapshot one = saved(estimator, 0x00);
  const snapshot same = saved(restored, 0xFF);
  CHECK(one.count == same.count && memcmp(one.bytes, same.bytes, one.count) == 0);
}

/* One of the settings that every policy has, and one of C's own: the seed, which only says where to start. */
static void test_configurations(const ehsid_kernel* kernel) {
  bench storage;
  bench other;
  const ehsid_configuration configuration = usual(kernel);
  ehsid_configuration changed = configuration;
  const snapshot good = saved(started(&storage, &configuration, 300, 0), 0);
  changed.reset_long_window = 300.0F;
  CHECK(refused(started(&other, &changed, 10, 0), &other, good.bytes, good.count,
                EHSID_SNAPSHOT_OTHER_CONFIGURATION));
  changed = configuration;
  changed.nk = 2;
  CHECK(refused(started(&other, &changed, 10, 0), &other, good.bytes, good.count,
                EHSID_SNAPSHOT_OTHER_MODEL));
  ehsid_estimate seed;
  memset(&seed, 0, sizeof seed);
  for (int i = 0; i < N; ++i) {
    seed.d[i] = 1.0F;
  }
  changed = configuration;
  changed.seed = &seed;
  CHECK(ehsid_restore(started(&other, &changed, 10, 0), good.bytes, good.count) == EHSID_OK);
}

static void test_policies_refuse_each_other(const ehsid_kernel* one, const ehsid_kernel* other) {
  bench storage;
  bench second;
  const ehsid_configuration a = usual(one);
  const ehsid_configuration b = usual(other);
  const snapshot good = saved(started(&storage, &a, 300, 0), 0);
  CHECK(refused(started(&second, &b, 10, 0), &second, good.bytes, good.count,
                EHSID_SNAPSHOT_OTHER_MODEL));
}

static void test_arguments(const ehsid_kernel* kernel) {
  bench storage;
  const ehsid_configuration configuration = usual(kernel);
  ehsid_estimator* estimator = started(&storage, &configuration, 10, 0);
  const snapshot good = saved(estimator, 0);
  ehsid_snapshot_fault fault = EHSID_SNAPSHOT_DAMAGED;
  CHECK(ehsid_check_snapshot(NULL, good.bytes, good.count, &fault) == EHSID_INVALID_ARGUMENT);
  CHECK(ehsid_check_snapshot(estimator, NULL, good.count, &fault) == EHSID_INVALID_ARGUMENT);
  CHECK(ehsid_check_snapshot(estimator, good.bytes, good.count, NULL) == EHSID_INVALID_ARGUMENT);
  CHECK(fault == EHSID_SNAPSHOT_DAMAGED);
  CHECK(ehsid_check_snapshot(estimator, good.bytes, good.count, &fault) == EHSID_OK);
  CHECK(fault == EHSID_SNAPSHOT_FITS);
}

#define KERNEL(policy) EHSID_KERNEL(policy, N),

int main(void) {
  static const ehsid_kernel* const kernels[] = {EHSID_EACH_POLICY(KERNEL)};
  const size_t policies = sizeof kernels / sizeof kernels[0];
  for (size_t i = 0; i < policies; ++i) {
    test_damage(kernels[i]);
    test_it_goes_on(kernels[i]);
    test_configurations(kernels[i]);
    test_policies_refuse_each_other(kernels[i], kernels[(i + 1) % policies]);
  }
  test_arguments(kernels[0]);
  return failures == 0 ? 0 : 1;
}
