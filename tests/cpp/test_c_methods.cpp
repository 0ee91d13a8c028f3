// SPDX-License-Identifier: MIT
// Instrumental variables, and a servo whose integrator is known, from C: the bits of the estimator in C++, sample by
// sample.
#include <ehsid/c_api.h>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <ehsid/ehsid.hpp>
#include <ehsid/integrating.hpp>
#include <random>

#include <gtest/gtest.h>

namespace {

/// Model (16) of the paper with noise on the sensor; a glitch, samples that are no numbers, and a change half-way.
struct NoisySensor {
  std::mt19937 random{3};
  std::normal_distribution<double> normal;
  double y[3] = {};
  double u[3] = {};
  int k = 0;

  void next(float& command, float& position) {
    const double gain = k < 2000 ? 1.0 : 1.5;
    const double now = 2.2390 * y[0] - 1.7820 * y[1] + 0.5427 * y[2] +
                       gain * (0.3850 * u[0] - 0.5810 * u[1] + 0.2954 * u[2]);
    const double sent = normal(random) > 0.0 ? 1.0 : -1.0;
    command = static_cast<float>(sent);
    position = static_cast<float>(now + 0.02 * normal(random));
    for (int i = 2; i > 0; --i) {
      y[i] = y[i - 1];
      u[i] = u[i - 1];
    }
    y[0] = now;
    u[0] = sent;
    ++k;
    if (k == 900) {
      position = 1e3F;
    } else if (k == 1200) {
      position = std::nanf("");
    }
  }
};

/// One integrator and two poles, with noise on the sensor; samples that are no numbers, and a null that is not at zero.
struct Integrator {
  std::mt19937 random{3};
  std::normal_distribution<double> normal;
  double speed[2] = {};
  double u[3] = {};
  double position = 0.0;
  int k = 0;

  void next(float& command, float& measured) {
    const double now = 1.2390 * speed[0] - 0.5427 * speed[1] + 0.0385 * u[0] - 0.0581 * u[1] +
                       0.0595 * u[2] + 0.002;
    const double sent = normal(random) > 0.1 * position ? 1.0 : -1.0;
    speed[1] = speed[0];
    speed[0] = now;
    position += now;
    command = static_cast<float>(sent);
    measured = static_cast<float>(position + 1e-3 * normal(random));
    u[2] = u[1];
    u[1] = u[0];
    u[0] = sent;
    if (++k == 1200) {
      measured = std::nanf("");
    }
  }
};

struct Riv {
  static constexpr int kN = 6;
  static constexpr int kSamples = 4000;
  using Servo = NoisySensor;
  using Estimator = ehsid::InstrumentalArxEstimator<float, 3, 3, 1>;

  static ehsid_status configure(ehsid_configuration* made) {
    return ehsid_default_configuration(made, EHSID_KERNEL(riv, 6), 3, 3, 1, false);
  }
};

template <bool kOffset>
struct Known {
  static constexpr int kN = kOffset ? 6 : 5;
  static constexpr int kSamples = 2500;
  using Servo = Integrator;
  using Estimator =
      ehsid::IntegratingRlsEstimator<float, 2, 3, 1, ehsid::Exponential<float>, kOffset>;

  static ehsid_status configure(ehsid_configuration* made) {
    const ehsid_kernel* kernel =
        kOffset ? EHSID_KERNEL(integrating, 6) : EHSID_KERNEL(integrating, 5);
    return ehsid_default_configuration(made, kernel, 2, 3, 1, kOffset);
  }
};

/// The estimator in storage of the caller.
template <class Method>
struct FromC {
  std::uint64_t storage[EHSID_STORAGE_WORDS(Method::kN)];
  ehsid_estimator* estimator = nullptr;

  FromC() {
    ehsid_configuration configuration;
    EXPECT_EQ(Method::configure(&configuration), EHSID_OK);
    EXPECT_EQ(ehsid_init(&estimator, storage, sizeof storage, &configuration), EHSID_OK);
  }
};

/// A method from C and from C++, over the same samples.
template <class Method>
struct Both {
  FromC<Method> c;
  typename Method::Estimator cpp;
  int counts[16] = {};

