// SPDX-License-Identifier: MIT
// A bank of servo estimators is its axes, each alone, bit for bit.
#include <ehsid/servo_bank.hpp>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

namespace {

using ehsid::Status;

constexpr int kAxes = 5;
constexpr std::size_t kHostile = 2;

template <class Estimator>
std::vector<std::uint8_t> saved(const Estimator& estimator) {
  std::vector<std::uint8_t> bytes(estimator.snapshot_bytes());
  estimator.save(bytes.data());
  return bytes;
}

/// Commands and positions of servos that differ; one of them measures what no servo does.
template <class Scalar>
class Axes {
 public:
  using Each = std::array<Scalar, kAxes>;

  void next() {
    for (std::size_t i = 0; i < commands.size(); ++i) {
      if (random_() % 40 == 0) {
        command_[i] = std::uniform_real_distribution<double>(-5.0, 5.0)(random_);
      }
      const double gain = 0.03 + 0.01 * static_cast<double>(i);
      velocity_[i] += 0.2 * (gain * command_[i] - velocity_[i]);
      position_[i] += 0.01 * velocity_[i];
      commands[i] = static_cast<Scalar>(command_[i]);
      positions[i] =
          static_cast<Scalar>(position_[i] + 5e-6 * std::normal_distribution<double>()(random_));
    }
    using Limits = std::numeric_limits<Scalar>;
    const std::array<Scalar, 6> bad{Limits::quiet_NaN(), Limits::infinity(), Limits::lowest(),
                                    Scalar(9999),        Scalar(1e12),       Scalar(0)};
    if (random_() % 3 == 0) {
      positions[kHostile] = bad[random_() % bad.size()];
    }
    if (random_() % 50 == 0) {
      commands[kHostile] = bad[random_() % bad.size()];
    }
  }

  Each commands{};
  Each positions{};

 private:
  std::mt19937 random_{1};
  std::array<double, kAxes> command_{};
  std::array<double, kAxes> velocity_{};
  std::array<double, kAxes> position_{};
};

template <class Scalar>
class ServoBank : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(ServoBank, Scalars, );

TYPED_TEST(ServoBank, IsItsAxesBitForBitWhateverOneOfThemMeasures) {
  const auto bank = std::make_unique<ehsid::ServoBank<TypeParam, kAxes>>();
  const auto alone = std::make_unique<std::array<ehsid::ServoEstimator<TypeParam>, kAxes>>();
  typename ehsid::ServoBank<TypeParam, kAxes>::Options options;
  options.dt_s = TypeParam(0.01);
  ASSERT_EQ(bank->configure(options), Status::ok);
  for (auto& one : *alone) {
    ASSERT_EQ(one.configure(options), Status::ok);
  }
  Axes<TypeParam> axes;
  for (int k = 0; k < 3000; ++k) {
    axes.next();
    const auto status = bank->step(axes.commands, axes.positions);
    for (std::size_t i = 0; i < status.size(); ++i) {
      ASSERT_EQ(status[i], (*alone)[i].step(axes.commands[i], axes.positions[i])) << k;
    }
  }
  const auto told = bank->servo();
  for (std::size_t i = 0; i < told.size(); ++i) {
    EXPECT_EQ(saved((*bank)[static_cast<int>(i)]), saved((*alone)[i])) << "axis " << i;
    if (i != kHostile) {
      EXPECT_TRUE(ehsid::is_finite(told[i].gain.value)) << "axis " << i;
      EXPECT_EQ(told[i].gain.value, (*alone)[i].servo().gain.value) << "axis " << i;
    }
  }
}

TYPED_TEST(ServoBank, AnAxisIsRestoredAlone) {
  const auto bank = std::make_unique<ehsid::ServoBank<TypeParam, kAxes>>();
  typename ehsid::ServoBank<TypeParam, kAxes>::Options options;
  const auto one_step = [&bank](TypeParam value) {
    std::array<TypeParam, kAxes> samples{};
    samples.fill(value);
    return bank->step(samples, samples);
  };
  EXPECT_EQ(bank->configure(options), Status::invalid_argument);
  EXPECT_EQ(one_step(TypeParam(1))[0], Status::invalid_argument);
  options.dt_s = TypeParam(0.01);
  ASSERT_EQ(bank->configure(options), Status::ok);
  const auto fresh = saved((*bank)[0]);
  one_step(TypeParam(1));
  const auto stepped = saved((*bank)[0]);
  EXPECT_NE(stepped, fresh);
  EXPECT_EQ((*bank)[1].restore(fresh.data(), fresh.size()), Status::ok);
  EXPECT_EQ(saved((*bank)[1]), fresh);
  EXPECT_EQ(saved((*bank)[0]), stepped);
  options.tolerance = TypeParam(0);
  EXPECT_EQ(bank->configure(options), Status::invalid_argument);
  EXPECT_EQ(saved((*bank)[0]), stepped);
}

}  // namespace
