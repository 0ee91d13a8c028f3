// SPDX-License-Identifier: MIT
#include <ehsid/servo_model.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <random>
#include <string>

namespace {

using ehsid::ContinuousServo;
using ehsid::identify_servo;
using ehsid::ServoReading;
using ehsid::ServoReadingStatus;
using ehsid::SquareMatrix;
using ehsid::Status;
using ehsid::Vector;

template <class Scalar>
constexpr Scalar kEps = std::numeric_limits<Scalar>::epsilon();

constexpr double kDt = 0.05;

template <class Scalar>
Vector<Scalar, 6> sampled(Scalar gain, Scalar omega_n, Scalar xi, Scalar dt_s) {
  Vector<Scalar, 6> theta = Vector<Scalar, 6>::Constant(Scalar(-1));
  const ContinuousServo<Scalar> servo{gain, omega_n, xi};
  EXPECT_EQ(ehsid::discretise(servo, dt_s, theta), Status::ok);
  return theta;
}

/// (z - p)(z^2 + q1 z + q2) multiplied out, numerator `b` for all three.
Vector<double, 6> theta_of(double p, double q1, double q2, double b = 0.1) {
  Vector<double, 6> theta;
  theta << q1 - p, q2 - p * q1, -p * q2, b, b, b;
  return theta;
}

Vector<double, 6> theta_of_angle(double p, double radius, double angle) {
  return theta_of(p, -2.0 * radius * std::cos(angle), radius * radius);
}

template <class Scalar>
SquareMatrix<Scalar, 6> no_covariance() {
  return SquareMatrix<Scalar, 6>::Zero();
}

ServoReadingStatus status_of(const Vector<double, 6>& theta, double variance = 0.0) {
  return identify_servo<double>(theta, variance * SquareMatrix<double, 6>::Identity(), kDt).status;
}

double gain_of(const Vector<double, 6>& theta) {
  return identify_servo<double>(theta, SquareMatrix<double, 6>::Zero(), kDt).gain;
}

template <class Scalar>
class ServoModel : public testing::Test {};
using Scalars = testing::Types<float, double>;
struct ScalarName {
  template <class Scalar>
  static std::string GetName(int) {
    return sizeof(Scalar) == sizeof(float) ? "float" : "double";
  }
};
TYPED_TEST_SUITE(ServoModel, Scalars, ScalarName);

TYPED_TEST(ServoModel, PhysicalParametersGiveEquation5) {
  using Scalar = TypeParam;
  // Chosen for round results: 4 beta_e / V_t = 4e12, so omega_n = 3e-3 sqrt(4e12 / 360) =
  // sqrt(1e5), xi = sqrt(4e12 * 360) * 5e-12 / 6e-3 = 0.03162..., K = 0.5 * 2e-4 / 3e-3.
  const ehsid::ServoParameters<Scalar> p{Scalar(2e-4), Scalar(0.5),  Scalar(4e-12), Scalar(1e-12),
                                         Scalar(3e-3), Scalar(1e-3), Scalar(1e9),   Scalar(360)};
  ContinuousServo<Scalar> servo{};
  ASSERT_EQ(ehsid::continuous_servo(p, servo), Status::ok);
  const Scalar tolerance = Scalar(8) * kEps<Scalar>;  // at most eight roundings each
  EXPECT_NEAR(servo.gain / Scalar(0.1 / 3.0), Scalar(1), tolerance);
  EXPECT_NEAR(servo.omega_n / Scalar(316.22776601683793), Scalar(1), tolerance);
  EXPECT_NEAR(servo.xi / Scalar(0.031622776601683793), Scalar(1), tolerance);
  // The other form of xi in the source: sqrt(beta_e M_t / V_t) (K_c + C_p) / A_p
  const Scalar other = std::sqrt(p.beta_e * p.m_t / p.v_t) * (p.k_c + p.c_p) / p.a_p;
  EXPECT_NEAR(servo.xi / other, Scalar(1), tolerance);
}

TYPED_TEST(ServoModel, PhysicalParametersOutsideTheirRangeAreRefused) {
  using Scalar = TypeParam;
  using Parameters = ehsid::ServoParameters<Scalar>;
  const Parameters good{Scalar(2e-4), Scalar(0.5),  Scalar(4e-12), Scalar(1e-12),
                        Scalar(3e-3), Scalar(1e-3), Scalar(1e9),   Scalar(360)};
  Scalar Parameters::* const all[] = {&Parameters::k_v, &Parameters::k_q,   &Parameters::k_c,
                                      &Parameters::c_p, &Parameters::a_p,   &Parameters::v_t,
                                      &Parameters::m_t, &Parameters::beta_e};
  for (const auto member : all) {
    for (const Scalar bad : {Scalar(-1), std::numeric_limits<Scalar>::infinity(),
                             std::numeric_limits<Scalar>::quiet_NaN()}) {
      Parameters p = good;
      p.*member = bad;
      ContinuousServo<Scalar> servo{Scalar(1), Scalar(2), Scalar(3)};
      EXPECT_EQ(ehsid::continuous_servo(p, servo), Status::invalid_argument);
      EXPECT_EQ(servo.omega_n, Scalar(2));  // kept as it was
    }
  }
  Parameters lossless = good;
  lossless.k_c = Scalar(0);
  lossless.c_p = Scalar(0);
  ContinuousServo<Scalar> servo{};
  EXPECT_EQ(ehsid::continuous_servo(lossless, servo), Status::ok);
  EXPECT_EQ(servo.xi, Scalar(0));
  Parameters tiny_mass = good;
  tiny_mass.m_t = std::numeric_limits<Scalar>::min();
  tiny_mass.beta_e = std::numeric_limits<Scalar>::max() / Scalar(8);
  EXPECT_EQ(ehsid::continuous_servo(tiny_mass, servo), Status::numerical_limit);
}

TYPED_TEST(ServoModel, DiscretiseRefusesAndKeepsTheta) {
  using Scalar = TypeParam;
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  struct Case {
    Scalar gain, omega_n, xi, dt_s;
    Status expected;
  };
  const Case cases[] = {
      {nan, 1, 1, 1, Status::invalid_input},
      {1, nan, 1, 1, Status::invalid_input},
      {1, 1, nan, 1, Status::invalid_input},
      {1, 1, 1, nan, Status::invalid_input},
      {1, 0, 1, 1, Status::invalid_argument},
      {1, -1, 1, 1, Status::invalid_argument},
      {1, 1, Scalar(-0.01), 1, Status::invalid_argument},
      {1, 1, 1, 0, Status::invalid_argument},
      {1, 1, 1, -1, Status::invalid_argument},
      {1, Scalar(0.9e-6), 1, 1, Status::out_of_range},
      {1, 1025, Scalar(0.1), 1, Status::out_of_range},
      {1, 1, 513, 1, Status::out_of_range},
      {std::numeric_limits<Scalar>::max(), 2, 1, 4, Status::numerical_limit},
  };
  for (const Case& c : cases) {
    Vector<Scalar, 6> theta = Vector<Scalar, 6>::Constant(Scalar(7));
    EXPECT_EQ(ehsid::discretise(ContinuousServo<Scalar>{c.gain, c.omega_n, c.xi}, c.dt_s, theta),
              c.expected);
    EXPECT_TRUE((theta.array() == Scalar(7)).all());
  }
  // The limits themselves are served, with finite numbers.
  static_cast<void>(sampled(Scalar(1), Scalar(1024), Scalar(0.5), Scalar(1)));
  static_cast<void>(sampled(Scalar(1), Scalar(1), Scalar(512), Scalar(1)));
}

TEST(ServoModelPrecision, FloatFollowsDouble) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> log_x(std::log(2e-6), std::log(3.0));
  std::uniform_real_distribution<double> log_xi(std::log(0.01), std::log(3.0));
  for (int i = 0; i < 500; ++i) {
    const auto x = static_cast<float>(std::exp(log_x(random)));
    const auto xi = i % 10 == 0 ? 0.0F : static_cast<float>(std::exp(log_xi(random)));
    const auto single = sampled(1.0F, x, xi, 1.0F);
    const auto twice = sampled(1.0, static_cast<double>(x), static_cast<double>(xi), 1.0);
    const double v = 2.0 * static_cast<double>(x * xi);
    for (int j = 0; j < 6; ++j) {
      // a: absolute, Q(1) up to 4 after up to seven doublings. b: relative; exp(-v) alone is
      // conditioned with v = 2 xi x, and up to seven doublings add some four roundings each.
      const double scale = j < 3 ? 16.0 : (32.0 + v) * twice[j];
      EXPECT_NEAR(static_cast<double>(single[j]), twice[j],
                  scale * static_cast<double>(kEps<float>));
    }
  }
}

