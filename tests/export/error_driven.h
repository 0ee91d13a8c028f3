/* Written by `ehsid export --c`, ehsid 0.2.0; do not edit, export again.
 * Settings and start of the online estimator for ehsid/c_api.h. Numbers are float32 in hexadecimal, exact to
 * the bit; decimals are for people.
 *
 * Record hydraulic_crane.csv, sha256
 * 3fd24a1fe2d09e4635d068aea802cae4bebe600b7691387647fca79c80c9b4ba
 * Made by tests/export/make_headers.py
 */
/* clang-format off */
#ifndef EHSID_EXPORTED_ERROR_DRIVEN_H
#define EHSID_EXPORTED_ERROR_DRIVEN_H

#include <ehsid/c_api.h>

/* Words of 8 bytes to give to ehsid_init(). */
#define ERROR_DRIVEN_STORAGE_WORDS EHSID_STORAGE_WORDS(6)

/* Sampling time of the record, s; the parameters hold for no other. */
static const float error_driven_dt_s = 0x1.99999ap-5F; /* 0.05 */

static const ehsid_estimate error_driven_estimate = {
    .theta = {
        -0x1.9374bcp+0F, /* a1 = -1.576 */
        0x1.e7d566p-2F, /* a2 = 0.4764 */
        0x1.eac86p-5F, /* a3 = 0.05991 */
        0x1.afb7eap-4F, /* a4 = 0.1054 */
        -0x1.37dbf4p-1F, /* b1 = -0.6091 */
        0x1.fe76c8p-2F, /* b2 = 0.4985 */
    },
    .d = {
        0x1.4794eap-7F, /* 0.009997 */
        0x1.fced92p-2F, /* 0.497 */
        0x1.d89374p+0F, /* 1.846 */
        0x1.df7ceep+0F, /* 1.873 */
        0x1.1f9f02p-5F, /* 0.03511 */
        0x1.3b645ap+2F, /* 4.928 */
    },
    .u = {
        -0x1.f9e83ep-1F, /* -0.9881 */
        0x1.b4e3bcp-1F, /* 0.8533 */
        -0x1.d58106p+0F, /* -1.834 */
        0x1.e2824p-4F, /* 0.1178 */
        0x1.4617c2p-1F, /* 0.6369 */
        -0x1.bba5e4p+0F, /* -1.733 */
        -0x1.756042p+1F, /* -2.917 */
        0x1.35c29p+1F, /* 2.42 */
        0x1.326e98p+1F, /* 2.394 */
        -0x1.674bc6p+1F, /* -2.807 */
        0x1.1bcfd4p-4F, /* 0.06929 */
        -0x1.3443d4p-4F, /* -0.07526 */
        0x1.22fad6p-6F, /* 0.01776 */
        -0x1.06cca2p-6F, /* -0.01604 */
        -0x1.fd566cp-1F, /* -0.9948 */
    },
    .noise_variance = 0x1.55714cp-7F, /* 0.01042 */
};

static const ehsid_configuration error_driven_configuration = {
    .kernel = EHSID_KERNEL(error_driven, 6),
    .na = 4,
    .nb = 2,
    .nk = 1,
    .offset = false,
    .command_scale = 0x1.60d1b8p-1F, /* 0.6891 */
    .position_scale = 0x1.845a1cp+0F, /* 1.517 */
    .command_offset = -0x1.875f7p-3F, /* -0.1911 */
    .position_offset = 0x1.7b634ep-8F, /* 0.005789 */
    .forgetting.memory = 0x1.4p+6F, /* 80 */
    .forgetting.lambda_min = 0x1.333334p-1F, /* 0.6 */
    .forgetting.noise_variance = 0x0p+0F, /* 0 */
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
    .seed = &error_driven_estimate,
};

#endif
