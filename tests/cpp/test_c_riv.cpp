// SPDX-License-Identifier: MIT
// Instrumental variables from C: the bits of the estimator in C++, sample by sample.
#include <ehsid/c_api.h>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <ehsid/ehsid.hpp>
#include <random>

#include <gtest/gtest.h>

namespace {

using Estimator = ehsid::InstrumentalArxEstimator<float, 3, 3, 1>;

/// The estimator in storage of the caller, with a snapshot's worth of bytes.
struct FromC {
  std::uint64_t storage[EHSID_STORAGE_WORDS(6)];
  ehsid_estimator* estimator = nullptr;

  explicit FromC(std::int32_t nk = 1) {
    ehsid_configuration configuration;
    EXPECT_EQ(ehsid_default_configuration(&configuration, EHSID_KERNEL(riv, 6), 3, 3, nk, false),
              EHSID_OK);
    EXPECT_EQ(ehsid_init(&estimator, storage, sizeof storage, &configuration), EHSID_OK);
  }
};

/// Model (16) of the paper with noise on the sensor; a glitch, samples that are no numbers, and a change half-way.
struct Servo {
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

TEST(CRiv, HasTheBitsOfCpp) {
  FromC c;
  Estimator cpp;
  Servo servo;
  int differing = 0;
  int counts[16] = {};
  for (int k = 0; k < 4000; ++k) {
    float command = 0.0F;
    float position = 0.0F;
    servo.next(command, position);
    const ehsid::Status status = cpp.step(command, position);
    ++counts[static_cast<int>(status)];
    ASSERT_EQ(static_cast<int>(ehsid_step(c.estimator, command, position)),
              static_cast<int>(status))
        << k;
    float theta[6];
    float deviation[6];
    ASSERT_EQ(ehsid_theta(c.estimator, theta, 6), EHSID_OK);
    ASSERT_EQ(ehsid_standard_deviation(c.estimator, deviation, 6), EHSID_OK);
    const auto theta_hat = cpp.theta_hat();
    const auto standard_deviation = cpp.standard_deviation();
    differing += std::memcmp(theta, theta_hat.data(), sizeof theta) != 0 ||
                         std::memcmp(deviation, standard_deviation.data(), sizeof deviation) != 0
                     ? 1
                     : 0;
  }
  EXPECT_EQ(differing, 0);
  // ... and it has estimated, refused a glitch and what is no number, and filled its history again.
  EXPECT_GT(counts[EHSID_OK], 3000);
  EXPECT_GT(counts[EHSID_OUT_OF_RANGE], 0);
  EXPECT_EQ(counts[EHSID_INVALID_INPUT], 1);
  EXPECT_GT(counts[EHSID_FILLING], 0);
  // Three deviations of 0.05. Least squares says -1.90 to -1.98 here, where the noise is on the sensor.
  EXPECT_NEAR(cpp.theta_hat()[0], -2.2390F, 3.0F * cpp.standard_deviation()[0]);
}

TEST(CRiv, ASnapshotGoesOn) {
  FromC first;
  Servo servo;
  float command = 0.0F;
  float position = 0.0F;
  for (int k = 0; k < 600; ++k) {
    servo.next(command, position);
    static_cast<void>(ehsid_step(first.estimator, command, position));
  }
  std::uint8_t bytes[EHSID_SNAPSHOT_BYTES(6)];
  size_t written = 0;
  ASSERT_EQ(ehsid_save(first.estimator, bytes, sizeof bytes, &written), EHSID_OK);
  FromC second;
  ASSERT_EQ(ehsid_restore(second.estimator, bytes, written), EHSID_OK);
  for (int k = 0; k < 200; ++k) {
    servo.next(command, position);
    ASSERT_EQ(ehsid_step(first.estimator, command, position),
              ehsid_step(second.estimator, command, position));
  }
  float theta[6];
  float other[6];
  ASSERT_EQ(ehsid_theta(first.estimator, theta, 6), EHSID_OK);
  ASSERT_EQ(ehsid_theta(second.estimator, other, 6), EHSID_OK);
  EXPECT_EQ(std::memcmp(theta, other, sizeof theta), 0);
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

}  // namespace
