// SPDX-License-Identifier: MIT
// Which configurations are taken, and what a refused one leaves.
#include <gtest/gtest.h>
#include <ehsid/forgetting.hpp>

#include <algorithm>
#include <limits>
#include <vector>

#include "session.hpp"

namespace test {
namespace {

using servo::Reason;
using servo::State;

TEST(Configuration, EveryPolicyAndSizeItNames) {
  for (std::uint8_t policy = 0; policy <= ehsid::kPolicies; ++policy) {
    for (int n = 2; n <= 13; ++n) {
      Settings settings;
      settings.policy = policy;
      settings.na = static_cast<std::uint8_t>(n / 2);
      settings.nb = static_cast<std::uint8_t>(n / 2);
      if (n % 2 == 1) {
        settings.flags |= servo::kOffset;
      }
      Host host;
      const Heard answer = host.configure(settings);
      if (policy < ehsid::kPolicies && (n == 6 || n == 7)) {
        expect_done(answer, State::ready);
      } else {
        expect_refused(host, answer, Reason::not_in_firmware);
        EXPECT_EQ(host.target.state(), State::idle);
      }
    }
  }
}

TEST(Configuration, ARefusedConfigurationLeavesTheOneBefore) {
  Host host;
  host.hello();
  host.configure();
  host.start();
  Drive drive;
  for (int i = 0; i < 50; ++i) {
    drive.step(host);
  }
  host.stop();
  Settings wrong;
  wrong.controller[1] = 20.0F;
  wrong.forgetting[7] = 0.5F;  // critical_ratio of the F-ratio: the estimator refuses it
  expect_refused(host, host.configure(wrong), Reason::configuration, EHSID_INVALID_ARGUMENT);
  EXPECT_EQ(host.target.state(), State::ready);

  Host undisturbed;
  undisturbed.configure();
  undisturbed.start();
  Drive same;
  for (int i = 0; i < 50; ++i) {
    same.step(undisturbed);
  }
  undisturbed.stop();
  for (Host* each : {&host, &undisturbed}) {
    expect_done(each->start(100), State::running);
  }
  drive.number = same.number = 100;
  for (int i = 0; i < 50; ++i) {
    const Heard made = drive.step(host);
    const Heard expected = same.step(undisturbed);
    ASSERT_EQ(made.body, expected.body);
  }
}

TEST(Configuration, EachSettingOutOfItsRangeIsRefused) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  std::vector<Settings> wrong;
  const auto add = [&](auto change) {
    Settings settings;
    change(settings);
    wrong.push_back(settings);
  };
  add([](Settings& s) { s.flags = 0x20; });
  add([](Settings& s) { s.flags |= 0x80; });
  add([](Settings& s) { s.watchdog_ms = 0; });
  add([](Settings& s) { s.watchdog_ms = 60'001; });
  add([](Settings& s) { s.nk = 21; });
  add([](Settings& s) { s.cool_down = -1; });
  add([](Settings& s) { s.hold = 0; });
  add([](Settings& s) { s.reset_floor = kNan; });
  for (std::size_t i = 0; i < 4; ++i) {
    add([i](Settings& s) { s.scaling[i] = kNan; });
    add([i](Settings& s) { s.reset[i] = kNan; });
  }
  for (std::size_t i = 0; i < 2; ++i) {
    add([i](Settings& s) { s.guards[i] = kNan; });
    add([i](Settings& s) { s.convergence[i] = kNan; });
    add([i](Settings& s) { s.start[i] = kNan; });
  }
  for (std::size_t i = 0; i < 8; ++i) {
    add([i](Settings& s) { s.controller[i] = kNan; });
  }
  // Each policy reads its own settings; those of others may be anything.
  std::vector<std::vector<int>> read;
  ehsid::for_each_policy([&](auto place) {
    read.emplace_back();
    ehsid::PolicyAt<place, float>::settings(
        [&](const ehsid::SettingInfo& setting, auto /*member*/) {
          read.back().push_back(setting.hil_place);
        });
  });
  for (std::size_t policy = 0; policy < read.size(); ++policy) {
    for (int i = 0; i < ehsid::kHilPlaces; ++i) {
      Settings settings;
      settings.policy = static_cast<std::uint8_t>(policy);
      settings.forgetting[static_cast<std::size_t>(i)] = kNan;
      const bool own = std::count(read[policy].begin(), read[policy].end(), i) > 0;
      if (own) {
        wrong.push_back(settings);
      } else {
        Host host;
        expect_done(host.configure(settings), State::ready);
      }
    }
  }
  for (std::size_t i = 0; i < 28; ++i) {
    Settings settings;
    settings.flags |= servo::kSeed;
    settings.seed.assign(28, 0.5F);
    Host host;
    expect_done(host.configure(settings), State::ready);
    settings.seed[i] = kNan;
    wrong.push_back(settings);
  }
  for (const Settings& settings : wrong) {
    Host host;
    expect_refused(host, host.configure(settings), Reason::configuration, EHSID_INVALID_ARGUMENT);
    EXPECT_EQ(host.target.state(), State::idle);
    expect_done(host.configure(), State::ready);
  }
}

}  // namespace
}  // namespace test
