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
template <class Scalar>
using Known = ehsid::IntegratingArxEstimator<Scalar, 2, 3, 1, Policy<Scalar>, true>;

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
using Estimators = testing::Types<Riv<float>, Riv<double>, Known<float>, Known<double>>;
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
  ASSERT_EQ(
      recursion.start(Vector::Zero(), Vector::Constant(Scalar(1e6)), TypeParam().model().na()),
      Status::ok);
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
  using Whole = ehsid::Integrating<Model>;
  expect_the_same<Known<float>>(
      ehsid::OnlineEstimator<Whole, P, ehsid::InstrumentalVariables<float, kNa, kN, P>>(
          Whole(Model(2, 3, 1, true))));
}

/// A servo that integrates, with steps of a random command.
class Servo {
 public:
  Servo(double omega_n, double xi, double dt_s, int hold, double noise_m)
      : hold_(hold), noise_m_(noise_m) {
    EXPECT_EQ(ehsid::discretise<double>({kGain, omega_n, xi}, dt_s, theta_), Status::ok);
  }

  static constexpr double kGain = 0.379;
  static constexpr double kScale = 0.1;  // of the position, m

  /// The command at this sample and the position, of a sensor that reads `off` too much.
  template <class Estimator>
  Status step(Estimator& estimator, double off = 0.0) {
    if (count_++ % hold_ == 0) {
      command_ = 5.0 * uniform_(random_);
    }
    return feed(estimator, command_, off);
  }

  /// Hits an end stop with each half of a square wave.
  template <class Estimator>
  Status step_between_stops(Estimator& estimator) {
    command_ = count_++ / 400 % 2 == 0 ? 10.0 : -10.0;
    const Status status = feed(estimator, command_, 0.0);
    if (std::abs(y_[0]) > 3.0 * kScale) {
      y_.fill(std::copysign(3.0 * kScale, y_[0]));
    }
    return status;
  }

  /// Samples of no servo, over four decades.
  template <class Estimator>
  Status step_hostile(Estimator& estimator) {
    const auto number = [&] {
      return std::pow(10.0, 2.0 * uniform_(random_) + 1.9) * uniform_(random_);
    };
    const double command = 5.0 * number();
    return take(estimator, command, kScale * number());
  }

 private:
  template <class Estimator>
  Status feed(Estimator& estimator, double command, double off) {
    double y = 0.0;
    for (int i = 0; i < 3; ++i) {
      const auto at = static_cast<std::size_t>(i);
      y += theta_[i + 3] * u_[at] - theta_[i] * y_[at];
    }
    y_ = {y, y_[0], y_[1]};
    u_ = {command, u_[0], u_[1]};
    return take(estimator, command, y + noise_m_ * normal_(random_) + off);
  }

  template <class Estimator>
  static Status take(Estimator& estimator, double command, double position) {
    using Scalar = typename Estimator::Scalar;
    return estimator.step(static_cast<Scalar>(command), static_cast<Scalar>(position));
  }

  ehsid::Vector<double, 6> theta_;
  std::mt19937 random_{11};
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_{-1.0, 1.0};
  std::array<double, 3> y_{};
  std::array<double, 3> u_{};
  double command_ = 0.0;
  int hold_;
  double noise_m_;
  long count_ = 0;
};

template <class Scalar>
Known<Scalar> known() {
  Known<Scalar> estimator;
  auto options = options_of_the_test<Known<Scalar>>();
  options.scaling = {Scalar(5), static_cast<Scalar>(Servo::kScale)};
  EXPECT_EQ(estimator.configure(options), Status::ok);
  return estimator;
}

template <class Scalar>
double gain_of(const Known<Scalar>& estimator, double dt_s) {
  const ehsid::Vector<double, 5> theta =
      estimator.theta_hat().template head<5>().template cast<double>();
  const ehsid::SquareMatrix<double, 5> none = ehsid::SquareMatrix<double, 5>::Zero();
  return ehsid::identify_integrating_servo(theta, none, dt_s).gain;
}

struct Condition {
  double omega_n;
  double xi;
  double dt_s;
  int hold;
  double noise_m;
};

