/* SPDX-License-Identifier: MIT
 * The C++ estimators that the exported headers of tests/export configure, for the C test to compare with. */
#ifndef EHSID_TESTS_C_REFERENCE_H
#define EHSID_TESTS_C_REFERENCE_H

#include <ehsid/c_api.h>

#include "../export/cases.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Everything that can be read of an estimator after a sample; what is beyond n stays zero. */
typedef struct readings {
  int32_t status;
  ehsid_report report;
  float theta[EHSID_MAX_PARAMETERS];
  float deviation[EHSID_MAX_PARAMETERS];
  float variance[EHSID_MAX_PARAMETERS];
} readings;

#define COUNT_CASE(name) +1
enum { CASES = 0 EXPORTED_CASES(COUNT_CASE) };
#undef COUNT_CASE

/* Configures the C++ estimator of a case; its status. */
int32_t reference_start(int which);
void reference_step(int which, float command, float position, readings* made);
void reference_enable(int which, bool on);
void reference_reset(int which);

#ifdef __cplusplus
}
#endif

#endif
