// SPDX-License-Identifier: MIT
#include <ehsid/growth_monitor.hpp>
#include <ehsid/servo_transition.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <type_traits>
#include <vector>

namespace {

using ehsid::Status;
using Monitor = ehsid::GrowthMonitor<float, 4, 3>;
using Tables = Monitor::Tables;

static_assert(std::is_trivially_copyable_v<Monitor::State>, "states are copied as bytes");

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Effect 0 shifts the mean everywhere, 1 with the sign of the command, and 2 where the command is large and the acceleration
/// is not below zero, by -0.3 a unit; another signature of it is nearly the same. What is eliminated goes with the size of the
/// command, and with the sign of the acceleration.
Tables tables() {
  Tables made{};
  made.signatures = 4;
  made.tests = 3;
  made.delay = 1;
  made.settle = 30;
  made.block = 100;
  const auto step = ehsid::servo_transition(0.3F, 0.7F);
  made.gain = 1e-3F;
  made.s = step.s.value;
  made.w = step.w.value;
  made.e = step.e.value;
  made.i = step.i.value;
  made.decay = step.decay.value;
  made.pull = step.pull.value;
  made.correction = {0.6F, 0.3F, 0.05F};
  made.command_edges = {-3.0F, -2.0F, -1.0F, 0.0F, 1.0F, 2.0F, 3.0F};
  made.acceleration_edges = {-2e-4F, -1e-4F, 1e-4F, 2e-4F};
  for (int c = 0; c < ehsid::kGrowthCommands; ++c) {
    for (int a = 0; a < ehsid::kGrowthAccelerations; ++a) {
      auto& cell = made.cells[static_cast<std::size_t>(c * ehsid::kGrowthAccelerations + a)];
      cell.weight = 1e5F;
      cell.other = {std::abs(static_cast<float>(c) - 3.5F) * 0.1F, a < 2 ? -0.1F : 0.1F};
      const float large = (c == 0 || c == 7) && a > 1 ? -0.3F : 0.0F;
      cell.signature = {0.2F, c < 4 ? -0.2F : 0.2F, (c == 0 ? 0.97F : 1.03F) * large, large};
    }
  }
  made.prior = 0.01F;
  made.effect = {0, 1, 2, 2};
  made.asked = {{{0, 1.0F, 0.0F}, {1, 1.0F, 0.0F}, {3, 1.0F, 0.0F}}};
  made.limit = 12.0F;
  return made;
}

/// Positions whose innovations are white, of deviation 1e-5, with a mean as the tables say for these sizes.
class Machine {
 public:
  /// every: samples between outliers of 9 deviations; 0: none.
  Machine(const Tables& tables, std::array<float, 3> sizes, int every = 0)
      : sizes_(sizes), every_(every), tables_(tables) {
    EXPECT_EQ(twin_.configure(tables_), Status::ok);
  }

  /// The next sample. The twin tells what a position without an innovation is: its innovation of any other is linear.
  void next(float& command, float& position) {
    if (count_++ % 25 == 0) {
      held_ = std::floor(normal_(random_) * 2.0F) + 0.5F;
    }
    command = held_;
    Monitor asked = twin_;
    static_cast<void>(asked.step(command, position_));
    const auto& state = asked.state();
    const auto& cell = tables_.cells[static_cast<std::size_t>(state.cell)];
    float wanted = normal_(random_);
    for (std::size_t n = 0; n < 3; ++n) {
      wanted += sizes_[n] * cell.signature[n == 2 ? 3 : n];
    }
    wanted += every_ > 0 && count_ % every_ == 0 ? 9.0F : 0.0F;
    position_ += wanted * 1e-5F - state.innovation;
    position = position_;
    static_cast<void>(twin_.step(command, position));
  }

