// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstring>
#include <ehsid/arx_estimator.hpp>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace {

using Estimator = ehsid::ArxEstimator<float, 3, 3, 1>;
using ehsid::Status;

/// Model (16) with equation noise of 1e-3; b can change.
class Servo {
 public:
  explicit Servo(unsigned seed) : random_(seed) {}

  double measure() {
    return 2.2390 * y_[0] - 1.7820 * y_[1] + 0.5427 * y_[2] + b[0] * u_[0] + b[1] * u_[1] +
           b[2] * u_[2] + 1e-3 * normal_(random_);
  }

  Status step(Estimator& estimator, double command) {
    const double y = measure();
    const Status status = estimator.step(static_cast<float>(command), static_cast<float>(y));
    for (int i = 2; i > 0; --i) {
      y_[i] = y_[i - 1];
      u_[i] = u_[i - 1];
    }
    y_[0] = y;
    u_[0] = command;
    return status;
  }

  double random_command() { return normal_(random_) > 0.0 ? 1.0 : -1.0; }

  double worst_error(const Estimator& estimator) const {
    const double truth[6] = {-2.2390, 1.7820, -0.5427, b[0], b[1], b[2]};
    const auto theta = estimator.theta_hat();
    double worst = 0.0;
    for (int i = 0; i < 6; ++i) {
      worst =
          std::max(worst, std::abs(static_cast<double>(theta[i]) - truth[i]) / std::abs(truth[i]));
    }
    return worst;
  }

  double b[3] = {0.3850, -0.5810, 0.2954};

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  double y_[3] = {};
  double u_[3] = {};
};

TEST(ArxEstimator, FillsBeforeItEstimatesAndAgainAfterAGap) {
  Estimator estimator;
  Servo servo(1);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(servo.step(estimator, 1.0), Status::filling);
  }
  EXPECT_EQ(servo.step(estimator, -1.0), Status::ok);
  const auto theta = estimator.theta_hat();
  EXPECT_EQ(estimator.step(std::numeric_limits<float>::quiet_NaN(), 0.0F), Status::invalid_input);
  EXPECT_EQ(estimator.theta_hat(), theta);
  EXPECT_EQ(estimator.step(1e9F, 0.0F), Status::out_of_range);
  EXPECT_EQ(estimator.theta_hat(), theta);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(servo.step(estimator, 1.0), Status::filling);
  }
  EXPECT_NE(servo.step(estimator, -1.0), Status::filling);
}

// The gates of the held input: the estimate rests while held, and returns after a change of 50 % in b
// within 20 samples with reset and 150 without.
class HeldInput : public testing::TestWithParam<bool> {};

TEST_P(HeldInput, RestsAndReturns) {
  const bool with_reset = GetParam();
  std::vector<int> returns;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Estimator estimator;
    Estimator::Options options;
    options.reset_enabled = with_reset;
    ASSERT_EQ(estimator.configure(options), Status::ok);
    Servo servo(seed);
    for (int k = 0; k < 2000; ++k) {
      static_cast<void>(servo.step(estimator, servo.random_command()));
    }
    EXPECT_TRUE(estimator.converged());
    for (int k = 0; k < 200; ++k) {
      static_cast<void>(servo.step(estimator, 0.0));  // the plant settles; still informative
    }
    const auto before = estimator.theta_hat();
    for (int k = 0; k < 20000; ++k) {
      static_cast<void>(servo.step(estimator, 0.0));
      ASSERT_LT((estimator.theta_hat() - before).norm(), 1e-3F * before.norm());
    }
    for (double& value : servo.b) {
      value *= 1.5;
    }
    int last_bad = 0;
    for (int k = 1; k <= 400; ++k) {
      static_cast<void>(servo.step(estimator, servo.random_command()));
      last_bad = servo.worst_error(estimator) > 0.01 ? k : last_bad;
    }
    EXPECT_LT(last_bad, 150) << "seed " << seed;
    returns.push_back(last_bad);
    EXPECT_EQ(estimator.change_detector().alarms(), with_reset ? 1 : 0);
  }
  // How soon six parameters stand within 1 % depends on the draw of twenty random commands, so the gate of
  // 20 samples is held by the median, not by every seed.
  std::sort(returns.begin(), returns.end());
  EXPECT_LT(returns[returns.size() / 2], with_reset ? 20 : 150);
}
INSTANTIATE_TEST_SUITE_P(WithAndWithoutReset, HeldInput, testing::Bool());

using Factors = ehsid::UdFactors<float, 6>;

/// A correlated P, the same for every test.
Factors known_factors() {
  Factors factors{};
  factors.d.fill(1e-2F);
  factors.u.fill(0.25F);
  return factors;
}

Estimator::Parameters known_theta() {
  Estimator::Parameters theta;
  theta << -2.239F, 1.782F, -0.5427F, 0.385F, -0.581F, 0.2954F;
  return theta;
}

