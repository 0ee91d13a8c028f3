/* Written by `ehsid export --c`, ehsid 0.2.0; do not edit, export again.
 * Settings and start of the online estimator for ehsid/c_api.h. Numbers are float32 in hexadecimal, exact to
 * the bit; decimals are for people.
 *
 * Record hydraulic_crane.csv, sha256
 * 3fd24a1fe2d09e4635d068aea802cae4bebe600b7691387647fca79c80c9b4ba
 * Made by tests/export/make_headers.py
 */
/* clang-format off */
#ifndef EHSID_EXPORTED_RANDOM_WALK_H
#define EHSID_EXPORTED_RANDOM_WALK_H

#include <ehsid/c_api.h>

/* Words of 8 bytes to give to ehsid_init(). */
#define RANDOM_WALK_STORAGE_WORDS EHSID_STORAGE_WORDS(3)

/* Sampling time of the record, s; the parameters hold for no other. */
static const float random_walk_dt_s = 0x1.99999ap-5F; /* 0.05 */

static const ehsid_estimate random_walk_estimate = {
    .theta = {
        -0x1.d126eap+0F, /* a1 = -1.817 */
        0x1.bb8bacp-1F, /* a2 = 0.8663 */
        -0x1.5ce5b4p-4F, /* b1 = -0.08518 */
    },
    .d = {
        0x1.4855dap-7F, /* 0.01002 */
        0x1.fdf3b6p-2F, /* 0.498 */
        0x1.c3dee8p-6F, /* 0.02758 */
    },
    .u = {
        -0x1.f9e83ep-1F, /* -0.9881 */
        -0x1.178d5p-1F, /* -0.546 */
        -0x1.068db8p-2F, /* -0.2564 */
    },
    .noise_variance = 0x1.719f8p-7F, /* 0.01128 */
};

static const ehsid_configuration random_walk_configuration = {
    .kernel = EHSID_KERNEL(random_walk, 3),
    .na = 2,
    .nb = 1,
    .nk = 0,
    .offset = false,
    .command_scale = 0x1.60d1b8p-1F, /* 0.6891 */
    .position_scale = 0x1.845a1cp+0F, /* 1.517 */
    .command_offset = -0x1.875f7p-3F, /* -0.1911 */
    .position_offset = 0x1.7b634ep-8F, /* 0.005789 */
    .forgetting.drift[0] = 0x1.0624dep-10F, /* 0.001 */
    .forgetting.drift[1] = 0x1.a36e2ep-14F, /* 0.0001 */
    .forgetting.drift[2] = 0x1.4f8b58p-17F, /* 1e-05 */
    .information_margin = 0x1.8p+0F, /* 1.5 */
    .covariance_ceiling = 0x1p+1F, /* 2 */
    .reset_enabled = false,
    .reset_short_window = 0x1.4p+3F, /* 10 */
    .reset_long_window = 0x1.9p+7F, /* 200 */
    .reset_trigger_ratio = 0x1.8p+1F, /* 3 */
    .reset_release_ratio = 0x1.8p+0F, /* 1.5 */
    .reset_cool_down = 50,
    .reset_floor = 0x1.4f8b58p-17F, /* 1e-05 */
    .convergence_tolerance = 0x1.99999ap-4F, /* 0.1 */
    .convergence_magnitude = 0x1.99999ap-4F, /* 0.1 */
    .convergence_hold = 10,
    .variance0 = 0x1.e848p+19F, /* 1e+06 */
    .input_limit = 0x1.f4p+9F, /* 1000 */
    .seed = &random_walk_estimate,
};

#endif
