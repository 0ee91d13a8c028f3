// SPDX-License-Identifier: MIT
// One prediction and one update against an extended Kalman filter as textbooks write it: dense matrices, the Jacobian by
// differences of the matrix exponential, and Joseph's form of the update, which holds for any gain.
#include <ehsid/free_run.hpp>
#include <ehsid/servo_filter.hpp>

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>

namespace {

using Vector = Eigen::Matrix<double, 7, 1>;
using Matrix = Eigen::Matrix<double, 7, 7>;
using Filter = ehsid::ServoFilter<double>;
using Tuning = Filter::Tuning;

struct Textbook {
  Vector state;  // position, velocity, acceleration, ln k, ln h, ln xi, bias
  Matrix P;
  double noise;
  double disturbance;
};

Textbook copy_of(const Filter& filter) {
  Textbook made;
  const auto& s = filter.state();
  made.state << s.position, s.velocity, s.acceleration, std::log(s.gain), std::log(s.rate),
      std::log(s.damping), s.bias;
  for (int i = 0; i < 7; ++i) {
    for (int j = 0; j < 7; ++j) {
      made.P(i, j) = filter.covariance(i, j);
    }
  }
  made.noise = s.noise;
  made.disturbance = s.disturbance;
  return made;
}

/// x' = v, v' = a, a' = -2 xi h a - h^2 (v - r) over one period.
Eigen::Matrix4d period(double h, double xi) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
  m(0, 1) = 1.0;
  m(1, 2) = 1.0;
  m.row(2) << 0.0, -h * h, -2.0 * xi * h, h * h;
  return m.exp();
}

Vector moved(const Vector& s, double command) {
  Eigen::Vector4d motion(s[0], s[1], s[2], std::exp(s[3]) * (command - s[6]));
  motion = (period(std::exp(s[4]), std::exp(s[5])) * motion).eval();
  Vector next = s;
  next.head<3>() = motion.head<3>();
  return next;
}

void predict(Textbook& book, double command, const Tuning& tuning) {
  Matrix F;
  for (int j = 0; j < 7; ++j) {
    constexpr double kStep = 1e-3;
    const Vector step = kStep * Vector::Unit(j);
    const auto at = [&](double steps) { return moved(book.state + steps * step, command); };
    F.col(j) = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * kStep);
  }
  Vector g = Vector::Zero();
  g.head<3>() = period(std::exp(book.state[4]), std::exp(book.state[5])).col(3).head<3>();
  const double shifted = command - book.state[6];
  const double size = book.disturbance * std::exp(book.state[3]);
  const double q = size * size * 0.5 * (shifted * shifted + tuning.command);
  Vector drift = Vector::Zero();
  drift.tail<4>() << tuning.drift, tuning.drift, 4.0 * tuning.drift,
      0.1 * tuning.drift * tuning.command;
  book.state = moved(book.state, command);
  book.P = (F * book.P * F.transpose() + q * g * g.transpose()).eval();
  book.P.diagonal() += drift;
}

/// counted: the innovation as it counts.
void update(Textbook& book, double counted, bool hold) {
  const double variance = book.P(0, 0) + book.noise;
  Vector K = book.P.col(0) / variance;
  if (hold) {
    K[4] = 0.0;
    K[5] = 0.0;
  }
  book.state += K * counted;
  Matrix rest = Matrix::Identity();
  rest.col(0) -= K;
  book.P = (rest * book.P * rest.transpose() + book.noise * K * K.transpose()).eval();
}

/// Differences in units of the deviations of P.
void expect_same(const Filter& filter, const Textbook& book, double tolerance) {
  const Textbook found = copy_of(filter);
  const Vector deviation = book.P.diagonal().cwiseSqrt();
  for (int i = 0; i < 7; ++i) {
    EXPECT_NEAR(found.state[i], book.state[i], tolerance * deviation[i]) << "state " << i;
    for (int j = 0; j < 7; ++j) {
      EXPECT_NEAR(found.P(i, j), book.P(i, j), tolerance * deviation[i] * deviation[j])
          << "P of " << i << ", " << j;
    }
  }
}

/// A filter in the midst of its work, with full covariances.
Filter some_filter(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Filter filter;
  filter.start(2e-4, std::exp(-1.5 + 0.7 * normal(random)), std::exp(-1.0 + 0.4 * normal(random)),
               {0.3, 0.2, 0.4, 0.2}, 4.0, 1e-10);
  auto& s = filter.state();
  s.position = 1e-3 * normal(random);
  s.velocity = 4e-4 * normal(random);
  s.acceleration = 1e-4 * normal(random);
  s.bias = 0.1 * normal(random);
  const Matrix mixed = Matrix::NullaryExpr([&] { return normal(random); });
  const Matrix full = mixed * mixed.transpose() / 7.0 + 0.2 * Matrix::Identity();
  Vector size;
  size << 2e-5, 1e-5, 4e-6, 0.03, 0.05, 0.1, 0.05;
  for (int i = 0; i < 7; ++i) {
    for (int j = i; j < 7; ++j) {
      filter.covariance(i, j) = full(i, j) * size[i] * size[j];
    }
  }
  filter.renew();
  return filter;
}

