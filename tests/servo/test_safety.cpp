// SPDX-License-Identifier: MIT
// Watchdog, safe state, numbers that are not finite, and the gain that follows the estimate.
#include <gtest/gtest.h>

#include <limits>

#include "session.hpp"

namespace test {
namespace {

using servo::Reason;
using servo::State;

TEST(Safety, TheWatchdogClosesTheValve) {
  Host host = running();
  host.sample(0, 0.0F, 0.05F);
  ASSERT_EQ(host.target.valve_command_v(), 2.0F);  // 40 * 0.05
  EXPECT_EQ(host.wait(100).kind, 0);
  ASSERT_EQ(host.target.valve_command_v(), 2.0F);
  const Heard safe = host.wait(1);
  EXPECT_EQ(safe.kind, 0x86);
  EXPECT_EQ(safe.sequence, 0);
  ASSERT_EQ(safe.body.size(), 10U);
  EXPECT_EQ(at<std::uint16_t>(safe.body, 0), 1);
  EXPECT_EQ(at<std::uint32_t>(safe.body, 2), 1U);
  EXPECT_EQ(at<float>(safe.body, 6), 0.0F);
  EXPECT_EQ(host.target.valve_command_v(), 0.0F);
  EXPECT_EQ(host.target.state(), State::safe);

  // Every second, not before
  EXPECT_EQ(host.wait(999).kind, 0);
  EXPECT_EQ(host.wait(1).body, safe.body);
  EXPECT_EQ(host.wait(999).kind, 0);
  EXPECT_EQ(host.wait(1).body, safe.body);
}

TEST(Safety, AnyValidRequestFeedsTheWatchdog) {
  Host host = running();
  for (std::uint32_t i = 0; i < 20; ++i) {
    EXPECT_EQ(host.wait(99).kind, 0);
    host.sample(i % 3 == 0 ? 77 : i, 0.0F);  // also one out of order
    EXPECT_EQ(host.wait(99).kind, 0);
    host.send(host.last);  // also one asked again
  }
  EXPECT_EQ(host.target.state(), State::running);
}

TEST(Safety, WhatIsNotUnderstoodDoesNotFeedTheWatchdog) {
  Host host = running();
  host.wait(60);
  host.ask(0x55);
  EXPECT_EQ(host.wait(41).kind, 0x86);
}

TEST(Safety, TheWatchdogWatchesTheRunOnly) {
  Host idle;
  EXPECT_EQ(idle.wait(500).kind, 0);
  Host ready;
  ready.configure();
  EXPECT_EQ(ready.wait(500).kind, 0);
  expect_done(ready.start(), State::running);
  EXPECT_EQ(ready.wait(100).kind, 0);
  ready.stop();
  EXPECT_EQ(ready.wait(500).kind, 0);
  EXPECT_EQ(ready.target.state(), State::ready);
}

TEST(Safety, SamplesThatComeTooLateDoNotOpenTheValve) {
  Host host = running();
  host.sample(0, 0.0F, 0.05F);
  host.wait(101);
  for (std::uint32_t i = 1; i < 5; ++i) {
    const Heard refused = host.sample(1, 0.0F, 0.05F);
    expect_refused(host, refused, Reason::state);
    EXPECT_EQ(expected_of(refused), 1U);
    host.wait(10);
    EXPECT_EQ(host.target.valve_command_v(), 0.0F);
  }
  expect_done(host.stop(), State::ready);
  EXPECT_EQ(host.target.valve_command_v(), 0.0F);
}

TEST(Safety, ResumeKeepsTheEstimateAndBeginsWithTheFixedGain) {
  Host host = running();
  Host undisturbed = running();
  Drive drive;
  Drive reference;
  Heard result;
  Heard expected;
  for (int i = 0; i < 400; ++i) {
    result = drive.step(host);
    expected = reference.step(undisturbed);
  }
  ASSERT_TRUE((flags_of(result) & servo::kGainFromEstimate) != 0);
  ASSERT_NE(gain_of(result), 40.0F);
  host.wait(101);
  expect_done(host.resume(), State::running);
  EXPECT_EQ(host.target.valve_command_v(), 0.0F);  // until the next sample
  const Heard next = drive.step(host);
  EXPECT_EQ(gain_of(next), 40.0F);
  EXPECT_TRUE((flags_of(next) & servo::kGainFromEstimate) == 0);
  EXPECT_EQ(trips_of(next), 1);
  // Position and estimate were those of the other run up to here; that of this sample knows only its innovation.
  const Heard other = reference.step(undisturbed);
  EXPECT_EQ(at<float>(next.body, 20), at<float>(other.body, 20));
  // The estimate was settled before, and still is: its gain is back with the sample after.
  EXPECT_TRUE((flags_of(drive.step(host)) & servo::kGainFromEstimate) != 0);
  // Again, with a watchdog that works as before
  EXPECT_EQ(host.wait(101).kind, 0x86);
}

TEST(Safety, ANewStartKeepsTheEstimateAndFillsTheHistoryAnew) {
  Host host = running();
  Drive drive;
  Heard result;
  for (int i = 0; i < 400; ++i) {
    result = drive.step(host);
  }
  host.stop();
  EXPECT_EQ(host.target.valve_command_v(), 0.0F);
  expect_done(host.start(400), State::running);
  const Heard next = drive.step(host);
  EXPECT_EQ(status_of(next), EHSID_FILLING);
  EXPECT_EQ(gain_of(next), 40.0F);
  EXPECT_EQ(theta_of(next), theta_of(result));
}

TEST(Safety, TheGainFollowsTheVelocityGain) {
  Host host = running();
  Drive drive;
  Heard before;
  Heard result;
  for (int i = 0; i < 400; ++i) {
    before = result;
    result = drive.step(host);
    // A converged estimate is settled, and the gain follows one that is settled, which no message tells.
    const bool converged = i > 0 && (flags_of(before) & servo::kConverged) != 0;
    const bool followed = i > 0 && (flags_of(before) & servo::kGainFromEstimate) != 0;
    const bool follows = (flags_of(result) & servo::kGainFromEstimate) != 0;
    ASSERT_TRUE(follows || !(converged || followed)) << i;
    ASSERT_TRUE(follows || gain_of(result) == 40.0F) << i;
    ASSERT_EQ(velocity_gain_of(result), servo::velocity_gain(theta_of(result).data(), 3, 3, 0.01F));
  }
  // Bandwidth 2 rad/s over the estimate of the sample before; the step of 2 V/m a sample no longer binds.
  ASSERT_TRUE((flags_of(result) & servo::kGainFromEstimate) != 0);
  EXPECT_EQ(gain_of(result), 2.0F / velocity_gain_of(before));
}

TEST(Safety, NotFiniteNumbersCloseTheValveForThatSample) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  Host host = running();
  Drive drive;
  for (int i = 0; i < 400; ++i) {
    drive.step(host);
  }
  const Heard bad_position = host.sample(drive.number++, kNan, 0.1F);
  EXPECT_EQ(command_of(bad_position), 0.0F);
  EXPECT_EQ(host.target.valve_command_v(), 0.0F);
  EXPECT_EQ(gain_of(bad_position), 40.0F);
  EXPECT_EQ(status_of(bad_position), EHSID_INVALID_INPUT);
  const Heard after = drive.step(host);
  EXPECT_EQ(gain_of(after), 40.0F);  // the estimator had reported an error
  EXPECT_EQ(status_of(after), EHSID_FILLING);

  for (const int which : {1, 2, 3}) {
    float values[4] = {0.0F, 0.0F, 0.0F, 0.0F};
    values[which] = kNan;
    const Heard bad = host.sample(drive.number++, values[0], values[1], values[2], values[3]);
    EXPECT_EQ(command_of(bad), 0.0F);
    EXPECT_EQ(gain_of(bad), 40.0F);
    EXPECT_NE(status_of(bad), EHSID_INVALID_INPUT);
  }
}

}  // namespace
}  // namespace test