TEST(ServoModelSensitivities, AgreeWithCentralDifferences) {
  // Central differences with relative step h are good to h^2 plus rounding / h: 1e-8 for h = 1e-5.
  const double h = 1e-5;
  for (const double v : {0.02, 0.5, 3.0, 15.0}) {
    for (const double y : {0.01, 0.5, 2.0, 8.0}) {
      const auto at = ehsid::sample_servo(v, y);
      const auto v_up = ehsid::sample_servo(v * (1 + h), y);
      const auto v_down = ehsid::sample_servo(v * (1 - h), y);
      const auto y_up = ehsid::sample_servo(v, y * (1 + h));
      const auto y_down = ehsid::sample_servo(v, y * (1 - h));
      const auto check = [&](const auto member) {
        const double by_v = ((v_up.*member).value - (v_down.*member).value) / (2 * h * v);
        const double by_y = ((y_up.*member).value - (y_down.*member).value) / (2 * h * y);
        const double scale = (at.*member).value;
        EXPECT_NEAR((at.*member).by_v, by_v, 1e-8 * (std::abs(by_v) + scale / v));
        EXPECT_NEAR((at.*member).by_y, by_y, 1e-8 * (std::abs(by_y) + scale / y));
      };
      check(&ehsid::SampledServo<double>::q_at_one);
      check(&ehsid::SampledServo<double>::q2);
      check(&ehsid::SampledServo<double>::b1);
      check(&ehsid::SampledServo<double>::b3);
    }
  }
}

