// SPDX-License-Identifier: MIT
// A ServoEstimator that is never started anew, through holds, glitches, hostile samples, changes of the plant and of the
// sensor: always finite, and right again each time. EHSID_SOAK_SAMPLES=100000000 in the environment makes it long, and prints how long each
// kind took (docs/which_estimator.md).
#include <ehsid/servo_estimator.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <vector>

namespace {

constexpr double kDt = 0.01;
constexpr double kNoise = 5e-6;     // m
constexpr int kGoodSamples = 6000;  // 60 s between two disturbances
constexpr int kRightAgain = 100;    // samples in a row with K within 5 %: 1 s

const char* const kKinds[] = {"hold",        "hold at a bias", "glitch", "hostile samples",
                              "change of K", "huge samples",   "NaN",    "sensor moved",
                              "end stops",   "sensor stuck"};
constexpr int kCount = 10;

/// A servo of 25 rad/s and xi 0.3 in a P loop with steps of +-20 mm, exact from sample to sample.
class Machine {
 public:
  explicit Machine(unsigned seed) : random_(seed) {
    ehsid::ServoEstimatorOptions<float> options;
    options.dt_s = static_cast<float>(kDt);
    EXPECT_EQ(estimator_.configure(options), ehsid::Status::ok);
  }

  /// Returns after how many samples K is right for a second, or -1.
  int move(int count) {
    int first = -1;
    int right = 0;
    for (int k = 0; k < count; ++k) {
      const double measured = position_ + noise();
      const double target = ++samples_ / 60 % 2 == 0 ? 0.02 : -0.02;
      step(loop(target, measured), measured);
      advance(loop(target, measured));
      const auto told = estimator_.servo().gain;
      const double apart = static_cast<double>(told.value) / (gain_ / kDt) - 1.0;
      right = std::abs(apart) < 0.05 ? right + 1 : 0;
      first = right == kRightAgain && first < 0 ? k - kRightAgain + 1 : first;
      trusted_ += told.trusted ? 1 : 0;
      wrong_ += told.trusted && std::abs(apart) > 0.1 ? 1 : 0;
    }
    return first;
  }

  void disturb(int kind) {
    const auto length = [this](int least, int most) {
      return std::uniform_int_distribution<int>(least, most)(random_);
    };
    switch (kind) {
      case 0:
      case 1:
        stop();
        for (int k = length(1000, 20000); k > 0; --k) {
          step(kind == 0 ? 0.0 : 0.2, position_ + noise());
        }
        break;
      case 2:
        step(0.0,
             position_ + (uniform() < 0.5 ? 1.0 : -1.0) * std::pow(10.0, 8.0 * uniform() - 4.0));
        advance(0.0);
        break;
      case 3:
        for (int k = length(1, 2000); k > 0; --k) {
          step(20.0 * (uniform() - 0.5), 0.05 * normal_(random_));
        }
        break;
      case 4:
        gain_ = 0.03 * kDt * std::exp(1.4 * (uniform() - 0.5));
        break;
      case 5:
        for (int k = length(1, 1000); k > 0; --k) {
          step(huge(), huge());
        }
        break;
      case 6:
        for (int k = length(1, 300); k > 0; --k) {
          step(0.0, std::numeric_limits<double>::quiet_NaN());
          advance(0.0);
        }
        break;
      case 7:
        offset_ = 2.0 * (uniform() - 0.5);
        break;
      case 8:
        for (int k = length(500, 5000); k > 0; --k) {
          const double side = k / 100 % 2 == 0 ? 1.0 : -1.0;
          step(10.0 * side, position_ + 0.001 * side + noise());
        }
        velocity_ = acceleration_ = 0.0;
        break;
      default:
        const double stuck = position_;
        for (int k = length(100, 3000); k > 0; --k) {
          step(k / 60 % 2 == 0 ? 1.0 : -1.0, stuck);
        }
        velocity_ = acceleration_ = 0.0;
    }
  }

  int kind() { return std::uniform_int_distribution<int>(0, kCount - 1)(random_); }
  long samples() const { return all_; }
  double falsely_trusted() const {
    return static_cast<double>(wrong_) / static_cast<double>(trusted_);
  }
  bool finite() const { return finite_; }

 private:
  double uniform() { return std::uniform_real_distribution<double>()(random_); }
  double noise() { return kNoise * normal_(random_); }
  double huge() { return (uniform() < 0.5 ? 1.0 : -1.0) * std::pow(10.0, 24.0 * uniform() - 12.0); }
  double loop(double target, double measured) const {
    return std::clamp(4.0 / (gain_ / kDt) * (target - measured), -10.0, 10.0);
  }

  void step(double command, double position) {
    static_cast<void>(
        estimator_.step(static_cast<float>(command), static_cast<float>(position + offset_)));
    const auto told = estimator_.servo();
    for (const auto& value : {told.gain, told.omega_n, told.xi}) {
      const bool none = value.value != value.value && !value.trusted;
      finite_ = (none || (ehsid::is_finite(value.value) && ehsid::is_finite(value.half_width))) &&
                finite_;
    }
    ++all_;
  }

  void advance(double command) {
    const double error = velocity_ - gain_ * command;
    position_ += velocity_ - t_.s.value * error + t_.i.value * acceleration_;
    velocity_ += t_.e.value * acceleration_ - t_.w.value * error;
    acceleration_ = t_.decay.value * acceleration_ - t_.pull.value * error;
  }

  /// The loop comes to rest where it is.
  void stop() {
    const double target = position_;
    for (int k = 0; k < 300; ++k) {
      const double measured = position_ + noise();
      step(loop(target, measured), measured);
      advance(loop(target, measured));
    }
    velocity_ = acceleration_ = 0.0;
  }

  ehsid::ServoEstimator<float> estimator_;
  ehsid::ServoTransition<double> t_ = ehsid::servo_transition(25.0 * kDt, 0.3);
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  double gain_ = 0.03 * kDt;
  double position_ = 0.0;
  double velocity_ = 0.0;
  double acceleration_ = 0.0;
  double offset_ = 0.0;
  long samples_ = 0;
  long all_ = 0;
  long trusted_ = 0;
  long wrong_ = 0;
  bool finite_ = true;
};

TEST(ServoDisturbed, IsFiniteAndRightAgainBeforeTheNextDisturbance) {
  const char* asked = std::getenv("EHSID_SOAK_SAMPLES");
  const long total = asked != nullptr ? std::strtol(asked, nullptr, 10) : 1000000;
  Machine machine(2);
  std::array<std::vector<double>, kCount> seconds;
  EXPECT_GE(machine.move(3000), 0);
  while (machine.samples() < total) {
    const int kind = machine.kind();
    machine.disturb(kind);
    const int back = machine.move(kGoodSamples);
    EXPECT_GE(back, 0) << kKinds[kind] << ", at sample " << machine.samples();
    seconds[static_cast<std::size_t>(kind)].push_back(back * kDt);
  }
  EXPECT_TRUE(machine.finite());
  EXPECT_LT(machine.falsely_trusted(), 0.005);
  for (std::size_t kind = 0; kind < kCount && asked != nullptr; ++kind) {
    auto& found = seconds[kind];
    std::sort(found.begin(), found.end());
    std::printf(
        "%-15s %5zu times: right again after %5.2f s (median), %5.2f s (99 %%), %5.2f s (worst)\n",
        kKinds[kind], found.size(), found[found.size() / 2], found[found.size() * 99 / 100],
        found.back());
  }
}

}  // namespace
