/* Written by `ehsid export --c`, ehsid 0.2.0; do not edit, export again.
 * Settings and start of the online estimator for ehsid/c_api.h. Numbers are float32 in hexadecimal, exact to
 * the bit; decimals are for people.
 *
 * Record hydraulic_crane.csv, sha256
 * 3fd24a1fe2d09e4635d068aea802cae4bebe600b7691387647fca79c80c9b4ba
 * Made by tests/export/make_headers.py
 */
/* clang-format off */
#ifndef EHSID_EXPORTED_DIRECTIONAL_H
#define EHSID_EXPORTED_DIRECTIONAL_H

#include <ehsid/c_api.h>

/* Words of 8 bytes to give to ehsid_init(). */
#define DIRECTIONAL_STORAGE_WORDS EHSID_STORAGE_WORDS(2)

/* Sampling time of the record, s; the parameters hold for no other. */
static const float directional_dt_s = 0x1.99999ap-5F; /* 0.05 */

static const ehsid_estimate directional_estimate = {
    .theta = {
        -0x1.f78d5p-1F, /* a1 = -0.9835 */
        -0x1.758e22p-6F, /* b1 = -0.0228 */
    },
    .d = {
        0x1.4801f8p-7F, /* 0.01001 */
        0x1.c06e1ap-6F, /* 0.02737 */
    },
    .u = {
        -0x1.96f006p-1F, /* -0.7948 */
    },
    .noise_variance = 0x1.7c6fbep-5F, /* 0.04644 */
};

static const ehsid_configuration directional_configuration = {
    .kernel = EHSID_KERNEL(directional, 2),
    .na = 1,
    .nb = 1,
    .nk = 3,
    .offset = false,
    .command_scale = 0x1.60d1b8p-1F, /* 0.6891 */
    .position_scale = 0x1.845a1cp+0F, /* 1.517 */
    .command_offset = -0x1.875f7p-3F, /* -0.1911 */
    .position_offset = 0x1.7b634ep-8F, /* 0.005789 */
    .forgetting.lambda = 0x1.ccccccp-1F, /* 0.9 */
    .forgetting.epsilon = 0x1.0624dep-10F, /* 0.001 */
    .information_margin = 0x1.8p+0F, /* 1.5 */
    .covariance_ceiling = 0x1p+1F, /* 2 */
    .reset_enabled = true,
    .reset_short_window = 0x1.4p+2F, /* 5 */
    .reset_long_window = 0x1.ep+5F, /* 60 */
    .reset_trigger_ratio = 0x1p+1F, /* 2 */
    .reset_release_ratio = 0x1.8p+0F, /* 1.5 */
    .reset_cool_down = 50,
    .reset_floor = 0x1.4f8b58p-17F, /* 1e-05 */
    .convergence_tolerance = 0x1.99999ap-4F, /* 0.1 */
    .convergence_magnitude = 0x1.99999ap-4F, /* 0.1 */
    .convergence_hold = 10,
    .variance0 = 0x1.e848p+19F, /* 1e+06 */
    .input_limit = 0x1.f4p+9F, /* 1000 */
    .seed = &directional_estimate,
};

#endif
