/* SPDX-License-Identifier: MIT
 * The C estimators, configured by the exported C headers, and the C++ ones, configured by the exported C++ headers of
 * the same settings: every number the same bits after every sample, for every policy, over excitation, a hold, a
 * change of the plant, refused samples, a reset and a pause. */
#include "check.h"
#include "reference.h"

#include <math.h>

#define CONFIGURATION(name) &name##_configuration,
static const ehsid_configuration* const configurations[CASES] = {EXPORTED_CASES(CONFIGURATION)};

static void read_all(const ehsid_estimator* estimator, ehsid_status status, readings* made) {
  made->status = (int32_t)status;
  CHECK(ehsid_theta(estimator, made->theta, EHSID_MAX_PARAMETERS) == EHSID_OK);
  CHECK(ehsid_standard_deviation(estimator, made->deviation, EHSID_MAX_PARAMETERS) == EHSID_OK);
  CHECK(ehsid_covariance_diagonal(estimator, made->variance, EHSID_MAX_PARAMETERS) == EHSID_OK);
  CHECK(ehsid_read(estimator, &made->report) == EHSID_OK);
}

static int seen[EHSID_NOT_INITIALISED + 1];

static void compare(int which) {
  uint64_t storage[EHSID_STORAGE_WORDS(EHSID_MAX_PARAMETERS)];
  ehsid_estimator* estimator = NULL;
  plant p = {12345U + (uint32_t)which, 0.0F, 0.0F, 0.0F, 0.0F};
  int differing = 0;
  CHECK(ehsid_init(&estimator, storage, sizeof storage, configurations[which]) == EHSID_OK);
  CHECK(reference_start(which) == EHSID_OK);
  for (int k = 0; k < 3000; ++k) {
    readings expected;
    readings made;
    float command;
    float position;
    /* The bytes between members too. */
    memset(&expected, 0, sizeof expected);
    memset(&made, 0, sizeof made);
    next_sample(&p, k, &command, &position);
    if (k == 1000) {
      position = NAN;
    } else if (k == 1010) {
      command = 1e30F;
    } else if (k == 1100) {
      CHECK(ehsid_reset(estimator) == EHSID_OK);
      reference_reset(which);
    } else if (k == 1200 || k == 1220) {
      CHECK(ehsid_enable(estimator, k == 1220) == EHSID_OK);
      reference_enable(which, k == 1220);
    }
    reference_step(which, command, position, &expected);
    read_all(estimator, ehsid_step(estimator, command, position), &made);
    differing += memcmp(&made, &expected, sizeof made) != 0;
    ++seen[made.status];
  }
  if (differing != 0) {
    printf("case %d: %d samples of 3000 differ\n", which, differing);
    ++failures;
  }
}

int main(void) {
  for (int which = 0; which < CASES; ++which) {
    compare(which);
  }
  /* What was compared: every way a step may end, but for a numerical limit. */
  CHECK(seen[EHSID_OK] > 1000);
  CHECK(seen[EHSID_FILLING] > 0);
  CHECK(seen[EHSID_NO_INFORMATION] > 0);
  CHECK(seen[EHSID_DISABLED] == CASES * 20);
  CHECK(seen[EHSID_RESET] > 0);
  CHECK(seen[EHSID_INVALID_INPUT] == CASES);
  CHECK(seen[EHSID_OUT_OF_RANGE] == CASES);
  return failures == 0 ? 0 : 1;
}