TYPED_TEST(ServoModel, LogarithmAndAngleMatchTheLibrary) {
  using Scalar = TypeParam;
  for (double exponent = -80.0; exponent < 3.0; exponent += 0.37) {
    const auto z = static_cast<Scalar>(std::exp(exponent));
    const double exact = std::log(static_cast<double>(z));
    EXPECT_NEAR(static_cast<double>(ehsid::real_logarithm(z)) / exact, 1.0,
                16.0 * static_cast<double>(kEps<Scalar>));
  }
  for (double size = 1e-12; size < 0.5; size *= 3.0) {
    for (const double u : {size, -size}) {
      const Scalar z = Scalar(1) + static_cast<Scalar>(u);
      const double exact = std::log(static_cast<double>(z));
      EXPECT_NEAR(static_cast<double>(ehsid::real_logarithm(z)), exact,
                  16.0 * static_cast<double>(kEps<Scalar>) * std::abs(exact));
    }
  }
  for (double angle = 1e-6; angle < 3.1415; angle += 0.0137) {
    const auto re = static_cast<Scalar>(0.7 * std::cos(angle));
    const auto im = static_cast<Scalar>(0.7 * std::sin(angle));
    const double exact = std::atan2(static_cast<double>(im), static_cast<double>(re));
    EXPECT_NEAR(static_cast<double>(ehsid::upper_angle(re, im)) / exact, 1.0,
                8.0 * static_cast<double>(kEps<Scalar>));
  }
}

