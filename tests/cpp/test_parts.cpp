// SPDX-License-Identifier: MIT
#include <Eigen/Dense>
#include <cmath>
#include <cstring>
#include <ehsid/ehsid.hpp>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace {

using ehsid::Status;

struct OnlyInformation : ehsid::NoParts {
  static constexpr bool kInformation = true;
};
struct OnlyCompensation : ehsid::NoParts {
  static constexpr bool kCompensation = true;
};
struct OnlyReset : ehsid::NoParts {
  static constexpr bool kStart = true;
  static constexpr bool kReset = true;
};
struct OnlyConvergence : ehsid::NoParts {
  static constexpr bool kConvergence = true;
};
struct OnlyWhiteness : ehsid::NoParts {
  static constexpr bool kConvergence = true;
  static constexpr bool kWhiteness = true;
};
struct Every : ehsid::AllParts {};

template <class Parts, class Scalar = float>
using Estimator = ehsid::SmallArxEstimator<Scalar, 3, 3, 1, ehsid::Constant<Scalar>, Parts>;

/// Model (16) of the paper with white equation noise, under a random binary command.
class Servo {
 public:
  explicit Servo(unsigned seed) : random_(seed) {}

  template <class Estimator>
  Status step(Estimator& estimator, double noise = 1e-3, double gain = 1.0) {
    const double y = 2.2390 * y_[0] - 1.7820 * y_[1] + 0.5427 * y_[2] +
                     gain * (0.3850 * u_[0] - 0.5810 * u_[1] + 0.2954 * u_[2]) +
                     noise * normal_(random_);
    const double u = normal_(random_) > 0.0 ? 1.0 : -1.0;
    for (int i = 2; i > 0; --i) {
      y_[i] = y_[i - 1];
      u_[i] = u_[i - 1];
    }
    y_[0] = y;
    u_[0] = u;
    using Scalar = typename Estimator::Scalar;
    return estimator.step(static_cast<Scalar>(u), static_cast<Scalar>(y));
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  double y_[3] = {};
  double u_[3] = {};
};

template <class Parts>
struct EachPart : testing::Test {};
using Selections = testing::Types<ehsid::NoParts, OnlyInformation, OnlyReset, OnlyWhiteness>;
TYPED_TEST_SUITE(EachPart, Selections, );

TYPED_TEST(EachPart, EstimatesTheServo) {
  // Deviations of theta in a memory of 100 samples, ten of them: from the noise and the inverse of the information.
  Estimator<TypeParam> estimator;
  Servo servo(1);
  for (int k = 0; k < 600; ++k) {
    static_cast<void>(servo.step(estimator));
  }
  const double truth[6] = {-2.2390, 1.7820, -0.5427, 0.3850, -0.5810, 0.2954};
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(estimator.theta_hat()[i], truth[i],
                10.0 * static_cast<double>(estimator.standard_deviation()[i]));
    EXPECT_LT(estimator.standard_deviation()[i], 0.05F);
  }
}

TYPED_TEST(EachPart, RefusesWhatCannotBeUsedAndStaysAsItWas) {
  Estimator<TypeParam> estimator;
  Servo servo(2);
  for (int k = 0; k < 100; ++k) {
    static_cast<void>(servo.step(estimator));
  }
  const auto theta = estimator.theta_hat();
  const auto factors = estimator.recursion().state().factors;
  const float bad[] = {std::numeric_limits<float>::quiet_NaN(),
                       std::numeric_limits<float>::infinity(), 1e30F};
  for (const float value : bad) {
    EXPECT_TRUE(ehsid::is_error(estimator.step(value, 0.0F)));
    EXPECT_TRUE(ehsid::is_error(estimator.step(0.0F, value)));
  }
  EXPECT_EQ(theta, estimator.theta_hat());
  EXPECT_EQ(0, std::memcmp(&factors, &estimator.recursion().state().factors, sizeof factors));
}

TYPED_TEST(EachPart, StaysUsableInALongHold) {
  Estimator<TypeParam> estimator;
  Servo servo(3);
  for (int k = 0; k < 200; ++k) {
    static_cast<void>(servo.step(estimator));
  }
  for (int k = 0; k < 100000; ++k) {
    static_cast<void>(estimator.step(0.5F, 0.25F));
  }
  EXPECT_TRUE(estimator.recursion().state().factors.usable());
  EXPECT_TRUE(ehsid::all_finite<6>(estimator.theta_hat()));
  // The ceiling: the mean of P_ii / P0_ii is at most 1. Rounding of six sums.
  EXPECT_LE(estimator.recursion().P().trace(), 6e6F * (1.0F + 6.0F * 1.2e-7F));
  // The jump from here to the servo at rest is an error that P forgets at 0.99 a sample: 1e-13 is left of it.
  Servo again(4);
  for (int k = 0; k < 3000; ++k) {
    static_cast<void>(again.step(estimator));
  }
  EXPECT_NEAR(estimator.theta_hat()[0], -2.2390F, 10.0F * estimator.standard_deviation()[0]);
}

TYPED_TEST(EachPart, ASnapshotGoesOnBitForBit) {
  Estimator<TypeParam> first;
  Servo servo(5);
  for (int k = 0; k < 150; ++k) {
    static_cast<void>(servo.step(first));
  }
  Estimator<TypeParam> second;
  ASSERT_EQ(second.restore(first.save()), Status::ok);
  Servo same = servo;
  for (int k = 0; k < 150; ++k) {
    EXPECT_EQ(servo.step(first), same.step(second));
  }
  EXPECT_EQ(first.save(), second.save());
}

