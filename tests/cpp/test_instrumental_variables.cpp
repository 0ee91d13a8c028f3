// SPDX-License-Identifier: MIT
// The estimator for noise that biases least squares: static sizes against sizes chosen at run time, transactions, guards.
#include <array>
#include <cmath>
#include <cstring>
#include <ehsid/any_arx.hpp>
#include <ehsid/ehsid.hpp>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace {

using ehsid::Status;
template <class Scalar>
using Policy = ehsid::Exponential<Scalar>;
template <class Scalar>
using Riv = ehsid::InstrumentalArxEstimator<Scalar, 3, 3, 1>;

/// Model (16) from rest with white noise of the position sensor.
class NoisySensor {
 public:
  struct Sample {
    double command;
    double position;
  };

  Sample next(bool held = false) {
    double x = 2.2390 * x_[0] - 1.7820 * x_[1] + 0.5427 * x_[2];
    x += 0.3850 * u_[0] - 0.5810 * u_[1] + 0.2954 * u_[2];
    const double command = held ? 0.0 : normal_(random_) > 0.0 ? 1.0 : -1.0;
    x_ = {x, x_[0], x_[1]};
    u_ = {command, u_[0], u_[1]};
    return {command, x + 0.1 * normal_(random_)};
  }

 private:
  std::mt19937 random_{7};
  std::normal_distribution<double> normal_;
  std::array<double, 3> x_{};
  std::array<double, 3> u_{};
};

template <class Estimator>
void feed(Estimator& estimator, NoisySensor& servo, int samples, bool held = false) {
  using Scalar = typename Estimator::Scalar;
  for (int k = 0; k < samples; ++k) {
    const NoisySensor::Sample sample = servo.next(held);
    static_cast<void>(
        estimator.step(static_cast<Scalar>(sample.command), static_cast<Scalar>(sample.position)));
  }
}

template <class Estimator>
class InstrumentalVariables : public testing::Test {};
using Estimators = testing::Types<Riv<float>, Riv<double>>;
TYPED_TEST_SUITE(InstrumentalVariables, Estimators, );

template <class Estimator>
typename Estimator::Options options_of_the_test() {
  typename Estimator::Options options;
  options.forgetting.lambda0 = typename Estimator::Scalar(0.995);
  options.forgetting.lambda_initial = typename Estimator::Scalar(0.98);
  options.reset_enabled = false;
  return options;
}

TYPED_TEST(InstrumentalVariables, BadSamplesLeaveAllButTheHistoryBitForBit) {
  using Scalar = typename TypeParam::Scalar;
  TypeParam estimator;
  ASSERT_EQ(estimator.configure(options_of_the_test<TypeParam>()), Status::ok);
  NoisySensor servo;
  feed(estimator, servo, 900);
  const auto before = estimator.recursion().state().recursion;
  for (const Scalar bad :
       {std::numeric_limits<Scalar>::quiet_NaN(), std::numeric_limits<Scalar>::infinity(),
        -std::numeric_limits<Scalar>::infinity(), Scalar(1e30)}) {
    EXPECT_TRUE(is_error(estimator.step(bad, Scalar(0))));
    EXPECT_TRUE(is_error(estimator.step(Scalar(0), bad)));
    const auto after = estimator.recursion().state().recursion;
    EXPECT_EQ(std::memcmp(&before, &after, sizeof before), 0);
  }
}

TYPED_TEST(InstrumentalVariables, TheRecursionRefusesWhatIsNotFinite) {
  using Scalar = typename TypeParam::Scalar;
  using Recursion = typename TypeParam::Recursion;
  Recursion recursion;
  using Vector = typename Recursion::Parameters;
  ASSERT_EQ(recursion.start(Vector::Zero(), Vector::Constant(Scalar(1e6)), 3), Status::ok);
  ASSERT_EQ(recursion.update(Vector::Ones(), Scalar(1)), Status::ok);
  const Vector theta = recursion.theta_hat();
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  const Scalar huge = std::numeric_limits<Scalar>::max();
  EXPECT_EQ(recursion.update(Vector::Constant(nan), Scalar(1)), Status::invalid_input);
  EXPECT_EQ(recursion.update(Vector::Ones(), nan), Status::invalid_input);
  EXPECT_EQ(recursion.update(Vector::Constant(huge), Scalar(1)), Status::numerical_limit);
  EXPECT_EQ(recursion.update(Vector::Ones(), huge), Status::numerical_limit);
  EXPECT_EQ(theta, recursion.theta_hat());
}