/// Error against the model's own statement: its deviation without covariance is the rounding of
/// theta (one unit each, where half a unit is the worst), so four deviations hold six roundings
/// added up and those of the forward model. Where theta is well conditioned the arithmetic itself
/// remains: up to 32 units times 1 + v, the condition of the exponential and its logarithm.
template <class Scalar>
void expect_round_trip(Scalar gain, Scalar omega_n, Scalar xi, Scalar dt_s) {
  const auto reading =
      identify_servo<Scalar>(sampled(gain, omega_n, xi, dt_s), no_covariance<Scalar>(), dt_s);
  ASSERT_EQ(reading.status, ServoReadingStatus::ok)
      << "omega_n dt " << omega_n * dt_s << " xi " << xi;
  const Scalar own = Scalar(32) * kEps<Scalar> * (Scalar(1) + Scalar(2) * xi * omega_n * dt_s);
  EXPECT_LE(std::abs(reading.gain - gain), Scalar(4) * reading.gain_std + own * gain);
  EXPECT_LE(std::abs(reading.omega_n - omega_n), Scalar(4) * reading.omega_n_std + own * omega_n);
  EXPECT_LE(std::abs(reading.xi - xi), Scalar(4) * reading.xi_std + own * (Scalar(1) + xi));
  EXPECT_LE(reading.integrator_distance, Scalar(4) * reading.integrator_pole_std + own);
}

TYPED_TEST(ServoModel, RoundTripOverTheGrid) {
  using Scalar = TypeParam;
  std::mt19937 random(3);
  // float: rounding of theta moves poles that lie omega_n dt apart by about eps / (omega_n dt)^2.
  const double least_x = sizeof(Scalar) == sizeof(float) ? 0.1 : 1e-3;
  std::uniform_real_distribution<double> log_x(std::log(least_x), std::log(3.0));
  std::uniform_real_distribution<double> log_xi(std::log(0.01), std::log(3.0));
  std::uniform_real_distribution<double> log_dt(std::log(1e-4), std::log(0.1));
  for (int i = 0; i < 2000; ++i) {
    const double dt = std::exp(log_dt(random));
    const double omega_n = std::exp(log_x(random)) / dt;
    const double xi = i % 10 == 0 ? 1.0 : std::exp(log_xi(random));
    expect_round_trip(Scalar(0.02), Scalar(omega_n), Scalar(xi), Scalar(dt));
  }
}

TEST(ServoModelPrecision, FloatSaysWhenItsRoundingHidesThePoles) {
  // At omega_n dt = 1e-3 the poles of a float theta scatter by eps^(1/3) = 5e-3: nothing can be
  // read.
  const auto theta = sampled(1.0F, 0.02F, 0.5F, 0.05F);
  const auto reading = identify_servo<float>(theta, no_covariance<float>(), 0.05F);
  EXPECT_NE(reading.status, ServoReadingStatus::ok);
  EXPECT_TRUE(std::isnan(reading.omega_n));
}

TEST(ServoModelReading, DeltaMethodAgreesWithFiniteDifferences) {
  for (const double x : {0.3, 0.8, 2.0}) {
    for (const double xi : {0.05, 0.6, 1.0, 1.8}) {
      const auto theta = sampled(0.5, x / kDt, xi, kDt);
      for (int i = 0; i < 6; ++i) {
        // Half steps extrapolated (Richardson): error of the order h^4, rounding 1e-14 / h = 1e-10.
        const auto difference = [&](double h) {
          Vector<double, 6> up = theta;
          Vector<double, 6> down = theta;
          up[i] += h;
          down[i] -= h;
          const auto a =
              identify_servo<double>(up, 1e-3 * h * SquareMatrix<double, 6>::Identity(), kDt);
          const auto b =
              identify_servo<double>(down, 1e-3 * h * SquareMatrix<double, 6>::Identity(), kDt);
          EXPECT_EQ(a.status, ServoReadingStatus::ok);
          EXPECT_EQ(b.status, ServoReadingStatus::ok);
          return Vector<double, 4>(Vector<double, 4>(a.gain - b.gain, a.omega_n - b.omega_n,
                                                     a.xi - b.xi,
                                                     a.integrator_pole - b.integrator_pole) /
                                   (2 * h));
        };
        const double h = 1e-5 * x * x;
        const Vector<double, 4> slope = (4.0 * difference(h / 2) - difference(h)) / 3.0;
        // Unit covariance of one parameter, scaled by 1e-12: the outer product of its column of J.
        SquareMatrix<double, 6> covariance = no_covariance<double>();
        covariance(i, i) = 1e-12;
        const auto reading = identify_servo<double>(theta, covariance, kDt);
        ASSERT_EQ(reading.status, ServoReadingStatus::ok);
        const Vector<double, 3> deviation(reading.gain_std, reading.omega_n_std, reading.xi_std);
        // Scale: what a unit of any parameter can move, so that zero entries have a tolerance.
        const Vector<double, 3> scale(0.5 / (x * x), 1.0 / (kDt * x * x), 1.0 / (x * x));
        for (int j = 0; j < 3; ++j) {
          EXPECT_NEAR(deviation[j] * 1e6, std::abs(slope[j]),
                      1e-6 * (std::abs(slope[j]) + scale[j]));
          for (int k = 0; k < 3; ++k) {
            EXPECT_NEAR(reading.covariance(j, k) * 1e12, slope[j] * slope[k],
                        4e-6 * (std::abs(slope[j]) + scale[j]) * (std::abs(slope[k]) + scale[k]));
          }
        }
        EXPECT_NEAR(reading.integrator_pole_std * 1e6, std::abs(slope[3]),
                    1e-6 * (std::abs(slope[3]) + 1.0));
      }
    }
  }
}