TEST(Parts, ArithmeticIsThatOfTheWholeEstimator) {
  // Excited all the time, nothing waits; and with nothing to begin anew, only what is reported differs.
  ehsid::ArxEstimator<float, 3, 3, 1, ehsid::Constant<float>> whole;
  decltype(whole)::Options options;
  options.reset_enabled = false;
  ASSERT_EQ(whole.configure(options), Status::ok);
  Estimator<OnlyCompensation> small;
  Servo servo(6);
  Servo same = servo;
  for (int k = 0; k < 2000; ++k) {
    ASSERT_EQ(servo.step(whole), same.step(small));
    ASSERT_EQ(whole.theta_hat(), small.theta_hat()) << k;
    ASSERT_EQ(whole.standard_deviation(), small.standard_deviation()) << k;
  }
}

// An estimator that keeps what it is fed with.
struct Keeps {
  using Scalar = double;
  Estimator<ehsid::NoParts, double> whole;
  double u[4] = {};
  double y[4] = {};
  Status step(double command, double position) {
    for (int i = 3; i > 0; --i) {
      u[i] = u[i - 1];
      y[i] = y[i - 1];
    }
    u[0] = command;
    y[0] = position;
    return whole.step(command, position);
  }
};

TEST(Parts, WithoutThemItIsTheBatchSolution) {
  // Sum of lambda^(N-k) (y - phi' theta)^2 + lambda^N theta' P0^-1 theta, solved by Eigen in double.
  const double lambda = ehsid::Constant<double>{}.lambda;
  Servo servo(7);
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Identity() * 1e-6;
  Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
  Keeps estimator;
  for (int k = 0; k < 400; ++k) {
    if (servo.step(estimator) == Status::ok) {
      Eigen::Matrix<double, 6, 1> phi;
      phi << -estimator.y[1], -estimator.y[2], -estimator.y[3], estimator.u[1], estimator.u[2],
          estimator.u[3];
      information = lambda * information + phi * phi.transpose();
      right = lambda * right + phi * estimator.y[0];
    }
  }
  const Eigen::Matrix<double, 6, 1> batch = information.ldlt().solve(right);
  // Rounding times the condition of the information matrix, which is below 1e8 here.
  ASSERT_LT(information.norm() * information.inverse().norm(), 1e8);
  EXPECT_LT((batch - estimator.whole.theta_hat()).norm(), 1e8 * 2.3e-16 * batch.norm());
}

TEST(Parts, TheSmallestFits300Bytes) {
  EXPECT_LE(sizeof(Estimator<ehsid::NoParts>), 300U);
  EXPECT_LT(sizeof(Estimator<ehsid::NoParts>), sizeof(Estimator<Every>) / 2);
}

TEST(Parts, AChangeIsDetectedWithTheResetAlone) {
  Estimator<OnlyReset> estimator;
  Servo servo(8);
  for (int k = 0; k < 1000; ++k) {
    ASSERT_NE(servo.step(estimator), Status::reset);
  }
  bool reset = false;
  for (int k = 0; k < 100; ++k) {
    reset = servo.step(estimator, 1e-3, 1.5) == Status::reset || reset;
  }
  EXPECT_TRUE(reset);
  EXPECT_EQ(estimator.change_detector().alarms(), 1);
}

TEST(Parts, WithTheMonitorsAloneItSettlesAndConverges) {
  Estimator<OnlyConvergence> settles;
  Estimator<OnlyWhiteness> converges;
  Servo servo(9);
  Servo same = servo;
  for (int k = 0; k < 1000; ++k) {
    static_cast<void>(servo.step(settles));
    static_cast<void>(same.step(converges));
  }
  EXPECT_TRUE(settles.settled());
  EXPECT_TRUE(converges.converged());
}

TEST(Parts, InAHoldForgettingWaitsWhereTheAccountIsKept) {
  Estimator<ehsid::NoParts> winds_up;
  Estimator<OnlyInformation> waits;
  Servo servo(10);
  Servo same = servo;
  for (int k = 0; k < 300; ++k) {
    static_cast<void>(servo.step(winds_up));
    static_cast<void>(same.step(waits));
  }
  for (int k = 0; k < 5000; ++k) {
    static_cast<void>(winds_up.step(0.5F, 0.25F));
    static_cast<void>(waits.step(0.5F, 0.25F));
  }
  EXPECT_GT(winds_up.recursion().P().trace(), 1e3F * waits.recursion().P().trace());
}

TEST(Parts, ASnapshotOfAnotherCeilingIsRefused) {
  // Its start values are gone, but what they gave to the ceiling of P decides how it goes on.
  Estimator<ehsid::NoParts> first;
  Estimator<ehsid::NoParts> second;
  Estimator<ehsid::NoParts>::Options options;
  options.variance0[2] = 1e3F;
  ASSERT_EQ(second.configure(options), Status::ok);
  const auto saved = first.save();
  EXPECT_EQ(second.check(saved.data(), saved.size()), ehsid::SnapshotFault::other_configuration);
}

TEST(Parts, ASnapshotOfOtherPartsIsRefused) {
  Estimator<OnlyCompensation> first;
  Estimator<ehsid::NoParts> second;
  const auto saved = first.save();
  EXPECT_NE(second.check(saved.data(), saved.size()), ehsid::SnapshotFault::none);
}

}  // namespace
