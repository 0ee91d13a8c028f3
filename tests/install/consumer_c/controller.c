/* SPDX-License-Identifier: MIT */
#include "servo_configuration.h" /* ehsid export rec.csv --c --name servo --out servo_configuration.h */

#include <ehsid/c_api.h>

static uint64_t storage[SERVO_STORAGE_WORDS];
static ehsid_estimator* servo;

ehsid_status power_on(void) {
  return ehsid_init(&servo, storage, sizeof storage, &servo_configuration);
}

/* One sample. True where *b1, the gain from the last command, may be used. */
bool every_sample(float command_v, float position_m, float* b1) {
  float theta[EHSID_MAX_PARAMETERS];
  ehsid_report report;
  if (ehsid_is_error(ehsid_step(servo, command_v, position_m)) ||
      ehsid_read(servo, &report) != EHSID_OK || !report.converged ||
      ehsid_theta(servo, theta, EHSID_MAX_PARAMETERS) != EHSID_OK) {
    return false;
  }
  *b1 = theta[servo_configuration.na];
  return true;
}