TEST(ServoModelReading, SamplingPeriodOnlyScalesTime) {
  const auto theta = sampled(0.5, 20.0, 0.4, kDt);
  const SquareMatrix<double, 6> covariance = 1e-10 * SquareMatrix<double, 6>::Identity();
  const auto slow = identify_servo<double>(theta, covariance, kDt);
  const auto fast = identify_servo<double>(theta, covariance, kDt / 4.0);  // exact in binary
  ASSERT_EQ(fast.status, ServoReadingStatus::ok);
  EXPECT_DOUBLE_EQ(fast.gain, 4.0 * slow.gain);
  EXPECT_DOUBLE_EQ(fast.omega_n, 4.0 * slow.omega_n);
  EXPECT_DOUBLE_EQ(fast.xi, slow.xi);
  EXPECT_DOUBLE_EQ(fast.omega_n_std, 4.0 * slow.omega_n_std);
  EXPECT_DOUBLE_EQ(fast.zoh_mismatch_chi2, slow.zoh_mismatch_chi2);
}

TEST(ServoModelReading, MismatchIsTheDistanceFromTheImpliedNumerator) {
  auto theta = sampled(0.5, 20.0, 0.4, kDt);
  const double size = theta.tail<3>().norm();
  // A change that keeps the sum of b keeps K, omega_n and xi, so all of it is mismatch.
  const Vector<double, 3> change(1e-4, -3e-4, 2e-4);
  theta.tail<3>() += change;
  const auto reading =
      identify_servo<double>(theta, 1e-10 * SquareMatrix<double, 6>::Identity(), kDt);
  EXPECT_NEAR(reading.gain, 0.5, 1e-12);
  EXPECT_NEAR(reading.zoh_mismatch, change.norm() / theta.tail<3>().norm(), 1e-9);
  EXPECT_GT(reading.zoh_mismatch_chi2, 100.0);
  EXPECT_GT(size, 0.0);
}

TYPED_TEST(ServoModel, SizeOfTheGainDoesNotMatter) {
  using Scalar = TypeParam;
  // A power of two, so that b scales exactly; in float the squares of such b underflow.
  const Scalar scale = Scalar(1) / static_cast<Scalar>(1ULL << 62);
  auto theta = sampled(Scalar(1), Scalar(20), Scalar(0.4), Scalar(0.05));
  theta[3] *= Scalar(1.125);
  const auto plain = identify_servo<Scalar>(theta, no_covariance<Scalar>(), Scalar(0.05));
  theta.template tail<3>() *= scale;
  const auto small = identify_servo<Scalar>(theta, no_covariance<Scalar>(), Scalar(0.05));
  ASSERT_EQ(small.status, ServoReadingStatus::ok);
  EXPECT_EQ(small.gain, scale * plain.gain);
  EXPECT_EQ(small.omega_n, plain.omega_n);
  EXPECT_NEAR(small.zoh_mismatch, plain.zoh_mismatch, Scalar(4) * kEps<Scalar>);
  EXPECT_GT(plain.zoh_mismatch, Scalar(0.01));
}

