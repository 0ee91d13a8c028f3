/* Written by `ehsid export --servo --c`, ehsid 0.2.0; do not edit, export again.
 * Settings of the estimator of K, omega_n and xi for ehsid/c_api.h. Numbers are float32 in hexadecimal, exact to
 * the bit; decimals are for people.
 *
 * Made by tests/export/make_headers.py
 */
/* clang-format off */
#ifndef EHSID_EXPORTED_SERVO_ESTIMATOR_H
#define EHSID_EXPORTED_SERVO_ESTIMATOR_H

#include <ehsid/c_api.h>

static const ehsid_servo_settings servo_estimator_settings = {
    .dt_s = 0x1.0624dep-9F, /* 0.002 s: call ehsid_servo_step() as often */
    .delay = 6,
    .drift = 0x1.eb851ep-6F, /* 0.03 */
    .tolerance = 0x1.333334p-3F, /* 0.15 */
};

#endif
