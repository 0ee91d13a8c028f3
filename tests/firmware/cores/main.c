/* SPDX-License-Identifier: MIT
 * The self-test of an exported C99 estimator on a bare core, and the mean number of instructions of a step. */
#include <math.h>
#include <stdint.h>

#include "port.h"
#include "servo_estimator.h"

#define STEPS 1000U

static servo_state state;

static void number(uint32_t value) {
  char digits[11];
  char* at = &digits[10];
  *at = '\0';
  do {
    *--at = (char)('0' + value % 10U);
    value /= 10U;
  } while (value != 0U);
  port_write(at);
}

int main(void) {
  uint32_t before;
  uint32_t k;
  float position = 0.0F;
  uint32_t random = 1U;
  if (!servo_self_test()) {
    port_write("other bits");
    port_stop(1);
  }
  servo_init(&state);
  before = port_instructions();
  for (k = 0U; k < STEPS; ++k) {
    float command;
    random = random * 1664525U + 1013904223U;
    command = (float)(int32_t)random * 4.6e-10F;
    position = 0.9F * position + 0.1F * command;
    (void)servo_step(&state, command, position);
  }
  number((port_instructions() - before) / STEPS);
  port_stop(0);
  return 0;
}