TEST(ServoModelRefusal, NotFinite) {
  const auto theta = theta_of_angle(1.0, 0.7, 0.6);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (int i = 0; i < 6; ++i) {
      auto broken = theta;
      broken[i] = bad;
      EXPECT_EQ(status_of(broken), ServoReadingStatus::not_finite);
      auto covariance = no_covariance<double>();
      covariance(i, (i + 1) % 6) = bad;
      EXPECT_EQ(identify_servo<double>(theta, covariance, kDt).status,
                ServoReadingStatus::not_finite);
    }
    EXPECT_EQ(identify_servo<double>(theta, no_covariance<double>(), bad).status,
              ServoReadingStatus::not_finite);
  }
}

TEST(ServoModelRefusal, InvalidArgument) {
  const auto theta = theta_of_angle(1.0, 0.7, 0.6);
  for (const double dt_s : {0.0, -kDt}) {
    EXPECT_EQ(identify_servo<double>(theta, no_covariance<double>(), dt_s).status,
              ServoReadingStatus::invalid_argument);
  }
  auto covariance = no_covariance<double>();
  covariance(2, 2) = -1e-9;
  EXPECT_EQ(identify_servo<double>(theta, covariance, kDt).status,
            ServoReadingStatus::invalid_argument);
}

TEST(ServoModelRefusal, NoIntegrator) {
  // The pair lies |1 - z| = 0.58 from one: without uncertainty up to 2 % of that counts as
  // integrator.
  const double next = std::abs(1.0 - std::polar(0.7, 0.6));
  EXPECT_EQ(status_of(theta_of_angle(1.0 - 0.019 * next, 0.7, 0.6)), ServoReadingStatus::ok);
  EXPECT_EQ(status_of(theta_of_angle(1.0 - 0.021 * next, 0.7, 0.6)),
            ServoReadingStatus::no_integrator);
  EXPECT_EQ(status_of(theta_of_angle(1.0 + 0.021 * next, 0.7, 0.6)),
            ServoReadingStatus::no_integrator);
  // The same pole is an integrator once its deviation is a third of the distance or more.
  const auto theta = theta_of_angle(1.0 - 0.05 * next, 0.7, 0.6);
  const auto reading =
      identify_servo<double>(theta, 1e-6 * SquareMatrix<double, 6>::Identity(), kDt);
  const double unit = reading.integrator_pole_std / 1e-3;
  const double needed = 0.05 * next / (3.0 * unit);
  EXPECT_EQ(status_of(theta, 1.02 * needed * needed), ServoReadingStatus::ok);
  EXPECT_EQ(status_of(theta, 0.98 * needed * needed), ServoReadingStatus::no_integrator);
  // What was found is still reported; the rest is unknown.
  EXPECT_NEAR(reading.integrator_pole, 1.0 - 0.05 * next, 1e-12);
  EXPECT_TRUE(std::isnan(reading.omega_n));
  EXPECT_TRUE(std::isnan(reading.zoh_mismatch));
  // An estimator that has not started
  EXPECT_EQ(status_of(Vector<double, 6>::Zero()), ServoReadingStatus::no_integrator);
}

TEST(ServoModelRefusal, PolesNotSeparable) {
  EXPECT_EQ(status_of(theta_of(1.0, -1.0 - 0.99, 0.99)), ServoReadingStatus::poles_not_separable);
  EXPECT_EQ(status_of(theta_of_angle(1.0, 0.7, 0.6), 0.1), ServoReadingStatus::poles_not_separable);
}