  void run() {
    typename Method::Servo servo;
    for (int k = 0; k < Method::kSamples; ++k) {
      float command = 0.0F;
      float position = 0.0F;
      servo.next(command, position);
      const ehsid::Status status = cpp.step(command, position);
      ++counts[static_cast<int>(status)];
      ASSERT_EQ(static_cast<int>(ehsid_step(c.estimator, command, position)),
                static_cast<int>(status))
          << k;
      float theta[Method::kN];
      float deviation[Method::kN];
      ASSERT_EQ(ehsid_theta(c.estimator, theta, Method::kN), EHSID_OK);
      ASSERT_EQ(ehsid_standard_deviation(c.estimator, deviation, Method::kN), EHSID_OK);
      const auto theta_hat = cpp.theta_hat();
      const auto standard_deviation = cpp.standard_deviation();
      ASSERT_EQ(std::memcmp(theta, theta_hat.data(), sizeof theta), 0) << k;
      ASSERT_EQ(std::memcmp(deviation, standard_deviation.data(), sizeof deviation), 0) << k;
    }
  }
};

TEST(CRiv, HasTheBitsOfCpp) {
  Both<Riv> both;
  both.run();
  // ... and it has estimated, refused a glitch and what is no number, and filled its history again.
  EXPECT_GT(both.counts[EHSID_OK], 3000);
  EXPECT_GT(both.counts[EHSID_OUT_OF_RANGE], 0);
  EXPECT_EQ(both.counts[EHSID_INVALID_INPUT], 1);
  EXPECT_GT(both.counts[EHSID_FILLING], 0);
  // Three deviations of 0.05. Least squares says -1.90 to -1.98 here, where the noise is on the sensor.
  EXPECT_NEAR(both.cpp.theta_hat()[0], -2.2390F, 3.0F * both.cpp.standard_deviation()[0]);
}

TEST(CRiv, OtherOrdersAreRefused) {
  ehsid_configuration configuration;
  for (const std::int32_t na : {1, 2, 4, 5}) {
    EXPECT_EQ(
        ehsid_default_configuration(&configuration, EHSID_KERNEL(riv, 6), na, 6 - na, 1, false),
        EHSID_INVALID_ARGUMENT);
  }
  EXPECT_EQ(ehsid_default_configuration(&configuration, EHSID_KERNEL(riv, 6), 3, 2, 1, true),
            EHSID_OK);
  EXPECT_EQ(ehsid_default_configuration(&configuration, EHSID_KERNEL(riv, 6), 3, 3, 4, false),
            EHSID_OK);
}

template <bool kOffset>
void expect_the_bits_of_cpp() {
  Both<Known<kOffset>> both;
  both.run();
  EXPECT_GT(both.counts[EHSID_OK], 2000);
  ehsid_servo servo_of_c;
  ehsid_trust trust = EHSID_STARTING;
  ASSERT_EQ(ehsid_read_servo(both.c.estimator, 0.01F, &servo_of_c, &trust), EHSID_OK);
  const ehsid::ServoReading<float> reading = both.cpp.servo(0.01F);
  EXPECT_EQ(static_cast<int>(servo_of_c.status), static_cast<int>(reading.status));
  EXPECT_EQ(static_cast<int>(trust), static_cast<int>(reading.reason));
  EXPECT_GT(reading.gain_std, 0.0F);
  EXPECT_EQ(servo_of_c.gain, reading.gain);
  EXPECT_EQ(servo_of_c.gain_std, reading.gain_std);
  // Steady speed for a command of one, (b1 + b2 + b3) / (1 + a1 + a2) = 0.0399 / 0.3037.
  const auto theta = both.cpp.theta_hat();
  EXPECT_NEAR((theta[2] + theta[3] + theta[4]) / (1.0F + theta[0] + theta[1]), 0.1314F, 0.01F);
}

TEST(CIntegrating, HasTheBitsOfCpp) { expect_the_bits_of_cpp<false>(); }

TEST(CIntegrating, HasThemWithAConstantTermToo) { expect_the_bits_of_cpp<true>(); }

TEST(CIntegrating, OtherNumbersOfParametersAreRefused) {
  ehsid_configuration configuration;
  const ehsid_kernel* five = EHSID_KERNEL(integrating, 5);
  EXPECT_EQ(ehsid_default_configuration(&configuration, five, 3, 3, 1, false),
            EHSID_INVALID_ARGUMENT);
  EXPECT_EQ(ehsid_default_configuration(&configuration, five, 2, 3, 1, true),
            EHSID_INVALID_ARGUMENT);
  EXPECT_EQ(ehsid_default_configuration(&configuration, five, 2, 2, 1, true), EHSID_OK);
}

template <class Method>
void expect_a_snapshot_goes_on() {
  FromC<Method> first;
  typename Method::Servo servo;
  float command = 0.0F;
  float position = 0.0F;
  for (int k = 0; k < 600; ++k) {
    servo.next(command, position);
    static_cast<void>(ehsid_step(first.estimator, command, position));
  }
  std::uint8_t bytes[EHSID_SNAPSHOT_BYTES(Method::kN)];
  size_t written = 0;
  ASSERT_EQ(ehsid_save(first.estimator, bytes, sizeof bytes, &written), EHSID_OK);
  FromC<Method> second;
  ASSERT_EQ(ehsid_restore(second.estimator, bytes, written), EHSID_OK);
  for (int k = 0; k < 200; ++k) {
    servo.next(command, position);
    ASSERT_EQ(ehsid_step(first.estimator, command, position),
              ehsid_step(second.estimator, command, position));
  }
  float theta[Method::kN];
  float other[Method::kN];
  ASSERT_EQ(ehsid_theta(first.estimator, theta, Method::kN), EHSID_OK);
  ASSERT_EQ(ehsid_theta(second.estimator, other, Method::kN), EHSID_OK);
  EXPECT_EQ(std::memcmp(theta, other, sizeof theta), 0);
}

TEST(CRiv, ASnapshotGoesOn) { expect_a_snapshot_goes_on<Riv>(); }

TEST(CIntegrating, ASnapshotGoesOn) { expect_a_snapshot_goes_on<Known<false>>(); }

}  // namespace