TEST(ArxEstimator, SeedIsTheEstimateAtTheStart) {
  Estimator estimator;
  Servo servo(9);
  for (int k = 0; k < 100; ++k) {
    static_cast<void>(servo.step(estimator, servo.random_command()));
  }
  ASSERT_EQ(estimator.seed(known_theta(), known_factors(), 1e-6F), Status::ok);
  EXPECT_EQ(estimator.theta_hat(), known_theta());  // scales of one: no rounding
  EXPECT_EQ(estimator.recursion().P(), known_factors().matrix());
  EXPECT_NEAR(estimator.residual_variance(), 1e-6F, 1e-12F);
  EXPECT_FALSE(estimator.converged());
  EXPECT_EQ(estimator.monitor().samples(), 0);
  // The history before is another plant's.
  EXPECT_EQ(servo.step(estimator, 1.0), Status::filling);
}

TEST(ArxEstimator, SeedIsScaledAsTheSignalsAre) {
  Estimator estimator;
  Estimator::Options options;
  options.scaling = {8.0F, 0.25F, 1.0F, 0.5F};  // powers of two: exact
  ASSERT_EQ(estimator.configure(options), Status::ok);
  ASSERT_EQ(estimator.seed(known_theta(), known_factors(), 0.0625F), Status::ok);
  EXPECT_EQ(estimator.theta_hat(), known_theta());
  EXPECT_EQ(estimator.recursion().theta_hat()[3], known_theta()[3] * 32.0F);
  EXPECT_EQ(estimator.recursion().residual_variance(), 1.0F);
}

TEST(ArxEstimator, ResetAfterASeedGoesBackToTheVagueStart) {
  Estimator estimator;
  Estimator::Options options;
  options.variance0.setConstant(1e3F);
  ASSERT_EQ(estimator.configure(options), Status::ok);
  ASSERT_EQ(estimator.seed(known_theta(), known_factors(), 1e-6F), Status::ok);
  estimator.reset();
  EXPECT_EQ(estimator.theta_hat(), known_theta());
  const Estimator::Covariance vague = options.variance0.asDiagonal();
  EXPECT_EQ(estimator.recursion().P(), vague);
}

TEST(ArxEstimator, AWrongSeedIsResetAtOnceWhereTheNoiseIsKnown) {
  Estimator::Parameters wrong = known_theta();
  wrong.tail<3>() *= 0.5F;
  Factors certain = known_factors();
  certain.scale(0.01F);
  for (const bool known : {true, false}) {
    Estimator estimator;
    Servo servo(11);
    ASSERT_EQ(estimator.seed(wrong, certain, known ? 1e-6F : 0.0F), Status::ok);
    int first_reset = 0;
    for (int k = 1; k <= 60 && first_reset == 0; ++k) {
      first_reset = servo.step(estimator, servo.random_command()) == Status::reset ? k : 0;
    }
    // Errors of about 0.3 in noise of 0.001: at the second or third sample that is estimated.
    EXPECT_EQ(first_reset > 0 && first_reset < 10, known);
  }
}

TEST(ArxEstimator, BadSeedLeavesEveryBitAsItWas) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Estimator estimator;
  Servo servo(10);
  for (int k = 0; k < 100; ++k) {
    static_cast<void>(servo.step(estimator, servo.random_command()));
  }
  const auto before = estimator.save();
  auto refused = [&](const Estimator::Parameters& theta, const Factors& factors, float variance) {
    const Status status = estimator.seed(theta, factors, variance);
    const auto after = estimator.save();
    return status == Status::invalid_argument && std::memcmp(&before, &after, sizeof before) == 0;
  };
  for (int i = 0; i < 6; ++i) {
    const auto at = static_cast<std::size_t>(i);
    for (const float bad : {kNan, kInfinity, -kInfinity}) {
      auto theta = known_theta();
      theta[i] = bad;
      EXPECT_TRUE(refused(theta, known_factors(), 0.0F));
      auto factors = known_factors();
      factors.u[at] = bad;
      EXPECT_TRUE(refused(known_theta(), factors, 0.0F));
    }
    for (const float bad : {kNan, kInfinity, 0.0F, -1.0F}) {
      auto factors = known_factors();
      factors.d[at] = bad;
      EXPECT_TRUE(refused(known_theta(), factors, 0.0F));
    }
  }
  for (const float bad : {kNan, kInfinity, -1e-6F}) {
    EXPECT_TRUE(refused(known_theta(), known_factors(), bad));
  }
}

TEST(ArxEstimator, ResumesWithoutRefillingAfterDisable) {
  Estimator estimator;
  Servo servo(8);
  for (int k = 0; k < 300; ++k) {
    static_cast<void>(servo.step(estimator, servo.random_command()));
  }
  const auto theta = estimator.theta_hat();
  estimator.enable(false);
  for (int k = 0; k < 50; ++k) {
    EXPECT_EQ(servo.step(estimator, servo.random_command()), Status::disabled);
  }
  EXPECT_EQ(estimator.theta_hat(), theta);
  estimator.enable(true);
  EXPECT_EQ(servo.step(estimator, 1.0), Status::ok);
}

}  // namespace
