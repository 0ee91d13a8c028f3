/* SPDX-License-Identifier: MIT
 *
 * The online estimator for C99: ehsid::ArxEstimator<float, ...> with orders chosen at run time, bit for bit.
 *
 *   static uint64_t storage[EHSID_STORAGE_WORDS(6)];
 *   static ehsid_estimator* servo;
 *
 *   ehsid_status power_on(void) {
 *     return ehsid_init(&servo, storage, sizeof storage, &servo_configuration);
 *   }
 *   ehsid_status every_sample(float command, float position) {
 *     return ehsid_step(servo, command, position);
 *   }
 *
 * The storage is the caller's and all there is: no heap, nothing kept between calls elsewhere. Every function
 * may be called for different estimators at the same time, and for one estimator from one place at a time.
 * Any call that returns an error (ehsid_is_error) has changed nothing, but for two answers of ehsid_step:
 * after EHSID_INVALID_INPUT and EHSID_OUT_OF_RANGE the history fills anew. See docs/linking.md. */
#ifndef EHSID_C_API_H
#define EHSID_C_API_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define EHSID_MAX_ORDER 6       /* na and nb from 1 on */
#define EHSID_MAX_DELAY 20      /* nk from 0 on */
#define EHSID_MAX_PARAMETERS 13 /* na + nb, and the constant term */
#define EHSID_MAX_UPPER 78      /* numbers above the diagonal of U at 13 parameters */

/* Storage of an estimator of n parameters with whatever policy, in words of 8 bytes; an array of uint64_t also
 * has the alignment. ehsid_storage_bytes() tells what a policy really takes. */
#define EHSID_STORAGE_WORDS(n) (((n) * (n) + 7 * (n) + 225) / 2)
#define EHSID_STORAGE_BYTES(n) (8 * EHSID_STORAGE_WORDS(n))

/* Bytes that ehsid_save() writes, at most, for any policy and delay. ehsid_snapshot_bytes() is the bound for one policy,
 * ehsid_save() returns how many it wrote. */
#define EHSID_SNAPSHOT_BYTES(n) (2 * (n) * (n) + 22 * (n) + 798)

/* Outcome of a call; numbers and meaning of ehsid::Status, and two more. */
typedef enum ehsid_status {
  EHSID_OK = 0,
  EHSID_FILLING = 1,          /* not enough past samples yet; nothing estimated */
  EHSID_NO_INFORMATION = 2,   /* sample carries no information: estimate kept on purpose */
  EHSID_DISABLED = 3,         /* estimation is switched off; only the history moves on */
  EHSID_RESET = 4,            /* step taken; a change of the plant was detected */
  EHSID_INVALID_INPUT = 5,    /* NaN or Inf: rejected */
  EHSID_OUT_OF_RANGE = 6,     /* beyond input_limit after scaling: rejected */
  EHSID_NUMERICAL_LIMIT = 7,  /* result not finite or a factor not positive: rejected */
  EHSID_INVALID_ARGUMENT = 8, /* NULL, or a setting, start value or snapshot refused */
  EHSID_STORAGE_TOO_SMALL =
      9, /* fewer bytes or numbers than the answer needs, or storage not aligned */
  EHSID_NOT_INITIALISED = 10 /* no ehsid_init() has been here */
} ehsid_status;

/* "ok", "filling", ...; "unknown" for any other number. Never NULL. */
const char* ehsid_status_name(ehsid_status status);
/* True from EHSID_INVALID_INPUT on: the call was refused. */
bool ehsid_is_error(ehsid_status status);

/* Code of one forgetting policy for one number of parameters. The linker takes only those that are named, with
 * -ffunction-sections (the library has it) and --gc-sections: EHSID_KERNEL(f_ratio, 6). n = 2 to 13. */
typedef struct ehsid_kernel ehsid_kernel;
#define EHSID_KERNEL(policy, n) EHSID_KERNEL_(policy, n) /* a macro for n is expanded first */
#define EHSID_KERNEL_(policy, n) (&ehsid_kernel_##policy##_##n)

/* Every policy, by its name in EHSID_KERNEL. */
/* clang-format off */
/* policies: written by script/policies.py */
#define EHSID_EACH_POLICY(DO) \
  DO(constant) \
  DO(exponential) \
  DO(error_driven) \
  DO(f_ratio)
/* end of policies */
/* clang-format on */