/// The first two locked up for ever where the integrator was not known.
class KnownIntegrator : public testing::TestWithParam<Condition> {
 protected:
  Servo servo_{GetParam().omega_n, GetParam().xi, GetParam().dt_s, GetParam().hold,
               GetParam().noise_m};
  Known<float> estimator_ = known<float>();

  void expect_gain_after(int samples) {
    for (int k = 0; k < samples; ++k) {
      static_cast<void>(servo_.step(estimator_));
    }
    EXPECT_NEAR(gain_of(estimator_, GetParam().dt_s), Servo::kGain, 0.05 * Servo::kGain);
  }

  /// Or says that it has no gain.
  void expect_gain_or_none_after(int samples) {
    for (int k = 0; k < samples; ++k) {
      static_cast<void>(servo_.step(estimator_));
    }
    if (estimator_.converged()) {
      expect_gain_after(0);
    }
  }
};
INSTANTIATE_TEST_SUITE_P(Servos, KnownIntegrator,
                         testing::Values(Condition{387.0, 0.195, 1e-3, 150, 0.0},
                                         Condition{387.0, 0.195, 1e-3, 150, 5e-6},
                                         Condition{80.0, 0.5, 5e-3, 4, 5e-6},
                                         Condition{40.0, 0.4, 2e-3, 50, 2e-6}));

TEST_P(KnownIntegrator, NeverLocksUp) {
  int taken = 0;
  for (int k = 0; k < 8000; ++k) {
    taken += servo_.step(estimator_) == Status::ok ? 1 : 0;
  }
  EXPECT_GT(taken, 7000);
  expect_gain_after(0);
}

TEST_P(KnownIntegrator, AGlitchIsRefusedAndForgotten) {
  for (const double off : {10.0, 100.0, 9999.0}) {
    expect_gain_after(1500);
    const auto before = estimator_.theta_hat();
    EXPECT_EQ(servo_.step(estimator_, off * Servo::kScale), Status::out_of_range);
    EXPECT_EQ(estimator_.theta_hat(), before);
    expect_gain_after(500);
  }
}

TEST_P(KnownIntegrator, ComesBackWithinTwoThousandGoodSamples) {
  expect_gain_after(1500);
  for (int k = 0; k < 10000; ++k) {
    static_cast<void>(servo_.step_hostile(estimator_));
  }
  expect_gain_after(2000);
  for (int k = 0; k < 10000; ++k) {
    static_cast<void>(servo_.step_between_stops(estimator_));
  }
  expect_gain_or_none_after(2000);
}

TEST_P(KnownIntegrator, LeastSquaresKnowTheGain) {
  ehsid::IntegratingRlsEstimator<float, 2, 3, 1, ehsid::FRatio<float>, true> squares;
  auto options = decltype(squares)::Options{};
  options.scaling = {5.0F, static_cast<float>(Servo::kScale)};
  ASSERT_EQ(squares.configure(options), Status::ok);
  for (int k = 0; k < 8000; ++k) {
    ASSERT_FALSE(ehsid::is_error(servo_.step(squares)));
  }
  const ehsid::Vector<double, 5> theta = squares.theta_hat().head<5>().cast<double>();
  const ehsid::SquareMatrix<double, 5> none = ehsid::SquareMatrix<double, 5>::Zero();
  const double gain = ehsid::identify_integrating_servo(theta, none, GetParam().dt_s).gain;
  EXPECT_NEAR(gain, Servo::kGain, 0.05 * Servo::kGain);
}

TEST_P(KnownIntegrator, PredictsPositions) {
  expect_gain_after(3000);
  const auto now = estimator_;
  Servo ahead = servo_;
  ehsid::Vector<float, 1> commands = ehsid::Vector<float, 1>::Zero();
  const float predicted = now.predict_ahead<1>(commands)[0];
  static_cast<void>(ahead.step(estimator_));
  // The command u(k+1) does not touch y(k+1): the error is that of the noise, some 8 times as large by the differences.
  const float seen = estimator_.model().state().position * float(Servo::kScale);
  EXPECT_NEAR(predicted, seen, 5e-6 + 40.0 * GetParam().noise_m);
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
