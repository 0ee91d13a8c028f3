/* SPDX-License-Identifier: MIT
 * Estimates a servo online, sample by sample: online SAMPLES.csv */
#include <ehsid/c_api.h>

#include <stdio.h>

#define PARAMETERS 6 /* a1, a2, a3, b1, b2, b3 */

static const double dt_s = 0.005;
static const int shown[] = {1000, 1999, 2040, 3000,
                            3999}; /* numbers of the samples that are printed */

static uint64_t storage[EHSID_STORAGE_WORDS(PARAMETERS)];
static ehsid_estimator* estimator;

static ehsid_status power_on(void) {
  ehsid_configuration configuration;
  const ehsid_status status = ehsid_default_configuration(
      &configuration, EHSID_KERNEL(f_ratio, PARAMETERS), 3, 3, 1, false);
  if (status != EHSID_OK) {
    return status;
  }
  /* The largest command and the largest position make the signals of order one. */
  configuration.command_scale = 10.0F;
  configuration.position_scale = 0.1F;
  return ehsid_init(&estimator, storage, sizeof storage, &configuration);
}

static bool is_shown(int k) {
  bool found = false;
  for (size_t i = 0; i < sizeof shown / sizeof shown[0]; ++i) {
    found = found || shown[i] == k;
  }
  return found;
}

/* Nine digits are enough to tell any two numbers of type float apart. */
static ehsid_status print_row(int k) {
  float theta[PARAMETERS];
  ehsid_report report;
  const ehsid_status status = ehsid_theta(estimator, theta, PARAMETERS);
  if (status != EHSID_OK || ehsid_read(estimator, &report) != EHSID_OK) {
    return status;
  }
  printf("%6.3f", dt_s * k);
  for (int i = 0; i < PARAMETERS; ++i) {
    printf(" %15.8e", (double)theta[i]);
  }
  printf("  %s\n", report.converged ? "yes" : "no");
  return EHSID_OK;
}

static void print_number(const char* name, float value, float deviation) {
  printf("%-16s %#.4g +- %.2g\n", name, (double)value, (double)deviation);
}

static int print_servo(void) {
  ehsid_servo servo;
  if (ehsid_read_servo(estimator, (float)dt_s, &servo, NULL) != EHSID_OK) {
    return 1;
  }
  if (servo.status != EHSID_SERVO_OK) {
    fprintf(stderr, "the model is not one of a servo: %s\n", ehsid_servo_status_name(servo.status));
    return 1;
  }
  print_number("K in m/(s V)", servo.gain, servo.gain_std);
  print_number("omega_n in rad/s", servo.omega_n, servo.omega_n_std);
  print_number("xi", servo.xi, servo.xi_std);
  return 0;
}

int main(int argc, char** argv) {
  float time_s;
  float command_v;
  float position_m;
  int samples = 0;
  int refused = 0;
  FILE* file = argc == 2 ? fopen(argv[1], "r") : NULL;
  if (file == NULL || fscanf(file, "%*s") != 0) { /* the first line has the names */
    fprintf(stderr, "usage: online SAMPLES.csv, for example ../data/servo_samples.csv\n");
    return 2;
  }
  if (power_on() != EHSID_OK) {
    return 1;
  }

  printf("time_s %15s %15s %15s %15s %15s %15s  converged\n", "a1", "a2", "a3", "b1", "b2", "b3");
  for (int k = 0; fscanf(file, "%f,%f,%f", &time_s, &command_v, &position_m) == 3; ++k) {
    const ehsid_status status = ehsid_step(estimator, command_v, position_m);
    ++samples;
    if (ehsid_is_error(status)) { /* the sample is no plausible number: the estimate is as before */
      ++refused;
    } else if (status == EHSID_RESET) { /* theta is kept, and becomes uncertain */
      printf("%6.3f the servo has changed: the estimator has started to learn anew\n", dt_s * k);
    }
    if (is_shown(k) && print_row(k) != EHSID_OK) {
      return 1;
    }
  }
  fclose(file);
  printf("%d samples, %d of them refused\n", samples, refused);
  return print_servo();
}