#define EHSID_DECLARE_KERNELS(policy)                                                     \
  extern const ehsid_kernel ehsid_kernel_##policy##_2, ehsid_kernel_##policy##_3,         \
      ehsid_kernel_##policy##_4, ehsid_kernel_##policy##_5, ehsid_kernel_##policy##_6,    \
      ehsid_kernel_##policy##_7, ehsid_kernel_##policy##_8, ehsid_kernel_##policy##_9,    \
      ehsid_kernel_##policy##_10, ehsid_kernel_##policy##_11, ehsid_kernel_##policy##_12, \
      ehsid_kernel_##policy##_13;

/* Tables of functions, initialised by constants in cpp/src/c_kernels.cpp. */
/* NOLINTBEGIN(bugprone-dynamic-static-initializers) */
EHSID_EACH_POLICY(EHSID_DECLARE_KERNELS)
/* EHSID_KERNEL(riv, 6): instrumental variables, for noise on the position sensor (ehsid/instrumental_variables.hpp), with the
 * policy `exponential`, na = 3, nb = 3 (2 with a constant term), and the defaults of ehsid::GradientOptions. No setting of
 * the reset is read: this recursion begins anew by itself. */
extern const ehsid_kernel ehsid_kernel_riv_6;
/* EHSID_KERNEL(integrating, 5) and (integrating, 6): least squares for a plant that integrates, as a servo does
 * (ehsid/integrating.hpp), with the policy `exponential`. na counts the poles beside the integrator: na = 2 and nb = 3 for third
 * order, and (integrating, 6) with a constant term, which lets the null of the valve be anywhere. */
extern const ehsid_kernel ehsid_kernel_integrating_5, ehsid_kernel_integrating_6;
/* NOLINTEND(bugprone-dynamic-static-initializers) */

/* Settings of the policy: only the members of the kernel's policy are read. Ranges and sources stand in
 * ehsid/forgetting/, one file a policy. */
/* clang-format off */
typedef struct ehsid_forgetting {
  /* settings: written by script/policies.py */
  float lambda; /* constant: (0, 1] */
  float lambda0; /* exponential: (0, 1] */
  float lambda_initial; /* exponential: (0, 1] */
  float memory; /* error_driven: >= 1 */
  float lambda_min; /* error_driven: (0, 1] */
  float noise_variance; /* error_driven: >= 0 */
  float eta; /* f_ratio: >= 0 */
  float critical_ratio; /* f_ratio: >= 1 */
  /* end of settings */
} ehsid_forgetting;
/* clang-format on */

/* An estimate made elsewhere, of n parameters. u: columns of U above its diagonal, one after the other. */
typedef struct ehsid_estimate {
  float theta[EHSID_MAX_PARAMETERS]; /* a1 .. a_na, b1 .. b_nb [, c], in the units of the signals */
  float d[EHSID_MAX_PARAMETERS];     /* P = U D U', scaled signals, in units of sigma^2; each > 0 */
  float u[EHSID_MAX_UPPER];
  float noise_variance; /* sigma^2 in squared units of the position, >= 0; 0: unknown */
} ehsid_estimate;

/* All settings. `ehsid export --c` writes one; ehsid_default_configuration() fills one in. */
typedef struct ehsid_configuration {
  const ehsid_kernel* kernel; /* its n is na + nb, one more with a constant term */
  int32_t na, nb, nk;
  bool offset;           /* a constant term c */
  float command_scale;   /* units of the command, > 0 */
  float position_scale;  /* units of the position, > 0 */
  float command_offset;  /* units of the command */
  float position_offset; /* units of the position */
  ehsid_forgetting forgetting;
  float information_margin; /* guards, see ehsid::RlsOptions; negative: sqrt(n) */
  float covariance_ceiling; /* > 0 */
  bool reset_enabled;       /* a change of the plant, see ehsid::RmseResetOptions */
  float reset_short_window; /* samples, >= 1 */
  float reset_long_window;  /* samples, > short */
  float reset_trigger_ratio;
  float reset_release_ratio;
  int32_t reset_cool_down; /* samples */
  float reset_floor;
  float convergence_tolerance; /* see ehsid::ConvergenceOptions */
  float convergence_magnitude;
  int32_t convergence_hold;   /* samples, >= 1 */
  float variance0;            /* P_ii at the start and after a reset, scaled signals, > 0 */
  float input_limit;          /* largest plausible |scaled signal|, > 0 */
  const ehsid_estimate* seed; /* where to start; NULL: from zero and variance0 */
} ehsid_configuration;