 private:
  std::array<float, 3> sizes_;
  int every_;
  Tables tables_;
  Monitor twin_;
  std::mt19937 random_{7};
  std::normal_distribution<float> normal_;
  float held_ = 0.0F;
  float position_ = 0.0F;
  int count_ = 0;
};

void run(Monitor& monitor, Machine& machine, int samples) {
  for (int k = 0; k < samples; ++k) {
    float command = 0.0F;
    float position = 0.0F;
    machine.next(command, position);
    ASSERT_FALSE(ehsid::is_error(monitor.step(command, position))) << k;
  }
}

TEST(GrowthMonitor, NamesTheEffectThatGrowsWithItsSize) {
  const Tables made = tables();
  const std::array<std::array<float, 3>, 3> grown{
      {{2.0F, 0.0F, 0.0F}, {0.0F, 2.0F, 0.0F}, {0.0F, 0.0F, 2.0F}}};
  for (int n = 0; n < 3; ++n) {
    Monitor monitor;
    ASSERT_EQ(monitor.configure(made), Status::ok);
    Machine machine(made, grown[static_cast<std::size_t>(n)]);
    run(monitor, machine, 20000);
    EXPECT_EQ(monitor.named(), n);
    EXPECT_TRUE(monitor.told(n).alarmed) << n;
    const auto told = monitor.told(n);
    // All the blocks but the one that is not complete, or one more that was below zero.
    EXPECT_GE(told.blocks, 195);
    EXPECT_NEAR(told.size, 2.0F, 4.0F * told.deviation);
    EXPECT_LT(told.deviation, 0.2F);
  }
}

TEST(GrowthMonitor, TheStatisticIsTheLogarithmOfTheLikelihoodRatio) {
  // By hand, in double, of the samples: integrals over what is eliminated are those of Gaussians.
  Tables made = tables();
  made.limit = 1e6F;
  made.asked[0] = {0, 0.5F, 0.25F};
  Monitor monitor;
  ASSERT_EQ(monitor.configure(made), Status::ok);
  Machine machine(made, {1.5F, 0.5F, 0.0F}, 20);
  double b[3] = {};
  double a[3][3] = {};
  const int samples = 1 + made.settle + 3 * made.block;
  for (int k = 0; k < samples + ehsid::growth_steps(4, 3); ++k) {
    float command = 0.0F;
    float position = 0.0F;
    machine.next(command, position);
    static_cast<void>(monitor.step(command, position));
    if (k <= made.settle || k >= samples) {
      continue;
    }
    const auto& cell = made.cells[static_cast<std::size_t>(monitor.state().cell)];
    const double x = static_cast<double>(monitor.state().innovation) * 1e5;
    const float shape[3] = {cell.signature[0], cell.other[0], cell.other[1]};
    for (std::size_t i = 0; i < 3; ++i) {
      b[i] += static_cast<double>(shape[i]) * std::fmin(std::fmax(x, -4.0), 4.0);
      for (std::size_t j = 0; j < 3; ++j) {
        a[i][j] += static_cast<double>(shape[i]) * static_cast<double>(shape[j]);
      }
    }
  }
  ASSERT_EQ(monitor.told(0).blocks, 3) << "the test began anew: take another seed";
  const double a11 = a[1][1] + 0.01;
  const double a22 = a[2][2] + 0.01;
  const double determinant = a11 * a22 - a[1][2] * a[1][2];
  const double share1 = (a[0][1] * a22 - a[0][2] * a[1][2]) / determinant;
  const double share2 = (a[0][2] * a11 - a[0][1] * a[1][2]) / determinant;
  const double score = b[0] - share1 * b[1] - share2 * b[2];
  const double information = a[0][0] - share1 * a[0][1] - share2 * a[0][2];
  const double wanted = 0.5 * (0.75 * score - (1.0 - 0.0625) / 2.0 * information);
  // Sums of 300 numbers in float32, each rounded by half an epsilon of a sum that is below 100.
  EXPECT_NEAR(static_cast<double>(monitor.told(0).statistic), wanted, 300 * 100 * 6e-8);
  EXPECT_NEAR(static_cast<double>(monitor.told(0).size), score / information, 1e-3);
  EXPECT_NEAR(static_cast<double>(monitor.told(0).deviation), std::sqrt(2.0 / information), 1e-3);
}

TEST(GrowthMonitor, EffectsThatLookAlikeAreNotNamed) {
  Tables made = tables();
  for (auto& cell : made.cells) {
    cell.signature[1] = 1.001F * cell.signature[0];
  }
  Machine machine(made, {2.0F, 0.0F, 0.0F});
  Monitor monitor;
  ASSERT_EQ(monitor.configure(made), Status::ok);
  run(monitor, machine, 20000);
  EXPECT_GE(monitor.first(), 0);
  EXPECT_EQ(monitor.named(), -1);
}

TEST(GrowthMonitor, WhatIsEliminatedIsNoGrowth) {
  const Tables made = tables();
  Tables changed = made;  // of the machine: its gain has changed by two units
  for (auto& cell : changed.cells) {
    cell.signature[0] = cell.other[0];
  }
  Machine machine(changed, {2.0F, 0.0F, 0.0F});
  Monitor monitor;
  ASSERT_EQ(monitor.configure(made), Status::ok);
  run(monitor, machine, 20000);
  EXPECT_EQ(monitor.first(), -1);
}

TEST(GrowthMonitor, FalseAlarmsAreRarerThanTheLimitSays) {
  // A limit of ln 200: one alarm in 200 blocks of each test, or rarer. 3 tests, 4,000 blocks.
  Tables made = tables();
  made.limit = std::log(200.0F);
  Monitor monitor;
  ASSERT_EQ(monitor.configure(made), Status::ok);
  Machine machine(made, {0.0F, 0.0F, 0.0F});
  int alarms = 0;
  for (int k = 0; k < 4000 * made.block; ++k) {
    float command = 0.0F;
    float position = 0.0F;
    machine.next(command, position);
    static_cast<void>(monitor.step(command, position));
    if (monitor.first() >= 0) {
      ++alarms;
      monitor.restart();
    }
  }
  EXPECT_LE(alarms, 60);
  EXPECT_GE(alarms, 1) << "it cannot see anything";
}

TEST(GrowthMonitor, BadSamplesAddNothingAndAreAHole) {
  const Tables made = tables();
  Monitor monitor;
  EXPECT_EQ(monitor.step(0.0F, 0.0F), Status::invalid_argument);
  ASSERT_EQ(monitor.configure(made), Status::ok);
  Machine machine(made, {0.0F, 0.0F, 0.0F});
  run(monitor, machine, 1030);
  const Monitor::State before = monitor.state();
  EXPECT_EQ(monitor.step(kNaN, 0.0F), Status::invalid_input);
  EXPECT_EQ(monitor.state().started, 0);
  EXPECT_EQ(monitor.step(0.0F, kInfinity), Status::invalid_input);
  EXPECT_EQ(monitor.step(0.0F, -2e12F), Status::out_of_range);
  Monitor::State after = monitor.state();
  after.started = before.started;
  EXPECT_EQ(std::memcmp(&after, &before, sizeof after), 0);
  // The observer settles anew, and nothing is added before.
  for (int k = 0; k <= made.settle; ++k) {
    EXPECT_EQ(monitor.step(1.0F, 5.0F), Status::filling);
  }
  EXPECT_EQ(monitor.state().counted, before.counted);
  EXPECT_EQ(monitor.step(1.0F, 5.0F), Status::ok);
}

TEST(GrowthMonitor, StaysFiniteWhateverComes) {
  const Tables made = tables();
  Monitor monitor;
  ASSERT_EQ(monitor.configure(made), Status::ok);
  std::mt19937 random{3};
  const std::array<float, 9> hostile{0.0F,   1e12F, -1e12F,  kNaN, kInfinity,
                                     1e-38F, 3e38F, -1e-45F, 1.0F};
  for (int k = 0; k < 200000; ++k) {
    const auto pick = [&] { return hostile[random() % hostile.size()]; };
    static_cast<void>(monitor.step(pick(), pick()));
    if (k % 1000 == 0) {
      ASSERT_TRUE(monitor.usable(monitor.state())) << k;
    }
  }
}

TEST(GrowthMonitor, ASavedStateGoesOnAndADamagedOneIsRefused) {
  const Tables made = tables();
  Monitor first;
  Monitor second;
  EXPECT_EQ(second.restore(first.state()), Status::invalid_argument) << "not configured";
  ASSERT_EQ(first.configure(made), Status::ok);
  ASSERT_EQ(second.configure(made), Status::ok);
  Machine machine(made, {0.5F, 0.0F, 0.0F});
  run(first, machine, 777);
  ASSERT_EQ(second.restore(first.state()), Status::ok);
  for (int k = 0; k < 1000; ++k) {
    float command = 0.0F;
    float position = 0.0F;
    machine.next(command, position);
    ASSERT_EQ(first.step(command, position), second.step(command, position));
  }
  EXPECT_EQ(std::memcmp(&first.state(), &second.state(), sizeof first.state()), 0);
  std::vector<Monitor::State> damaged(6, first.state());
  damaged[0].velocity = kNaN;
  damaged[1].counted = made.block;
  damaged[2].work.test = 4;
  damaged[3].cell = ehsid::kGrowthCells;
  damaged[4].tests[1].sums.rows[2].information = kInfinity;
  damaged[5].work.cell = 2;
  for (const auto& state : damaged) {
    EXPECT_EQ(second.restore(state), Status::invalid_argument);
  }
  EXPECT_EQ(std::memcmp(&first.state(), &second.state(), sizeof first.state()), 0);
}

TEST(GrowthMonitor, TablesWithoutAMeaningAreRefused) {
  std::vector<Tables> wrong(13, tables());
  wrong[0].signatures = 3;
  wrong[1].tests = 4;
  wrong[2].delay = 0;
  wrong[3].delay = ehsid::kGrowthMostDelay + 1;
  wrong[4].block = ehsid::growth_steps(4, 3) - 1;
  wrong[5].command_edges[3] = 1.0F;
  wrong[6].cells[7].weight = -1.0F;
  wrong[7].cells[39].signature[2] = kNaN;
  wrong[8].prior = 0.0F;
  wrong[9].asked[1].signature = 4;
  wrong[10].asked[2].margin = 1.0F;
  wrong[11].limit = kInfinity;
  wrong[12].effect[3] = 3;
  Monitor monitor;
  for (std::size_t n = 0; n < wrong.size(); ++n) {
    EXPECT_EQ(monitor.configure(wrong[n]), Status::invalid_argument) << n;
  }
  EXPECT_EQ(monitor.tables(), nullptr);
}

}  // namespace