constexpr Tuning kTuning{4e-6, 4.0, 1e-14, 0.0, false};

class AnyFilter : public testing::TestWithParam<std::uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Seeds, AnyFilter, testing::Range(1U, 13U));

TEST_P(AnyFilter, PredictsAsTheTextbook) {
  Filter filter = some_filter(GetParam());
  Textbook book = copy_of(filter);
  for (const double command : {3.0, -2.0, 0.0, 5.0}) {
    filter.predict(command, kTuning);
    predict(book, command, kTuning);
  }
  expect_same(filter, book, 1e-8);  // of the differences
}

TEST_P(AnyFilter, UpdatesAsTheTextbook) {
  for (const bool hold : {false, true}) {
    for (const double deviations : {0.3, -2.0, 3.9}) {
      Filter filter = some_filter(GetParam());
      Textbook book = copy_of(filter);
      const double innovation =
          deviations * std::sqrt(filter.covariance(0, 0) + filter.state().noise);
      Tuning tuning = kTuning;
      tuning.hold_servo = hold;
      const Filter before = filter;
      filter.update(filter.state().position + innovation, tuning);
      update(book, innovation, hold);
      expect_same(filter, book, 1e-11);
      if (hold) {
        EXPECT_EQ(filter.state().rate, before.state().rate);
        EXPECT_EQ(filter.state().damping, before.state().damping);
        EXPECT_EQ(filter.covariance(4, 4), before.covariance(4, 4));
        EXPECT_EQ(filter.covariance(4, 5), before.covariance(4, 5));
        EXPECT_EQ(filter.covariance(5, 5), before.covariance(5, 5));
      }
    }
  }
}

TEST(ServoFilter, AnOutlierCountsUpToFourDeviationsUntilTheFourthInARow) {
  Filter filter = some_filter(3);
  for (int i = 1; i <= 4; ++i) {
    Textbook book = copy_of(filter);
    const double deviation = std::sqrt(filter.covariance(0, 0) + filter.state().noise);
    filter.update(filter.state().position + 7.0 * deviation, kTuning);
    update(book, (i < 4 ? 4.0 : 7.0) * deviation, false);
    EXPECT_NEAR(filter.state().position, book.state[0], 1e-12);
    EXPECT_EQ(filter.state().outliers, i);
  }
  filter.update(filter.state().position, kTuning);
  EXPECT_EQ(filter.state().outliers, 0);
}

/// A servo of its own kind: the textbook's equation without a filter.
template <class Scalar>
class WholeRun : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(WholeRun, Scalars, );

TYPED_TEST(WholeRun, FindsTheServoAndKeepsPPositive) {
  using Scalar = TypeParam;
  constexpr double kGain = 3e-4;
  constexpr double kRate = 0.25;
  constexpr double kDamping = 0.3;
  constexpr double kBias = 0.15;
  constexpr double kNoise = 5e-6;
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  ehsid::ServoFilter<Scalar> filter;
  filter.start(Scalar(1.5e-4), Scalar(0.35), Scalar(0.4),
               {Scalar(1), Scalar(0.35), Scalar(0.55), Scalar(0.4)}, Scalar(4), Scalar(1e-10));
  const typename ehsid::ServoFilter<Scalar>::Tuning tuning{Scalar(4e-6), Scalar(4), Scalar(1e-14),
                                                           Scalar(0.01), false};
  Vector servo;
  servo << 0.0, 0.0, 0.0, std::log(kGain), std::log(kRate), std::log(kDamping), kBias;
  double command = 2.0;
  double least = 1.0;
  for (int k = 0; k < 4000; ++k) {
    filter.update(static_cast<Scalar>(servo[0] + kNoise * normal(random)), tuning);
    ASSERT_TRUE(filter.finite());
    filter.renew();
    command = k % 40 == 0 ? 2.0 * normal(random) : command;
    filter.predict(static_cast<Scalar>(command), tuning);
    servo = moved(servo, command);
    Matrix correlation;
    for (int i = 0; i < 7; ++i) {
      for (int j = 0; j < 7; ++j) {
        const auto square = static_cast<double>(filter.covariance(i, i)) *
                            static_cast<double>(filter.covariance(j, j));
        ASSERT_GT(square, 0.0);
        correlation(i, j) = static_cast<double>(filter.covariance(i, j)) / std::sqrt(square);
      }
    }
    if (k % 10 == 0) {
      least =
          std::min(least, Eigen::SelfAdjointEigenSolver<Matrix>(correlation, Eigen::EigenvaluesOnly)
                              .eigenvalues()
                              .minCoeff());
    }
  }
  // Seven rows, each rounded some times a sample.
  EXPECT_GT(least, -50.0 * static_cast<double>(std::numeric_limits<Scalar>::epsilon()));
  EXPECT_NEAR(filter.state().gain / Scalar(kGain), 1.0, 0.01);
  EXPECT_NEAR(filter.state().rate / Scalar(kRate), 1.0, 0.02);
  EXPECT_NEAR(filter.state().damping, kDamping, 0.02);
  EXPECT_NEAR(filter.state().bias, kBias, 0.02);
  EXPECT_NEAR(std::sqrt(filter.state().noise) / Scalar(kNoise), 1.0, 0.2);
  EXPECT_LT(filter.state().disturbance, Scalar(0.01));
}

