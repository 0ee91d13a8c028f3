/* SPDX-License-Identifier: MIT
 * A test in C: checks that count, and the samples that every test sees. */
#ifndef EHSID_TESTS_C_CHECK_H
#define EHSID_TESTS_C_CHECK_H

#include <stdint.h>
#include <stdio.h>
#include <string.h>

static int failures = 0;

#define CHECK(condition)                                             \
  do {                                                               \
    if (!(condition)) {                                              \
      printf("%s:%d: failed: %s\n", __FILE__, __LINE__, #condition); \
      ++failures;                                                    \
    }                                                                \
  } while (0)

/* Numerical Recipes' linear congruential generator, mapped to [-1, 1). */
static inline float next_random(uint32_t* state) {
  *state = *state * 1664525U + 1013904223U;
  return (float)(*state >> 8) / 8388608.0F - 1.0F;
}

typedef struct plant {
  uint32_t random;
  float command, before;
  float y1, y2;
} plant;

/* y(k) = 1.6 y(k-1) - 0.68 y(k-2) + b u(k-1) + 0.01 e, with a command of random steps that is held still in between. */
static inline void next_sample(plant* p, int k, float* command, float* position) {
  const float b = k < 700 ? 0.05F : 0.1F;
  const float y = 1.6F * p->y1 - 0.68F * p->y2 + b * p->command + 0.01F * next_random(&p->random);
  p->y2 = p->y1;
  p->y1 = y;
  if (k < 400 || k > 550) {
    p->command = next_random(&p->random);
  }
  *command = p->command;
  *position = y;
}

#endif
