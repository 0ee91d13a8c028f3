/* Written by `ehsid export --c`, ehsid 0.2.0; do not edit, export again.
 * Settings and start of the online estimator for ehsid/c_api.h. Numbers are float32 in hexadecimal, exact to
 * the bit; decimals are for people.
 *
 * Record hydraulic_crane.csv, sha256
 * 3fd24a1fe2d09e4635d068aea802cae4bebe600b7691387647fca79c80c9b4ba
 * Made by tests/export/make_headers.py
 */
/* clang-format off */
#ifndef EHSID_EXPORTED_CONSTANT_H
#define EHSID_EXPORTED_CONSTANT_H

#include <ehsid/c_api.h>

/* Words of 8 bytes to give to ehsid_init(). */
#define CONSTANT_STORAGE_WORDS EHSID_STORAGE_WORDS(6)

/* Sampling time of the record, s; the parameters hold for no other. */
static const float constant_dt_s = 0x1.99999ap-5F; /* 0.05 */

static const ehsid_estimate constant_estimate = {
    .theta = {
        -0x1.978d5p+0F, /* a1 = -1.592 */
        0x1.b34d6ap-2F, /* a2 = 0.4251 */
        0x1.d013aap-3F, /* a3 = 0.2266 */
        0x1.b2fec6p-1F, /* b1 = 0.8496 */
        -0x1.3c28f6p+1F, /* b2 = -2.47 */
        0x1.8624dep+0F, /* b3 = 1.524 */
    },
    .d = {
        0x1.4801f8p-7F, /* 0.01001 */
        0x1.fd70a4p-2F, /* 0.4975 */
        0x1.d91688p+0F, /* 1.848 */
        0x1.f5ad96p-6F, /* 0.03062 */
        0x1.3b74bcp+2F, /* 4.929 */
        0x1.400a3ep+6F, /* 80.01 */
    },
    .u = {
        -0x1.f9e83ep-1F, /* -0.9881 */
        0x1.b4e3bcp-1F, /* 0.8533 */
        -0x1.d58106p+0F, /* -1.834 */
        -0x1.4b22dp+1F, /* -2.587 */
        0x1.0d4fep+2F, /* 4.208 */
        -0x1.3c6a7ep+1F, /* -2.472 */
        0x1.2b55fp-4F, /* 0.07308 */
        -0x1.1719f8p-4F, /* -0.06814 */
        -0x1.0d5a5cp-7F, /* -0.00822 */
        -0x1.fdb22ep-1F, /* -0.9955 */
        0x1.835158p-7F, /* 0.01182 */
        -0x1.8ff75ap-8F, /* -0.006103 */
        -0x1.7add16p-8F, /* -0.005781 */
        0x1.e95182p-1F, /* 0.9557 */
        -0x1.f3f7cep+0F, /* -1.953 */
    },
    .noise_variance = 0x1.5475a4p-7F, /* 0.01039 */
};

static const ehsid_configuration constant_configuration = {
    .kernel = EHSID_KERNEL(constant, 6),
    .na = 3,
    .nb = 3,
    .nk = 1,
    .offset = false,
    .command_scale = 0x1.60d1b8p-1F, /* 0.6891 */
    .position_scale = 0x1.845a1cp+0F, /* 1.517 */
    .command_offset = -0x1.875f7p-3F, /* -0.1911 */
    .position_offset = 0x1.7b634ep-8F, /* 0.005789 */
    .forgetting.lambda = 0x1.f5c29p-1F, /* 0.98 */
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
    .seed = &constant_estimate,
};

#endif
