/* SPDX-License-Identifier: MIT
 * ehsid::ServoEstimator<float> itself, for a test in C. */
#ifndef EHSID_TESTS_C_SERVO_REFERENCE_H
#define EHSID_TESTS_C_SERVO_REFERENCE_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct servo_reference {
  float gain;
  float half_width;
  float xi;
  bool trusted;
} servo_reference;

void servo_reference_start(float dt_s);
/* Returns the number of the status. */
int servo_reference_step(float command, float position, servo_reference* told);

#ifdef __cplusplus
}
#endif

#endif
