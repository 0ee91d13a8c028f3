/* Written by `ehsid export --c`, ehsid 0.2.0; do not edit, export again.
 * Settings and start of the online estimator for ehsid/c_api.h. Numbers are float32 in hexadecimal, exact to
 * the bit; decimals are for people.
 *
 * Record hydraulic_crane.csv, sha256
 * 3fd24a1fe2d09e4635d068aea802cae4bebe600b7691387647fca79c80c9b4ba
 * Made by tests/export/make_headers.py
 */
/* clang-format off */
#ifndef EHSID_EXPORTED_F_RATIO_H
#define EHSID_EXPORTED_F_RATIO_H

#include <ehsid/c_api.h>

/* Words of 8 bytes to give to ehsid_init(). */
#define F_RATIO_STORAGE_WORDS EHSID_STORAGE_WORDS(6)

/* Sampling time of the record, s; the parameters hold for no other. */
static const float f_ratio_dt_s = 0x1.99999ap-5F; /* 0.05 */

static const ehsid_estimate f_ratio_estimate = {
    .theta = {
        -0x1.c872bp+0F, /* a1 = -1.783 */
        0x1.aa161ep-1F, /* a2 = 0.8322 */
        0x1.46c226p-2F, /* b1 = 0.3191 */
        -0x1.8b020cp+0F, /* b2 = -1.543 */
        0x1.256042p+0F, /* b3 = 1.146 */
        0x1.13c686p-14F, /* offset = 6.575e-05 */
    },
    .d = {
        0x1.4794eap-7F, /* 0.009997 */
        0x1.fced92p-2F, /* 0.497 */
        0x1.c8755p-6F, /* 0.02786 */
        0x1.427efap+2F, /* 5.039 */
        0x1.440a3ep+6F, /* 81.01 */
        0x1.4801f8p-7F, /* 0.01001 */
    },
    .u = {
        -0x1.f9e83ep-1F, /* -0.9881 */
        -0x1.94af5p-2F, /* -0.3952 */
        -0x1.a1b08ap-2F, /* -0.4079 */
        0x1.892cdp-4F, /* 0.09599 */
        -0x1.81c2e4p-4F, /* -0.09418 */
        -0x1.ffbe76p-1F, /* -0.9995 */
        0x1.3ffac2p-6F, /* 0.01953 */
        -0x1.2ccf6cp-6F, /* -0.01836 */
        0x1.e68db8p-1F, /* 0.9503 */
        -0x1.f2f1aap+0F, /* -1.949 */
        -0x1.400fbap-5F, /* -0.03907 */
        0x1.4eb9a2p-5F, /* 0.04086 */
        -0x1.063f14p-2F, /* -0.2561 */
        0x1.73fb7ap-9F, /* 0.002838 */
        0x1.0710ccp-2F, /* 0.2569 */
    },
    .noise_variance = 0x1.672324p-7F, /* 0.01096 */
};

static const ehsid_configuration f_ratio_configuration = {
    .kernel = EHSID_KERNEL(f_ratio, 6),
    .na = 2,
    .nb = 3,
    .nk = 2,
    .offset = true,
    .command_scale = 0x1.60d1b8p-1F, /* 0.6891 */
    .position_scale = 0x1.845a1cp+0F, /* 1.517 */
    .command_offset = -0x1.875f7p-3F, /* -0.1911 */
    .position_offset = 0x1.7b634ep-8F, /* 0.005789 */
    .forgetting.eta = 0x1.8p+0F, /* 1.5 */
    .forgetting.critical_ratio = 0x1.8p+1F, /* 3 */
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
    .seed = &f_ratio_estimate,
};

#endif
