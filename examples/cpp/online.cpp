// SPDX-License-Identifier: MIT
// Estimates a servo online, sample by sample: online SAMPLES.csv
#include <ehsid/ehsid.hpp>

#include <cstdio>

namespace {

using Estimator = ehsid::ArxEstimator<float, 3, 3, 1>;

constexpr float kDtS = 0.005F;
constexpr int kShown[] = {1000, 1999, 2040, 3000, 3999};  // numbers of the samples that are printed

bool is_shown(int k) {
  bool shown = false;
  for (const int number : kShown) {
    shown = shown || number == k;
  }
  return shown;
}

// Nine digits are enough to tell any two numbers of type float apart.
void print_row(int k, const Estimator& estimator) {
  std::printf("%6.3f", static_cast<double>(kDtS) * k);
  for (const float value : estimator.theta_hat()) {
    std::printf(" %15.8e", static_cast<double>(value));
  }
  std::printf("  %s\n", estimator.converged() ? "yes" : "no");
}

void print_number(const char* name, float value, float deviation) {
  std::printf("%-16s %#.4g +- %.2g\n", name, static_cast<double>(value),
              static_cast<double>(deviation));
}

}  // namespace

int main(int argc, char** argv) {
  std::FILE* file = argc == 2 ? std::fopen(argv[1], "r") : nullptr;
  if (file == nullptr || std::fscanf(file, "%*s") != 0) {  // the first line has the names
    std::fprintf(stderr, "usage: online SAMPLES.csv, for example ../data/servo_samples.csv\n");
    return 2;
  }

  // The largest command and the largest position make the signals of order one.
  Estimator::Options options;
  options.scaling.command_scale = 10.0F;
  options.scaling.position_scale = 0.1F;
  Estimator estimator;
  if (estimator.configure(options) != ehsid::Status::ok) {
    return 1;
  }

  std::printf("time_s %15s %15s %15s %15s %15s %15s  converged\n", "a1", "a2", "a3", "b1", "b2",
              "b3");
  float time_s = 0.0F;
  float command_v = 0.0F;
  float position_m = 0.0F;
  int samples = 0;
  int refused = 0;
  for (int k = 0; std::fscanf(file, "%f,%f,%f", &time_s, &command_v, &position_m) == 3; ++k) {
    const ehsid::Status status = estimator.step(command_v, position_m);
    ++samples;
    if (ehsid::is_error(status)) {  // the sample is no plausible number: the estimate is as before
      ++refused;
    } else if (status == ehsid::Status::reset) {  // theta is kept, and becomes uncertain
      std::printf("%6.3f the servo has changed: the estimator has started to learn anew\n",
                  static_cast<double>(kDtS) * k);
    }
    if (is_shown(k)) {
      print_row(k, estimator);
    }
  }
  std::fclose(file);
  std::printf("%d samples, %d of them refused\n", samples, refused);

  const auto servo = estimator.servo(kDtS);
  if (servo.status != ehsid::ServoReadingStatus::ok) {
    std::fprintf(stderr, "the model is not one of a servo: %s\n", ehsid::to_string(servo.status));
    return 1;
  }
  print_number("K in m/(s V)", servo.gain, servo.gain_std);
  print_number("omega_n in rad/s", servo.omega_n, servo.omega_n_std);
  print_number("xi", servo.xi, servo.xi_std);
  return 0;
}