TYPED_TEST(InstrumentalVariables, BehindAHoleTheFiltersRunInBeforeAnythingIsLearned) {
  using Scalar = typename TypeParam::Scalar;
  TypeParam estimator;
  ASSERT_EQ(estimator.configure(options_of_the_test<TypeParam>()), Status::ok);
  NoisySensor servo;
  feed(estimator, servo, 900);
  const auto theta = estimator.theta_hat();
  const auto deviation = estimator.standard_deviation();
  ASSERT_TRUE(is_error(estimator.step(std::numeric_limits<Scalar>::quiet_NaN(), Scalar(0))));
  for (int k = 0; k < 40; ++k) {
    static_cast<void>(servo.next());  // unseen: the position behind the hole is another one
  }
  feed(estimator, servo, 200);
  EXPECT_EQ(estimator.theta_hat(), theta);
  feed(estimator, servo, 100);
  EXPECT_NE(estimator.theta_hat(), theta);
  // 100 samples on top of 900 move the estimate by sqrt(1 - 900 / 1000) = 0.32 of its own deviation; five of those.
  EXPECT_LT(((estimator.theta_hat() - theta).array() / deviation.array()).abs().maxCoeff(),
            Scalar(1.6));
}

TYPED_TEST(InstrumentalVariables, SnapshotsAreRestoredAndCheckedForTheirMethod) {
  TypeParam estimator;
  TypeParam other;
  ASSERT_EQ(estimator.configure(options_of_the_test<TypeParam>()), Status::ok);
  ASSERT_EQ(other.configure(options_of_the_test<TypeParam>()), Status::ok);
  NoisySensor servo;
  feed(estimator, servo, 700);
  auto saved = estimator.save();
  ASSERT_EQ(other.restore(saved), Status::ok);
  NoisySensor again = servo;
  feed(estimator, servo, 300);
  feed(other, again, 300);
  EXPECT_EQ(estimator.save(), other.save());
  for (std::size_t byte = 0; byte < saved.size(); ++byte) {
    saved[byte] = static_cast<std::uint8_t>(saved[byte] ^ 0x10U);
    EXPECT_NE(other.check(saved.data(), saved.size()), ehsid::SnapshotFault::none);
    saved[byte] = static_cast<std::uint8_t>(saved[byte] ^ 0x10U);
  }
}

/// The same steps with sizes chosen at run time.
template <class Fixed, class Chosen>
void expect_the_same(Chosen chosen) {
  using Scalar = typename Fixed::Scalar;
  Fixed fixed;
  ASSERT_EQ(fixed.configure(options_of_the_test<Fixed>()), Status::ok);
  auto options = options_of_the_test<Chosen>();
  options.theta0.setZero(6);
  options.variance0.setConstant(6, Scalar(1e6));
  ASSERT_EQ(chosen.configure(options), Status::ok);
  NoisySensor servo;
  NoisySensor again;
  for (int block = 0; block < 40; ++block) {
    feed(fixed, servo, 50);
    feed(chosen, again, 50);
    const auto a = fixed.theta_hat();
    const auto b = chosen.theta_hat();
    for (int i = 0; i < 6; ++i) {
      ASSERT_EQ(a[i], b[i]) << "after " << 50 * (block + 1) << " samples";
    }
  }
}

TEST(InstrumentalVariablesOfAnySize, AreTheSameBitForBit) {
  constexpr int kNa = ehsid::up_to(6);
  constexpr int kN = ehsid::up_to(13);
  using Model = ehsid::AnyArx<float, kN>;
  const Model model(3, 3, 1, false);
  using P = Policy<float>;
  expect_the_same<Riv<float>>(
      ehsid::OnlineEstimator<Model, P, ehsid::InstrumentalVariables<float, kNa, kN, P>>(model));
}

TEST(Polynomial, StableWhereAllRootsAreInside) {
  using Array = ehsid::Array<double, 3>;
  // (1 - r q^-1) (1 - 2 s c q^-1 + s^2 q^-2)
  const auto made = [](double r, double s, double c) {
    return Array{-r - 2 * s * c, s * s + 2 * r * s * c, -r * s * s};
  };
  for (const double c : {-0.9, 0.0, 0.7}) {
    EXPECT_TRUE(ehsid::roots_inside_unit_circle<3>(3, made(0.9985, 0.737, c)));
    EXPECT_TRUE(ehsid::roots_inside_unit_circle<3>(3, made(-0.999, 0.999, c)));
    EXPECT_FALSE(ehsid::roots_inside_unit_circle<3>(3, made(1.0001, 0.737, c)));
    EXPECT_FALSE(ehsid::roots_inside_unit_circle<3>(3, made(0.5, 1.0001, c)));
  }
  EXPECT_FALSE(ehsid::roots_inside_unit_circle<3>(3, Array{std::nan(""), 0.0, 0.0}));
  const Array cubic = ehsid::repeated_pole<3>(3, 0.5);  // (1 - q^-1 / 2)^3
  EXPECT_EQ(cubic, (Array{-1.5, 0.75, -0.125}));
}

}  // namespace