/* The defaults of the C++ estimator with this kernel and these orders. EHSID_INVALID_ARGUMENT where they do
 * not belong together: na, nb in 1 .. 6, nk in 0 .. 20, n = na + nb (+ 1 with offset). */
ehsid_status ehsid_default_configuration(ehsid_configuration* configuration,
                                         const ehsid_kernel* kernel, int32_t na, int32_t nb,
                                         int32_t nk, bool offset);

/* No guard and no reset: Eqs. (12)-(14) as they are printed, with the forgetting of the policy, from variance0.
 * EHSID_INVALID_ARGUMENT for NULL. */
ehsid_status ehsid_use_textbook(ehsid_configuration* configuration);

/* Bytes that an estimator of this kernel takes, and that its snapshot has at most; 0 for NULL. */
size_t ehsid_storage_bytes(const ehsid_kernel* kernel);
size_t ehsid_snapshot_bytes(const ehsid_kernel* kernel);

typedef struct ehsid_estimator ehsid_estimator; /* lives at the start of the storage */

/* Makes an estimator in `storage`, aligned to 8 bytes, and points *estimator to it. Configuration and seed are
 * copied, the kernel is referred to. Takes about as much stack as storage for the time of the call. */
ehsid_status ehsid_init(ehsid_estimator** estimator, void* storage, size_t bytes,
                        const ehsid_configuration* configuration);

/* One sample: the command sent at t_k and the position measured at t_k, in their units. */
ehsid_status ehsid_step(ehsid_estimator* estimator, float command, float position);

/* lambda and P back to their start, theta kept. */
ehsid_status ehsid_reset(ehsid_estimator* estimator);
/* Starts anew from an estimate made elsewhere. */
ehsid_status ehsid_seed(ehsid_estimator* estimator, const ehsid_estimate* estimate);
/* Bumpless: while switched off only the history moves on. */
ehsid_status ehsid_enable(ehsid_estimator* estimator, bool on);

/* Number of parameters n; 0 where there is no estimator. */
size_t ehsid_parameters(const ehsid_estimator* estimator);
/* n numbers each, in the units of the signals; `count` is how many there is room for. */
ehsid_status ehsid_theta(const ehsid_estimator* estimator, float* theta, size_t count);
ehsid_status ehsid_standard_deviation(const ehsid_estimator* estimator, float* deviation,
                                      size_t count);
/* Diagonal of the covariance: the squares of the standard deviations. */
ehsid_status ehsid_covariance_diagonal(const ehsid_estimator* estimator, float* variance,
                                       size_t count);
/* By rows, n * n numbers: the covariance of theta. It is sigma^2 P sum(w^2) / sum(w) with the weights w of the samples,
 * times 1 + whiteness where the residuals are not white. */
ehsid_status ehsid_covariance(const ehsid_estimator* estimator, float* covariance, size_t count);

typedef struct ehsid_report {
  float innovation;        /* epsilon(k), units of the position */
  float forgetting_factor; /* lambda(k) of the last step that was kept */
  float residual_variance; /* sigma^2, squared units of the position */
  float
      fit_percent; /* one step ahead, over about the last 1000 estimated samples, see ehsid/fit.hpp */
  float excitation; /* share of recent samples during which every parameter was excited, 0 to 1 */
  int32_t resets;   /* changes of the plant seen since the start */
  float whiteness;  /* statistic of the residuals: chi-squared, 6 degrees of freedom, where white */
  /* False: theta is biased, and its deviations, though larger, may not hold: the noise is on the position (sensor), or
   * the model lacks something. True before 100 samples. See ehsid/whiteness.hpp. */
  bool white;
  bool settled;   /* every deviation inside the tolerance, if the residuals were white */
  bool converged; /* settled, white, and at least 300 samples say so */
  bool enabled;
} ehsid_report;

ehsid_status ehsid_read(const ehsid_estimator* estimator, ehsid_report* report);

/* The state, a checksum of the settings, and a checksum of all of it: the bytes of ehsid.ArxEstimator.save() in Python
 * and of OnlineEstimator::save() in C++, on every machine. *written, how many they are, may be NULL. The fit is not part
 * of it and starts anew after ehsid_restore(). */
ehsid_status ehsid_save(const ehsid_estimator* estimator, void* bytes, size_t capacity,
                        size_t* written);
/* Into an estimator with the same orders, policy and settings. Any alignment; `count` is what ehsid_save() wrote.
 * EHSID_INVALID_ARGUMENT, and nothing changed, where ehsid_check_snapshot() finds a fault. Takes about as much stack as
 * storage for the time of the call. */
