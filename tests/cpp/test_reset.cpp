// SPDX-License-Identifier: MIT
#include <ehsid/reset.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

namespace {

using Detector = ehsid::RmseReset<float>;
using ehsid::Status;

Detector made(const Detector::Options& options = {}) {
  Detector detector;
  EXPECT_EQ(detector.configure(options), Status::ok);
  return detector;
}

/// Index of the sample that raises the alarm where large errors begin: the short mean goes 1 + 21.05 (1 - 0.9^m) and must
/// pass 9 times a long mean that grows by 2.5 % a sample; m = 5 is the first to do it, with 9.62 against 9.25.
constexpr int kFifth = 4;

/// Samples up to `limit` until the alarm, or -1.
int samples_to_alarm(Detector& detector, float square, int limit) {
  for (int k = 0; k < limit; ++k) {
    if (detector.update(square)) {
      return k;
    }
  }
  return -1;
}

TEST(RmseReset, StationaryNoiseRaisesNoAlarm) {
  Detector detector = made();
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  for (int k = 0; k < 200000; ++k) {
    const float error = normal(random);
    // The mean of about 10 squares would have to be nine times the variance: 99 is the size of the
    // chi-squared statistic of 11 degrees of freedom, exceeded once in 1e16 samples.
    ASSERT_FALSE(detector.update(error * error)) << "at " << k;
  }
}

TEST(RmseReset, AlarmComesWhenTheShortWindowExceedsTheRatio) {
  Detector detector = made();
  EXPECT_EQ(samples_to_alarm(detector, 1.0F, 300), -1);
  EXPECT_EQ(samples_to_alarm(detector, 101.0F, 10), kFifth);
  EXPECT_EQ(detector.alarms(), 1);
  // What it learned before the change stays, but for the four errors before the alarm: of each 6 / 200 - 1 / 200.
  EXPECT_NEAR(detector.long_rmse(), std::pow(1.025F, 2.0F), 1e-5F);
}

TEST(RmseReset, FewLargeErrorsRaiseNoAlarmHoweverLarge) {
  // One false position makes four large errors in a model with three past outputs.
  for (const float size : {36.0F, 1e4F, 1e16F}) {
    for (int errors = 1; errors <= kFifth; ++errors) {
      for (const int usual : {20, 199, 300}) {
        Detector detector = made();
        samples_to_alarm(detector, 1.0F, usual);
        EXPECT_EQ(samples_to_alarm(detector, size, errors), -1) << size << " " << errors;
        EXPECT_EQ(samples_to_alarm(detector, 1.0F, 300), -1) << size << " " << errors;
        // They do not hide a change that follows, either.
        EXPECT_EQ(samples_to_alarm(detector, 101.0F, 10), kFifth) << size << " " << errors;
      }
    }
  }
}

TEST(RmseReset, AChangeBelowTheRatioIsNone) {
  Detector detector = made();
  samples_to_alarm(detector, 1.0F, 300);
  EXPECT_EQ(samples_to_alarm(detector, 8.9F, 1000), -1);  // ratio of RMSE 2.98
}

TEST(RmseReset, KnownNoiseArmsItFromTheFirstSample) {
  Detector detector = made();
  detector.restart(1.0F);
  EXPECT_EQ(detector.long_rmse(), 1.0F);
  // As after a long window of ones.
  EXPECT_EQ(samples_to_alarm(detector, 101.0F, 10), kFifth);
  // Errors as they were told raise none, and a ratio of 2.98 is none.
  detector.restart(1.0F);
  EXPECT_EQ(samples_to_alarm(detector, 1.0F, 1000), -1);
  detector.restart(1.0F);
  EXPECT_EQ(samples_to_alarm(detector, 8.9F, 1000), -1);
  // Unknown noise: as restart().
  detector.restart(0.0F);
  EXPECT_EQ(detector.state().seen, 0);
  EXPECT_EQ(samples_to_alarm(detector, 101.0F, 100), -1);
}

TEST(RmseReset, KnownNoiseWithAWindowBeyondCountingDoesNotOverflow) {
  Detector::Options options;
  options.long_window = 1e30F;
  Detector detector = made(options);
  detector.restart(1.0F);
  EXPECT_TRUE(Detector::usable(detector.state()));
  EXPECT_EQ(samples_to_alarm(detector, 101.0F, 100), -1);  // never full, so never an alarm
}

TEST(RmseReset, NothingIsAChangeBeforeTheLongWindowIsFull) {
  Detector detector = made();
  samples_to_alarm(detector, 1.0F, 150);
  EXPECT_EQ(samples_to_alarm(detector, 1e6F, 49), -1);
}

TEST(RmseReset, NothingIsAnAlarmDuringTheCoolDown) {
  Detector detector = made();
  samples_to_alarm(detector, 1.0F, 300);
  ASSERT_EQ(samples_to_alarm(detector, 101.0F, 10), kFifth);
  EXPECT_EQ(samples_to_alarm(detector, 1.0F, 10), -1);
  EXPECT_EQ(samples_to_alarm(detector, 1e4F, 40), -1);  // the last of the 50
}

TEST(RmseReset, ArmedAgainWithTheFirstQuietSampleAfterTheCoolDown) {
  Detector detector = made();
  samples_to_alarm(detector, 1.0F, 300);
  ASSERT_EQ(samples_to_alarm(detector, 101.0F, 10), kFifth);
  samples_to_alarm(detector, 1.0F, 50);
  EXPECT_EQ(detector.state().armed, 0);
  detector.update(1.0F);
  EXPECT_EQ(detector.state().armed, 1);
  EXPECT_EQ(samples_to_alarm(detector, 101.0F, 10), kFifth);
}

TEST(RmseReset, NoSecondAlarmBeforeTheErrorsHaveFallen) {
  Detector::Options options;
  options.cool_down = 5;
  Detector detector = made(options);
  samples_to_alarm(detector, 1.0F, 300);
  ASSERT_EQ(samples_to_alarm(detector, 101.0F, 10), kFifth);
  // A square counts 22 times the long mean in the short one, above the trigger of nine times, but the detector is not
  // armed.
  EXPECT_EQ(samples_to_alarm(detector, 101.0F, 60), -1);
  EXPECT_EQ(detector.state().armed, 0);
  EXPECT_EQ(samples_to_alarm(detector, 1.0F, 2000), -1);
  EXPECT_EQ(detector.state().armed, 1);
  EXPECT_GE(samples_to_alarm(detector, 1e4F, 10), 0);
  EXPECT_EQ(detector.alarms(), 2);
}

TEST(RmseReset, RoundingOfANoiselessPlantIsBelowTheFloor) {
  Detector detector = made();
  samples_to_alarm(detector, 0.0F, 300);
  EXPECT_EQ(samples_to_alarm(detector, 1e-10F, 100), -1);  // RMSE 1e-5, the floor
  EXPECT_GE(samples_to_alarm(detector, 1e-6F, 100), 0);
}

TEST(RmseReset, CountersStopAtTheirLimit) {
  constexpr std::int32_t kLast = std::numeric_limits<std::int32_t>::max();
  // A long window that is never full, so that `seen` counts on; no cool-down, so that alarms may follow one another.
  Detector::Options options;
  options.long_window = 1e30F;
  options.cool_down = 0;
  Detector counting = made(options);
  ASSERT_EQ(counting.restore({1.0F, 1.0F, kLast - 1, 0, 0, 1}), Status::ok);
  for (int k = 0; k < 5; ++k) {
    EXPECT_FALSE(counting.update(1.0F));
    EXPECT_EQ(counting.state().seen, kLast);
  }

  Detector alarming = made();
  ASSERT_EQ(alarming.restore({1.0F, 1.0F, kLast, 0, kLast - 1, 1}), Status::ok);
  EXPECT_EQ(samples_to_alarm(alarming, 1e4F, 10), kFifth);
  EXPECT_EQ(alarming.alarms(), kLast);
  ASSERT_EQ(alarming.restore({1.0F, 1.0F, kLast, 0, kLast, 1}), Status::ok);
  EXPECT_EQ(samples_to_alarm(alarming, 1e4F, 10), kFifth);
  EXPECT_EQ(alarming.alarms(), kLast);

  Detector cooling = made();
  ASSERT_EQ(cooling.restore({1.0F, 1.0F, kLast, kLast, 0, 1}), Status::ok);
  EXPECT_FALSE(cooling.update(1e4F));
  EXPECT_EQ(cooling.state().cooling, kLast - 1);
}

TEST(RmseReset, OptionsOutsideTheirRangesAreRefused) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Detector detector = made();
  samples_to_alarm(detector, 1.0F, 20);
  const auto refused = [&](auto change) {
    Detector::Options options;
    change(options);
    return detector.configure(options) == Status::invalid_argument;
  };
  EXPECT_TRUE(refused([](auto& o) { o.short_window = 0.5F; }));
  EXPECT_TRUE(refused([](auto& o) { o.long_window = o.short_window; }));
  EXPECT_TRUE(refused([](auto& o) { o.trigger_ratio = o.release_ratio; }));
  EXPECT_TRUE(refused([](auto& o) { o.release_ratio = 0.9F; }));
  EXPECT_TRUE(refused([](auto& o) { o.cool_down = -1; }));
  EXPECT_TRUE(refused([&](auto& o) { o.floor = nan; }));
  EXPECT_EQ(detector.state().seen, 20);
}

TEST(RmseReset, DamagedStateIsRefused) {
  Detector detector = made();
  auto state = detector.state();
  state.long_square = -1.0F;
  EXPECT_EQ(detector.restore(state), Status::invalid_argument);
  state = detector.state();
  state.armed = 3;
  EXPECT_EQ(detector.restore(state), Status::invalid_argument);
  EXPECT_EQ(detector.restore(detector.state()), Status::ok);
}

}  // namespace