TEST(ServoModelRefusal, PoleNearZero) {
  EXPECT_EQ(status_of(theta_of(1.0, -0.5, 0.0)), ServoReadingStatus::pole_near_zero);
  EXPECT_EQ(status_of(theta_of(1.0, -0.501, 0.0005), 1e-6), ServoReadingStatus::pole_near_zero);
  EXPECT_EQ(status_of(theta_of(1.0, -0.499, -0.0005), 1e-6), ServoReadingStatus::pole_near_zero);
  EXPECT_EQ(status_of(theta_of(1.0, -0.501, 0.0005), 1e-10), ServoReadingStatus::ok);
}

TEST(ServoModelRefusal, NegativeRealPole) {
  EXPECT_EQ(status_of(theta_of(1.0, -0.3, -0.1)),
            ServoReadingStatus::negative_real_pole);  // 0.5, -0.2
  EXPECT_EQ(status_of(theta_of(1.0, 0.7, 0.1)),
            ServoReadingStatus::negative_real_pole);  // -0.5, -0.2
}

TEST(ServoModelRefusal, GainNeedsAStablePairOnly) {
  // 0.3 / (dt Q(1))
  EXPECT_NEAR(gain_of(theta_of(1.0, -0.5, 0.0)), 0.3 / (kDt * 0.5), 1e-9);   // pole_near_zero
  EXPECT_NEAR(gain_of(theta_of(1.0, -0.3, -0.1)), 0.3 / (kDt * 0.6), 1e-9);  // negative_real_pole
  EXPECT_NEAR(gain_of(theta_of(1.0, 0.7, 0.1)), 0.3 / (kDt * 1.8), 1e-9);
  EXPECT_TRUE(std::isnan(gain_of(theta_of(1.0, 0.6, -0.5))));    // 0.47, -1.07
  EXPECT_TRUE(std::isnan(gain_of(theta_of(1.0, -1.7, 0.6))));    // 0.5, 1.2
  EXPECT_TRUE(std::isnan(gain_of(theta_of(1.0, -2.5, 1.56))));   // 1.2, 1.3
  EXPECT_TRUE(std::isnan(gain_of(theta_of(1.0, 0.0, -1.2))));    // 1.1, -1.1
  EXPECT_TRUE(std::isnan(gain_of(theta_of(0.9, -0.5, 0.0))));    // no integrator
  EXPECT_TRUE(std::isnan(gain_of(theta_of(1.0, -1.99, 0.99))));  // another one at 1
  EXPECT_TRUE(std::isnan(gain_of(theta_of(1.0, -0.5, 0.0, 0.0))));
}

TEST(ServoModelRefusal, UnstablePole) {
  EXPECT_EQ(status_of(theta_of_angle(1.0, 1.001, 0.6)), ServoReadingStatus::unstable_pole);
  EXPECT_EQ(status_of(theta_of(1.0, -1.7, 0.6)), ServoReadingStatus::unstable_pole);   // 0.5, 1.2
  EXPECT_EQ(status_of(theta_of(1.0, -2.5, 1.56)), ServoReadingStatus::unstable_pole);  // 1.2, 1.3
  EXPECT_EQ(status_of(theta_of_angle(1.0, 0.999, 0.6)), ServoReadingStatus::ok);
}

TEST(ServoModelRefusal, Aliasing) {
  const double pi = 3.14159265358979323846;
  EXPECT_EQ(status_of(theta_of_angle(1.0, 0.8, 0.979 * pi)), ServoReadingStatus::ok);
  EXPECT_EQ(status_of(theta_of_angle(1.0, 0.8, 0.981 * pi)), ServoReadingStatus::aliasing);
  // With uncertainty earlier: 0.3 rad from pi, deviation of the angle of the order of 0.1 rad
  EXPECT_EQ(status_of(theta_of_angle(1.0, 0.8, pi - 0.3), 3e-3), ServoReadingStatus::aliasing);
  EXPECT_EQ(status_of(theta_of_angle(1.0, 0.8, pi - 0.3), 3e-5), ServoReadingStatus::ok);
}