ehsid_status ehsid_restore(ehsid_estimator* estimator, const void* bytes, size_t count);

/* Why ehsid_restore() would refuse; numbers and meaning of ehsid::SnapshotFault. */
typedef enum ehsid_snapshot_fault {
  EHSID_SNAPSHOT_FITS = 0,                /* it would not refuse */
  EHSID_SNAPSHOT_UNKNOWN = 1,             /* not a snapshot of an estimator */
  EHSID_SNAPSHOT_OTHER_VERSION = 2,       /* written by another version of ehsid: start anew */
  EHSID_SNAPSHOT_DAMAGED = 3,             /* length or checksum is wrong: take another copy */
  EHSID_SNAPSHOT_OTHER_MODEL = 4,         /* other orders, delay, constant term or policy */
  EHSID_SNAPSHOT_OTHER_CONFIGURATION = 5, /* the same model with another setting */
  EHSID_SNAPSHOT_IMPOSSIBLE = 6           /* right checksum, but a state that no estimator has */
} ehsid_snapshot_fault;

/* "none" (it fits), "not_a_snapshot", ...: the names of ehsid::SnapshotFault, as ehsid_status_name(). */
const char* ehsid_snapshot_fault_name(ehsid_snapshot_fault fault);

/* Reads the bytes as ehsid_restore() does and changes nothing. */
ehsid_status ehsid_check_snapshot(const ehsid_estimator* estimator, const void* bytes, size_t count,
                                  ehsid_snapshot_fault* fault);

/* Whether theta can be read as a servo, and if not, why; numbers and meaning of ehsid::ServoReadingStatus. */
typedef enum ehsid_servo_status {
  EHSID_SERVO_OK = 0,
  EHSID_SERVO_NOT_FINITE = 1,       /* NaN or Inf in theta, covariance or dt_s */
  EHSID_SERVO_INVALID_ARGUMENT = 2, /* dt_s <= 0, or a negative variance */
  EHSID_SERVO_NO_INTEGRATOR = 3,    /* no real pole at z = 1, within its uncertainty */
  EHSID_SERVO_POLES_NOT_SEPARABLE =
      4, /* uncertainty of the integrator pole reaches the next pole */
  EHSID_SERVO_POLE_NEAR_ZERO =
      5, /* product of the other two poles is zero within its uncertainty */
  EHSID_SERVO_NEGATIVE_REAL_POLE = 6, /* no continuous servo has one under a hold */
  EHSID_SERVO_UNSTABLE_POLE = 7,      /* one of the other two poles on or outside the unit circle */
  EHSID_SERVO_ALIASING = 8,           /* sampled too slowly */
  EHSID_SERVO_NO_GAIN = 9,            /* b1 = b2 = b3 = 0 */
  EHSID_SERVO_NUMERICAL_LIMIT = 10    /* a result is not finite in float */
} ehsid_servo_status;

/* "ok", "not_finite", ..., as ehsid_status_name(). */
const char* ehsid_servo_status_name(ehsid_servo_status status);

/* Why a value is not trusted; numbers and meaning of ehsid::TrustReason. */
typedef enum ehsid_trust {
  EHSID_TRUSTED = 0,
  EHSID_STARTING = 1,    /* too little has been seen since the start, or since all began anew */
  EHSID_RESTING = 2,     /* the servo stands still, and the interval has grown */
  EHSID_SINGLE_SINE = 3, /* the command is one sine, which does not show this value */
  EHSID_CHANGE_SUSPECTED = 4, /* the innovations have just been far too large */
  EHSID_MODEL_DOES_NOT_FIT =
      5, /* left alone, the model does not run like the servo; or the residuals are not white */
  EHSID_NOT_PRECISE = 6 /* the interval is wider than the tolerance */
} ehsid_trust;

/* "trusted", "starting", ..., as ehsid_status_name(). */
const char* ehsid_trust_name(ehsid_trust reason);

/* Y(s)/U(s) = K omega_n^2 / (s (s^2 + 2 xi omega_n s + omega_n^2)). A number that was not determined is NaN;
 * K is also told where only omega_n and xi cannot be read. */
typedef struct ehsid_servo {
  ehsid_servo_status status;
  float gain;     /* K, units of the position per second and unit of the command */
  float omega_n;  /* rad/s */
  float xi;       /* damping ratio */
  float gain_std; /* standard deviations, units as above */
  float omega_n_std;
  float xi_std;
} ehsid_servo;

