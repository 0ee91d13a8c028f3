/* SPDX-License-Identifier: MIT
 * As `ehsid export --c` writes it, cut to what a plant of first order needs. */
#ifndef SERVO_CONFIGURATION_H
#define SERVO_CONFIGURATION_H

#include <ehsid/c_api.h>

#define SERVO_STORAGE_WORDS EHSID_STORAGE_WORDS(2)

static const ehsid_configuration servo_configuration = {
    .kernel = EHSID_KERNEL(constant, 2),
    .na = 1,
    .nb = 1,
    .nk = 1,
    .command_scale = 1.0F,
    .position_scale = 1.0F,
    .forgetting.lambda = 0.99F,
    .information_margin = -1.0F,
    .covariance_ceiling = 1.0F,
    .reset_short_window = 10.0F,
    .reset_long_window = 200.0F,
    .reset_trigger_ratio = 3.0F,
    .reset_release_ratio = 1.5F,
    .convergence_tolerance = 0.05F,
    .convergence_magnitude = 0.1F,
    .convergence_hold = 20,
    .variance0 = 1e6F,
    .input_limit = 1e4F,
};

#endif
