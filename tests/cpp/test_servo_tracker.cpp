// SPDX-License-Identifier: MIT
#include <ehsid/servo_tracker.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace {

using ehsid::Status;
using ehsid::TrustReason;
using Tracker = ehsid::ServoTracker<float>;

/// The servo (5) in steps of at most 0.02 / omega_n by the Runge-Kutta method, with noise on its position sensor.
class Servo {
 public:
  double gain = 0.03;
  double omega_n = 25.0;
  double xi = 0.3;
  double noise = 5e-6;
  double zero = 0.0;  // of the sensor, m
  double dead_band = 0.0;

  explicit Servo(unsigned seed) : random_(seed) {}

  double measured() { return zero + x_ + noise * normal_(random_); }

  void run(double command, double dt) {
    const double u =
        std::abs(command) <= dead_band ? 0.0 : command - std::copysign(dead_band, command);
    const int steps = static_cast<int>(std::ceil(dt * omega_n / 0.02));
    const double step = dt / steps;
    const auto jerk = [&](double v, double a) {
      return omega_n * omega_n * (gain * u - v) - 2.0 * xi * omega_n * a;
    };
    for (int i = 0; i < steps; ++i) {
      const double v2 = v_ + step / 2 * a_;
      const double a2 = a_ + step / 2 * jerk(v_, a_);
      const double v3 = v_ + step / 2 * a2;
      const double a3 = a_ + step / 2 * jerk(v2, a2);
      const double v4 = v_ + step * a3;
      const double a4 = a_ + step * jerk(v3, a3);
      x_ += step / 6 * (v_ + 2 * v2 + 2 * v3 + v4);
      const double dv = step / 6 * (a_ + 2 * a2 + 2 * a3 + a4);
      a_ += step / 6 * (jerk(v_, a_) + 2 * jerk(v2, a2) + 2 * jerk(v3, a3) + jerk(v4, a4));
      v_ += dv;
    }
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  double x_ = 0.0;
  double v_ = 0.0;
  double a_ = 0.0;
};

/// A P loop with steps of +-20 mm every 0.6 s around a tracker; kp in V/m.
struct Loop {
  Servo servo;
  Tracker tracker;
  double dt;
  double kp = 4.0 / 0.03;
  double time = 0.0;
  Status status = Status::ok;

  Loop(double dt_s, unsigned seed) : servo(seed), dt(dt_s) {
    ehsid::ServoTrackerOptions<float> options;
    options.dt_s = static_cast<float>(dt_s);
    EXPECT_EQ(tracker.configure(options), Status::ok);
  }

  void sample(double target) {
    const double y = servo.measured();
    const double u = std::min(10.0, std::max(-10.0, kp * (servo.zero + target - y)));
    status = tracker.step(static_cast<float>(u), static_cast<float>(y));
    servo.run(u, dt);
    time += dt;
  }