/// What acts in front of the servo is told from the noise of its sensor: alpha is found, and K does not mind. Of a larger
/// disturbance, 0.3, alpha comes out a third too large, as the noise can hardly be seen beside it.
TEST(ServoFilter, InnovationsTellADisturbanceFromTheNoiseOfTheSensor) {
  for (const double share : {0.0, 0.1}) {
    std::mt19937 random{6};
    std::normal_distribution<double> normal;
    ehsid::ServoFilter<double> filter;
    ehsid::ServoFilter<double>::Tuning tuning{1e-7, 4.0, 1e-12, 0.005, false};
    constexpr double kGain = 0.8;
    constexpr double kNoise = 0.01;
    filter.start(0.6, 0.5, 0.5, {0.3, 0.2, 0.3, 0.1}, 4.0, 1e-3);
    const auto t = ehsid::servo_transition(0.6, 0.4);
    double x = 0.0;
    double v = 0.0;
    double a = 0.0;
    double alpha = 0.0;
    constexpr int kSamples = 20000;
    for (int k = 0; k < kSamples; ++k) {
      const double u = k / 15 % 2 == 0 ? 2.0 : -2.0;
      const double error = v - kGain * u * (1.0 + share * normal(random));
      x += v - t.s.value * error + t.i.value * a;
      const double faster = v + t.e.value * a - t.w.value * error;
      a = t.decay.value * a - t.pull.value * error;
      v = faster;
      filter.renew();
      filter.predict(u, tuning);
      filter.update(x + kNoise * normal(random), tuning);
      alpha += k >= kSamples / 2 ? filter.state().disturbance * 2.0 / kSamples : 0.0;
    }
    // The adaptation of 0.005 leaves a scatter; its mean is within a fifth.
    EXPECT_NEAR(alpha, share, 0.2 * share + 0.02) << share;
    EXPECT_NEAR(filter.state().gain / kGain, 1.0, 0.03) << share;
    EXPECT_NEAR(std::sqrt(filter.state().noise) / kNoise, 1.0, 0.25) << share;
  }
}

/// A filter that was told nonsense may take its noise for larger by many powers of ten, and then it learns nothing. R comes
/// down in time: 41 nats at 0.7 * 0.005 each sample would take 12,000 samples.
TEST(ServoFilter, ANoiseThatIsFarTooLargeFallsInTwoThousandSamples) {
  std::mt19937 random{7};
  std::normal_distribution<double> normal;
  ehsid::ServoFilter<double> filter;
  const ehsid::ServoFilter<double>::Tuning tuning{1e-7, 4.0, 1e-12, 0.005, false};
  constexpr double kGain = 0.8;
  constexpr double kNoise = 1e-3;
  filter.start(0.6, 0.5, 0.5, {0.3, 0.2, 0.3, 0.1}, 4.0, 1e12);
  const auto t = ehsid::servo_transition(0.6, 0.4);
  double x = 0.0;
  double v = 0.0;
  double a = 0.0;
  for (int k = 0; k < 2000; ++k) {
    const double u = k / 15 % 2 == 0 ? 2.0 : -2.0;
    const double error = v - kGain * u;
    x += v - t.s.value * error + t.i.value * a;
    const double faster = v + t.e.value * a - t.w.value * error;
    a = t.decay.value * a - t.pull.value * error;
    v = faster;
    filter.renew();
    filter.predict(u, tuning);
    filter.update(x + kNoise * normal(random), tuning);
  }
  EXPECT_LT(filter.state().noise, 1e3 * kNoise * kNoise);
}

/// A loop that repeats its reference moves as a servo without damping that swings by itself, K = 0: however well such a
/// model explains the motion, it is lost. A servo with little damping and no disturbance is none of these.
TEST(FreeRun, AModelThatSwingsByItselfIsLost) {
  for (const bool swings : {true, false}) {
    ehsid::ServoFilterState<double> state{};
    state.rate = 0.5;
    state.gain = 1e-9;
    state.damping = 0.01;
    state.disturbance = swings ? 1.0 : 0.1;
    state.velocity = 1.0;
    ehsid::ServoFilter<double> filter;
    filter.start(state.gain, state.rate, state.damping, {0.1, 0.1, 0.1, 0.1}, 1.0, 1e-6);
    ehsid::FreeRun<double> run;
    double position = 0.0;
    for (int closed = 0, k = 0; closed < 3 && k < 1000; ++k) {
      closed += run.take(state, position, 1000) ? 1 : 0;
      run.predict(filter, 0.0);
      // The measured position is that of the model.
      const double angle = state.rate * (k + 1);
      position = std::sin(angle) / state.rate;
      state.velocity = std::cos(angle);
      state.acceleration = -state.rate * std::sin(angle);
      state.position = 0.0;
    }
    EXPECT_GT(run.share(), 0.6);
    EXPECT_EQ(run.failures() >= 12, swings);
  }
}

}  // namespace
