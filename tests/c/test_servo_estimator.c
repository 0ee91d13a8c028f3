/* SPDX-License-Identifier: MIT
 * The estimator of a servo in C: it finds K, tells the bits of C++, and refuses without a change. */
#include "check.h"
#include "servo_reference.h"

#include "../export/servo_estimator.h"

#include <ehsid/c_api.h>

#include <math.h>

typedef union bench {
  uint64_t words[EHSID_SERVO_STORAGE_WORDS];
  unsigned char bytes[8 * EHSID_SERVO_STORAGE_WORDS];
} bench;

static ehsid_servo_estimator* started(bench* storage) {
  const ehsid_servo_settings settings = ehsid_servo_defaults(0.01F);
  ehsid_servo_estimator* estimator = NULL;
  memset(storage, 0, sizeof *storage);
  CHECK(ehsid_servo_init(&estimator, storage, sizeof *storage, &settings) == EHSID_OK);
  return estimator;
}

/* A servo of 0.05 m/s per V, 25 rad/s and xi 0.4, sampled every 10 ms in a loop with steps of +-20 mm, and a sensor with
 * 5 um of noise. Ten steps of Euler a sample. */
static void next_servo_sample(plant* p, int k, float* command, float* position) {
  const float target = k / 60 % 2 == 0 ? 0.02F : -0.02F;
  for (int i = 0; i < 10; ++i) {
    p->before += 0.001F * (625.0F * (0.05F * p->command - p->y2) - 20.0F * p->before);
    p->y2 += 0.001F * p->before; /* velocity */
    p->y1 += 0.001F * p->y2;
  }
  *position = p->y1 + 5e-6F * next_random(&p->random);
  *command = p->command = 80.0F * (target - *position);
}

static void test_the_bits_of_cpp(void) {
  bench storage;
  bench other;
  unsigned char bytes[EHSID_SERVO_SNAPSHOT_BYTES];
  unsigned char again[EHSID_SERVO_SNAPSHOT_BYTES];
  size_t count = 0;
  size_t count_again = 0;
  plant p = {7U, 0.0F, 0.0F, 0.0F, 0.0F};
  ehsid_tracked_servo told;
  servo_reference reference;
  ehsid_servo_estimator* estimator = started(&storage);
  ehsid_servo_estimator* restored = started(&other);
  servo_reference_start(0.01F);
  for (int k = 0; k < 2000; ++k) {
    float command;
    float position;
    next_servo_sample(&p, k, &command, &position);
    const ehsid_status status = ehsid_servo_step(estimator, command, position);
    CHECK(ehsid_servo_read(estimator, &told) == EHSID_OK);
    CHECK(servo_reference_step(command, position, &reference) == (int)status);
    CHECK(memcmp(&told.gain.value, &reference.gain, sizeof(float)) == 0);
    CHECK(memcmp(&told.gain.half_width, &reference.half_width, sizeof(float)) == 0);
    CHECK(memcmp(&told.xi.value, &reference.xi, sizeof(float)) == 0);
    CHECK(told.gain.trusted == reference.trusted);
    if (k == 900) {
      CHECK(ehsid_servo_save(estimator, bytes, sizeof bytes, &count) == EHSID_OK);
      CHECK(ehsid_servo_restore(restored, bytes, count) == EHSID_OK);
    } else if (k > 900) {
      CHECK(ehsid_servo_step(restored, command, position) == status);
    }
  }
  CHECK(told.gain.trusted && told.gain.reason == EHSID_TRUSTED);
  CHECK(fabsf(told.gain.value - 0.05F) < 0.0025F);
  CHECK(ehsid_servo_save(estimator, bytes, sizeof bytes, &count) == EHSID_OK);
  CHECK(ehsid_servo_save(restored, again, sizeof again, &count_again) == EHSID_OK);
  CHECK(count == count_again && memcmp(bytes, again, count) == 0);
}

static void test_an_exported_header_is_accepted(void) {
  bench storage;
  ehsid_servo_estimator* estimator = NULL;
  CHECK(ehsid_servo_init(&estimator, &storage, sizeof storage, &servo_estimator_settings) ==
        EHSID_OK);
  CHECK(servo_estimator_settings.dt_s == 0.002F && servo_estimator_settings.delay == 6);
  CHECK(servo_estimator_settings.drift == 0.03F && servo_estimator_settings.tolerance == 0.15F);
}

static void test_refusals_change_nothing(void) {
  bench storage;
  bench copy;
  unsigned char bytes[EHSID_SERVO_SNAPSHOT_BYTES];
  size_t count = 0;
  ehsid_tracked_servo told;
  ehsid_servo_settings bad = ehsid_servo_defaults(0.0F);
  ehsid_servo_estimator* estimator = started(&storage);
  CHECK(ehsid_servo_step(estimator, 1.0F, 0.0F) == EHSID_FILLING);
  CHECK(ehsid_servo_save(estimator, bytes, sizeof bytes, &count) == EHSID_OK);
  copy = storage;
  CHECK(ehsid_servo_init(&estimator, &storage, sizeof storage, &bad) == EHSID_INVALID_ARGUMENT);
  bad = ehsid_servo_defaults(0.01F);
  bad.delay = EHSID_MAX_DELAY + 1;
  CHECK(ehsid_servo_init(&estimator, &storage, sizeof storage, &bad) == EHSID_INVALID_ARGUMENT);
  bad.delay = 1;
  CHECK(ehsid_servo_init(&estimator, storage.bytes + 1, sizeof storage - 8, &bad) ==
        EHSID_STORAGE_TOO_SMALL);
  CHECK(ehsid_servo_init(&estimator, &storage, 100, &bad) == EHSID_STORAGE_TOO_SMALL);
  CHECK(ehsid_servo_init(NULL, &storage, sizeof storage, &bad) == EHSID_INVALID_ARGUMENT);
  CHECK(ehsid_servo_init(&estimator, NULL, sizeof storage, &bad) == EHSID_INVALID_ARGUMENT);
  CHECK(ehsid_servo_init(&estimator, &storage, sizeof storage, NULL) == EHSID_INVALID_ARGUMENT);
  CHECK(ehsid_servo_step(NULL, 0.0F, 0.0F) == EHSID_INVALID_ARGUMENT);
  CHECK(ehsid_servo_read(estimator, NULL) == EHSID_INVALID_ARGUMENT);
  CHECK(ehsid_servo_read(NULL, &told) == EHSID_INVALID_ARGUMENT);
  CHECK(ehsid_servo_save(estimator, bytes, count - 1, NULL) == EHSID_STORAGE_TOO_SMALL);
  CHECK(ehsid_servo_save(estimator, NULL, count, NULL) == EHSID_INVALID_ARGUMENT);
  CHECK(ehsid_servo_restore(estimator, bytes, count - 1) == EHSID_INVALID_ARGUMENT);
  CHECK(ehsid_servo_restore(estimator, NULL, count) == EHSID_INVALID_ARGUMENT);
  bytes[50] = (unsigned char)(bytes[50] ^ 1U);
  CHECK(ehsid_servo_restore(estimator, bytes, count) == EHSID_INVALID_ARGUMENT);
  CHECK(memcmp(&copy, &storage, sizeof copy) == 0);
  memset(&copy, 0, sizeof copy);
  CHECK(ehsid_servo_step((ehsid_servo_estimator*)(void*)&copy, 0.0F, 0.0F) ==
        EHSID_NOT_INITIALISED);
}

int main(void) {
  test_the_bits_of_cpp();
  test_an_exported_header_is_accepted();
  test_refusals_change_nothing();
  return failures == 0 ? 0 : 1;
}