TEST(ServoModelRefusal, FoldedServoIsSeenInItsNumerator) {
  // Sampled below twice its frequency, the poles are those of a slower servo; b is not.
  for (const double omega_dt : {3.5, 4.5, 5.5, 6.2, 7.0, 8.5}) {
    for (const double xi : {0.02, 0.2, 0.4}) {
      Vector<double, 6> theta;
      ASSERT_EQ(ehsid::discretise(ContinuousServo<double>{1.0, omega_dt, xi}, 1.0, theta),
                Status::ok);
      EXPECT_EQ(status_of(theta), ServoReadingStatus::aliasing) << omega_dt << " " << xi;
      const auto reading = identify_servo<double>(theta, SquareMatrix<double, 6>::Zero(), 1.0);
      EXPECT_TRUE(std::isnan(reading.omega_n));
      EXPECT_NEAR(reading.gain, 1.0, 1e-9);
      EXPECT_GT(reading.zoh_mismatch_chi2, ehsid::kFoldedChi2<double>);
    }
  }
  // Below half the sampling rate, and with a b of no servo at all: not aliased.
  Vector<double, 6> theta;
  ASSERT_EQ(ehsid::discretise(ContinuousServo<double>{1.0, 3.0, 0.2}, 1.0, theta),
            ehsid::Status::ok);
  EXPECT_EQ(status_of(theta), ServoReadingStatus::ok);
  theta.tail<3>() << 1.0, -2.0, 1.5;
  EXPECT_EQ(status_of(theta), ServoReadingStatus::ok);
}

TEST(ServoModelRefusal, NoGain) {
  auto theta = theta_of_angle(1.0, 0.7, 0.6);
  theta.tail<3>().setZero();
  EXPECT_EQ(status_of(theta), ServoReadingStatus::no_gain);
}

TEST(ServoModelRefusal, NumericalLimit) {
  // Not positive semidefinite: b1 and b2 more than fully anticorrelated, so the variance of K is
  // negative.
  auto covariance = no_covariance<double>();
  covariance(3, 3) = 1e-6;
  covariance(4, 4) = 1e-6;
  covariance(3, 4) = -2e-6;
  covariance(4, 3) = -2e-6;
  const auto reading = identify_servo<double>(theta_of_angle(1.0, 0.7, 0.6), covariance, kDt);
  EXPECT_EQ(reading.status, ServoReadingStatus::numerical_limit);
  EXPECT_TRUE(std::isnan(reading.gain) && std::isnan(reading.omega_n));
}

TYPED_TEST(ServoModel, AnyThetaEndsInFiniteNumbersOrAReason) {
  using Scalar = TypeParam;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  int readable = 0;
  for (int i = 0; i < 20000; ++i) {
    Vector<Scalar, 6> theta;
    const double largest = i % 4 == 0 ? 30.0 : 0.5;  // up to 1e30: products overflow in float
    for (int j = 0; j < 6; ++j) {
      theta[j] = static_cast<Scalar>(3.0 * uniform(random) *
                                     std::pow(10.0, largest * std::abs(uniform(random))));
    }
    const Scalar size = static_cast<Scalar>(std::pow(10.0, 12.0 * uniform(random) - 6.0));
    const auto reading =
        identify_servo<Scalar>(theta, size * SquareMatrix<Scalar, 6>::Identity(), Scalar(0.05));
    if (reading.status != ServoReadingStatus::ok) {
      EXPECT_FALSE(ehsid::is_finite(reading.omega_n));
      EXPECT_EQ(ehsid::is_finite(reading.gain), ehsid::is_finite(reading.gain_std));
      continue;
    }
    ++readable;
    EXPECT_TRUE(ehsid::is_finite(reading.gain) && ehsid::is_finite(reading.gain_std));
    EXPECT_TRUE(reading.omega_n > Scalar(0) && reading.omega_n * Scalar(0.05) < Scalar(200));
    EXPECT_TRUE(reading.xi > Scalar(0));
    EXPECT_TRUE(reading.omega_n_std > Scalar(0) && reading.xi_std > Scalar(0));
  }
  EXPECT_GT(readable, 0);
}

}  // namespace
