// SPDX-License-Identifier: MIT
// The servo whose integrator is known from C: the bits of the estimator in C++, sample by sample.
#include <ehsid/c_api.h>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <ehsid/integrating.hpp>
#include <random>

#include <gtest/gtest.h>

namespace {

/// One integrator and two poles, with noise on the sensor; samples that are no numbers, and a null that is not at zero.
struct Servo {
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

/// The estimator in storage of the caller.
template <int kN>
struct FromC {
  std::uint64_t storage[EHSID_STORAGE_WORDS(kN)];
  ehsid_estimator* estimator = nullptr;

  FromC() {
    const ehsid_kernel* kernel =
        kN == 5 ? EHSID_KERNEL(integrating, 5) : EHSID_KERNEL(integrating, 6);
    ehsid_configuration configuration;
    EXPECT_EQ(ehsid_default_configuration(&configuration, kernel, 2, 3, 1, kN == 6), EHSID_OK);
    EXPECT_EQ(ehsid_init(&estimator, storage, sizeof storage, &configuration), EHSID_OK);
  }
};

template <int kN>
void expect_the_bits_of_cpp() {
  FromC<kN> c;
  ehsid::IntegratingRlsEstimator<float, 2, 3, 1, ehsid::Exponential<float>, kN == 6> cpp;
  Servo servo;
  int kept = 0;
  for (int k = 0; k < 2500; ++k) {
    float command = 0.0F;
    float position = 0.0F;
    servo.next(command, position);
    const ehsid::Status status = cpp.step(command, position);
    kept += status == ehsid::Status::ok ? 1 : 0;
    ASSERT_EQ(static_cast<int>(ehsid_step(c.estimator, command, position)),
              static_cast<int>(status))
        << k;
    float theta[kN];
    float deviation[kN];
    ASSERT_EQ(ehsid_theta(c.estimator, theta, kN), EHSID_OK);
    ASSERT_EQ(ehsid_standard_deviation(c.estimator, deviation, kN), EHSID_OK);
    const auto theta_hat = cpp.theta_hat();
    const auto standard_deviation = cpp.standard_deviation();
    ASSERT_EQ(std::memcmp(theta, theta_hat.data(), sizeof theta), 0) << k;
    ASSERT_EQ(std::memcmp(deviation, standard_deviation.data(), sizeof deviation), 0) << k;
  }
  EXPECT_GT(kept, 2000);
  ehsid_servo servo_of_c;
  ehsid_trust trust = EHSID_STARTING;
  ASSERT_EQ(ehsid_read_servo(c.estimator, 0.01F, &servo_of_c, &trust), EHSID_OK);
  const ehsid::ServoReading<float> reading = cpp.servo(0.01F);
  EXPECT_EQ(static_cast<int>(servo_of_c.status), static_cast<int>(reading.status));
  EXPECT_EQ(static_cast<int>(trust), static_cast<int>(reading.reason));
  EXPECT_GT(reading.gain_std, 0.0F);
  EXPECT_EQ(servo_of_c.gain, reading.gain);
  EXPECT_EQ(servo_of_c.gain_std, reading.gain_std);
  // Steady speed for a command of one, (b1 + b2 + b3) / (1 + a1 + a2) = 0.0399 / 0.3037.
  const auto theta = cpp.theta_hat();
  EXPECT_NEAR((theta[2] + theta[3] + theta[4]) / (1.0F + theta[0] + theta[1]), 0.1314F, 0.01F);
}

TEST(CIntegrating, HasTheBitsOfCpp) { expect_the_bits_of_cpp<5>(); }

TEST(CIntegrating, HasThemWithAConstantTermToo) { expect_the_bits_of_cpp<6>(); }

TEST(CIntegrating, ASnapshotGoesOn) {
  FromC<5> first;
  Servo servo;
  float command = 0.0F;
  float position = 0.0F;
  for (int k = 0; k < 600; ++k) {
    servo.next(command, position);
    static_cast<void>(ehsid_step(first.estimator, command, position));
  }
  std::uint8_t bytes[EHSID_SNAPSHOT_BYTES(5)];
  size_t written = 0;
  ASSERT_EQ(ehsid_save(first.estimator, bytes, sizeof bytes, &written), EHSID_OK);
  FromC<5> second;
  ASSERT_EQ(ehsid_restore(second.estimator, bytes, written), EHSID_OK);
  float theta[5];
  float other[5];
  for (int k = 0; k < 200; ++k) {
    servo.next(command, position);
    ASSERT_EQ(ehsid_step(first.estimator, command, position),
              ehsid_step(second.estimator, command, position));
  }
  ASSERT_EQ(ehsid_theta(first.estimator, theta, 5), EHSID_OK);
  ASSERT_EQ(ehsid_theta(second.estimator, other, 5), EHSID_OK);
  EXPECT_EQ(std::memcmp(theta, other, sizeof theta), 0);
}

TEST(CIntegrating, OtherNumbersOfParametersAreRefused) {
  ehsid_configuration configuration;
  const ehsid_kernel* five = EHSID_KERNEL(integrating, 5);
  EXPECT_EQ(ehsid_default_configuration(&configuration, five, 3, 3, 1, false),
            EHSID_INVALID_ARGUMENT);
  EXPECT_EQ(ehsid_default_configuration(&configuration, five, 2, 3, 1, true),
            EHSID_INVALID_ARGUMENT);
  EXPECT_EQ(ehsid_default_configuration(&configuration, five, 2, 2, 1, true), EHSID_OK);
}

}  // namespace