/* K, omega_n and xi straight from an estimator: na = nb = 3, or na = 2 and nb = 3 with the kernel `integrating`, nk >= 1, with
 * or without a constant term; EHSID_INVALID_ARGUMENT where it has other orders. What is found stands in servo->status. trust,
 * what the residuals say of it, may be NULL: EHSID_TRUSTED, EHSID_MODEL_DOES_NOT_FIT where the residuals are not white,
 * EHSID_NOT_PRECISE before the estimate has settled, EHSID_STARTING before 300 samples have said so. About 1 kB of stack. */
ehsid_status ehsid_read_servo(const ehsid_estimator* estimator, float dt_s, ehsid_servo* servo,
                              ehsid_trust* trust);

/* Reads theta = (a1, a2, a3, b1, b2, b3) of an estimator with na = nb = 3 and nk = 1 as a servo that is sampled every
 * dt_s seconds. covariance: as ehsid_covariance() gives it, or 36 zeros where it is unknown. What is found stands in
 * servo->status; EHSID_INVALID_ARGUMENT is for NULL only. See docs/servo_model.md. */
ehsid_status ehsid_identify_servo(const float* theta, const float* covariance, float dt_s,
                                  ehsid_servo* servo);

/* ---- K, omega_n and xi of a servo with a noisy position sensor: ehsid::ServoEstimator<float>, bit for bit ----
 *
 *   static uint64_t storage[EHSID_SERVO_STORAGE_WORDS];
 *   static ehsid_servo_estimator* servo;
 *
 *   ehsid_servo_settings settings = ehsid_servo_defaults(0.001F);
 *   ehsid_servo_init(&servo, storage, sizeof storage, &settings);
 *   ...
 *   ehsid_servo_step(servo, command, position);
 *   ehsid_servo_read(servo, &told);
 *   if (told.gain.trusted) { kp = bandwidth / told.gain.value; }
 */
#define EHSID_SERVO_STORAGE_WORDS 447
/* Bytes that ehsid_servo_save() writes, at most. */
#define EHSID_SERVO_SNAPSHOT_BYTES 3584

typedef struct ehsid_servo_estimator ehsid_servo_estimator;

typedef struct ehsid_servo_settings {
  float dt_s; /* sampling time in s, > 0 */
  int32_t
      delay; /* samples from a command to the first position that shows it, 1 .. EHSID_MAX_DELAY */
  float drift; /* standard deviation of ln K and ln omega_n in 1 s, >= 0 */
  float
      tolerance; /* K is trusted where the half of its 90 % interval is below this share of it, > 0 */
} ehsid_servo_settings;

/* A value with the half of its 90 % interval, in the same unit; NaN before there is any. */
typedef struct ehsid_tracked_value {
  float value;
  float half_width;
  bool trusted;
  ehsid_trust reason;
} ehsid_tracked_value;

/* Units of ehsid_servo. */
typedef struct ehsid_tracked_servo {
  ehsid_tracked_value gain;
  ehsid_tracked_value omega_n;
  ehsid_tracked_value xi;
} ehsid_tracked_servo;

/* The settings that fit most servos; only the sampling time has to be known. */
ehsid_servo_settings ehsid_servo_defaults(float dt_s);

/* Makes an estimator in `bytes` bytes of storage, aligned as uint64_t. EHSID_INVALID_ARGUMENT: a setting is out of its
 * range. Takes about as much stack as storage for the time of the call. */
ehsid_status ehsid_servo_init(ehsid_servo_estimator** estimator, void* storage, size_t bytes,
                              const ehsid_servo_settings* settings);

/* One sample: the command sent at t_k and the position measured at t_k. EHSID_FILLING before the first motion,
 * EHSID_NO_INFORMATION at rest, EHSID_RESET where all begins anew. */
ehsid_status ehsid_servo_step(ehsid_servo_estimator* estimator, float command, float position);

/* What is known of the servo now. */
ehsid_status ehsid_servo_read(const ehsid_servo_estimator* estimator, ehsid_tracked_servo* told);

/* As ehsid_save() and ehsid_restore(), with the bytes of ehsid.ServoEstimator.save() in Python. ehsid_servo_restore() takes
 * about as much stack as storage for the time of the call. */
ehsid_status ehsid_servo_save(const ehsid_servo_estimator* estimator, void* bytes, size_t capacity,
                              size_t* written);
ehsid_status ehsid_servo_restore(ehsid_servo_estimator* estimator, const void* bytes, size_t count);

#ifdef __cplusplus
}
#endif

#endif