  void until(double end) {
    while (time < end) {
      sample(std::fmod(time, 1.2) < 0.6 ? 0.02 : -0.02);
    }
  }
};

void expect_right(const Loop& loop, const char* when) {
  const auto told = loop.tracker.servo();
  EXPECT_NEAR(static_cast<double>(told.gain.value) / loop.servo.gain, 1.0, 0.05) << when;
  EXPECT_TRUE(told.gain.trusted) << when << ", reason " << static_cast<int>(told.gain.reason);
}

class Newcomer : public ::testing::TestWithParam<std::tuple<double, double>> {};

/// What a reader of the README does: an ordinary servo, a noisy sensor, and a plant that changes.
TEST_P(Newcomer, IsRightAndFollowsAChange) {
  const auto [dt, noise] = GetParam();
  Loop loop(dt, 12);
  loop.servo.noise = noise;
  loop.until(30.0);
  expect_right(loop, "at 30 s");
  const auto told = loop.tracker.servo();
  EXPECT_NEAR(static_cast<double>(told.omega_n.value), 25.0, 2.5);
  EXPECT_NEAR(static_cast<double>(told.xi.value), 0.3, 0.1);
  loop.servo.gain = 0.045;
  loop.until(60.0);
  expect_right(loop, "at 60 s");
}

INSTANTIATE_TEST_SUITE_P(Conditions, Newcomer,
                         ::testing::Combine(::testing::Values(0.005, 0.01, 0.02),
                                            ::testing::Values(0.5e-6, 5e-6, 20e-6)));

/// The lines of the README: the gain of the loop follows K only while K is trusted.
TEST(ServoTracker, AdaptsAGainThroughAChange) {
  Loop loop(0.01, 3);
  loop.kp = 60.0;  // too slow
  double most = 0.0;
  const auto adapt = [&](double end) {
    while (loop.time < end) {
      loop.until(loop.time + 0.5 * loop.dt);
      const auto gain = loop.tracker.servo().gain;
      if (gain.trusted) {
        loop.kp += 0.01 * (4.0 / static_cast<double>(gain.value) - loop.kp);
      }
      most = std::max(most, loop.kp);
    }
  };
  adapt(30.0);
  EXPECT_NEAR(loop.kp, 4.0 / 0.03, 0.05 * 4.0 / 0.03);
  loop.servo.gain = 0.045;
  adapt(60.0);
  EXPECT_NEAR(loop.kp, 4.0 / 0.045, 0.05 * 4.0 / 0.045);
  EXPECT_LT(most, 1.1 * 4.0 / 0.03);
}

TEST(ServoTracker, WaitsInAHold) {
  Loop loop(0.01, 4);
  loop.servo.dead_band = 0.3;
  loop.until(20.0);
  const auto before = loop.tracker.servo();
  for (int k = 0; k < 1500; ++k) {
    loop.sample(-0.02);
  }
  EXPECT_TRUE(loop.tracker.resting());
  EXPECT_EQ(loop.status, Status::no_information);
  // A dead band takes a part of each command, so that no K is exact: it stays the one that fits the motion.
  EXPECT_NEAR(loop.tracker.servo().gain.value / before.gain.value, 1.0F, 0.1F);
  loop.until(loop.time + 10.0);
  EXPECT_FALSE(loop.tracker.resting());
  EXPECT_NEAR(loop.tracker.servo().gain.value / before.gain.value, 1.0F, 0.1F);
}

TEST(ServoTracker, OneSampleOfALoggersNoSignalPasses) {
  Loop loop(0.01, 5);
  loop.until(20.0);
  EXPECT_FALSE(ehsid::is_error(loop.tracker.step(0.0F, 9999.0F)));
  loop.until(22.0);
  expect_right(loop, "2 s after a position of 9999");
}

TEST(ServoTracker, RefusedSamplesAreAHole) {
  Loop loop(0.01, 6);
  loop.until(20.0);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  const auto before = loop.tracker.servo();
  EXPECT_EQ(loop.tracker.step(nan, 0.0F), Status::invalid_input);
  EXPECT_EQ(loop.tracker.step(0.0F, infinity), Status::invalid_input);
  EXPECT_EQ(loop.tracker.step(0.0F, 1e30F), Status::out_of_range);
  EXPECT_EQ(loop.tracker.servo().gain.value, before.gain.value);
  EXPECT_EQ(loop.tracker.servo().gain.half_width, before.gain.half_width);
  for (int k = 0; k < 30; ++k) {  // the servo goes on meanwhile
    loop.servo.run(5.0, loop.dt);
  }
  loop.until(22.0);
  expect_right(loop, "2 s behind a hole");
}

TEST(ServoTracker, FarFromZeroAndBackwards) {
  Loop loop(0.01, 7);
  loop.servo.zero = 0.5;
  loop.until(20.0);
  expect_right(loop, "half a metre off zero");

  Loop mirrored(0.01, 8);
  mirrored.servo.gain = -0.03;
  mirrored.kp = -4.0 / 0.03;
  mirrored.until(20.0);
  expect_right(mirrored, "a positive command retracts");
}

TEST(ServoTracker, OneSineShowsTheGainOnly) {
  Loop loop(0.01, 9);
  while (loop.time < 30.0) {
    loop.sample(0.02 * std::sin(1.0 * loop.time));
  }
  const auto told = loop.tracker.servo();
  EXPECT_NEAR(static_cast<double>(told.gain.value), 0.03, 0.05 * 0.03);
  EXPECT_EQ(told.omega_n.reason, TrustReason::single_sine);
  EXPECT_EQ(told.xi.reason, TrustReason::single_sine);
}

TEST(ServoTracker, OptionsThatAreNoneChangeNothing) {
  Loop loop(0.01, 10);
  loop.until(20.0);
  const auto before = loop.tracker.servo();
  ehsid::ServoTrackerOptions<float> wrong = loop.tracker.options();
  wrong.dt_s = 0.0F;
  EXPECT_EQ(loop.tracker.configure(wrong), Status::invalid_argument);
  wrong = loop.tracker.options();
  wrong.delay = 5;
  EXPECT_EQ(loop.tracker.configure(wrong), Status::invalid_argument);
  wrong = loop.tracker.options();
  wrong.drift = -1.0F;
  EXPECT_EQ(loop.tracker.configure(wrong), Status::invalid_argument);
  EXPECT_EQ(loop.tracker.servo().gain.value, before.gain.value);
  EXPECT_EQ(loop.tracker.options().dt_s, 0.01F);
}

/// Samples of many sizes and kinds, then good ones: everything finite at each, and right again after 40 s.
TEST(ServoTracker, HostileSamplesDoNotLast) {
  std::mt19937 random{21};
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (unsigned kind = 0; kind < 12; ++kind) {
    Loop loop(0.01, 30 + kind);
    loop.until(kind % 2 == 0 ? 10.0 : 0.0);
    const double size = std::pow(10.0, 2.0 * kind - 10.0);
    for (int k = 0; k < 20000; ++k) {
      const double u = kind % 3 == 0 ? uniform(random) * size : kind % 3 == 1 ? size : 0.0;
      const double y = kind % 4 == 3 ? size * (k % 2) : size * uniform(random);
      static_cast<void>(loop.tracker.step(static_cast<float>(u), static_cast<float>(y)));
      const auto told = loop.tracker.servo();
      if (told.gain.reason != TrustReason::starting) {
        ASSERT_TRUE(ehsid::is_finite(told.gain.value) && ehsid::is_finite(told.omega_n.value) &&
                    ehsid::is_finite(told.xi.value))
            << "kind " << kind << ", sample " << k;
      }
    }
    loop.until(loop.time + 40.0);
    expect_right(loop, ("after kind " + std::to_string(kind)).c_str());
  }
}

}  // namespace
