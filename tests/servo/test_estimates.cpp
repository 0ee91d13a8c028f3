// SPDX-License-Identifier: MIT
// Through frames, C API and settings: the estimates are those of ehsid::ArxEstimator on the same samples, bit for
// bit. So each member of `configure` has reached the setting it is meant for.
#include <gtest/gtest.h>
#include <ehsid/arx_estimator.hpp>
#include <ehsid/fit.hpp>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "../cpp/policy_types.hpp"
#include "session.hpp"

namespace test {
namespace {

/// No setting at its default, so that two which are exchanged show.
Settings unusual(std::uint8_t policy) {
  Settings s;
  s.policy = policy;
  s.flags = servo::kReset;
  s.scaling = {4.0F, 0.3F, 0.25F, -0.02F};
  s.guards = {1.7F, 3e5F};
  s.reset = {7.0F, 70.0F, 4.5F, 1.7F};
  s.cool_down = 31;
  s.reset_floor = 2e-4F;
  s.convergence = {0.07F, 0.15F};
  s.hold = 13;
  s.start = {4e5F, 50.0F};
  return s;
}

template <class Policy>
void take_over(Policy& policy, const std::vector<float>& from) {
  Policy::settings([&](const ehsid::SettingInfo& setting, auto member) {
    member(policy) = from[static_cast<std::size_t>(setting.hil_place)];
  });
}

template <class Estimator>
typename Estimator::Options options(const Settings& s) {
  typename Estimator::Options o;
  o.scaling = {s.scaling[0], s.scaling[1], s.scaling[2], s.scaling[3]};
  take_over(o.forgetting, s.forgetting);
  o.rls.information_margin = s.guards[0];
  o.rls.covariance_ceiling = s.guards[1];
  o.reset_enabled = (s.flags & servo::kReset) != 0;
  o.reset.short_window = s.reset[0];
  o.reset.long_window = s.reset[1];
  o.reset.trigger_ratio = s.reset[2];
  o.reset.release_ratio = s.reset[3];
  o.reset.cool_down = s.cool_down;
  o.reset.floor = s.reset_floor;
  o.convergence.tolerance = s.convergence[0];
  o.convergence.magnitude = s.convergence[1];
  o.convergence.hold = s.hold;
  o.variance0.setConstant(s.start[0]);
  o.input_limit = s.start[1];
  return o;
}

/// Random commands on a model of third order that changes at sample 250, with noise and a bias; some samples are
/// beyond the input limit or not finite.
class Record {
 public:
  /// nk: samples until the command shows, 1 or 2.
  explicit Record(std::size_t nk) : u_at_(nk - 1) {}

  void next(int k) {
    const float gain = k < 250 ? 1.0F : 8.0F;
    position = 2.239F * y_[0] - 1.782F * y_[1] + 0.543F * y_[2] +
               gain * (0.00385F * u_[u_at_] - 0.00581F * u_[u_at_ + 1] + 0.00295F * u_[u_at_ + 2]) +
               noise_(random_);
    std::rotate(std::begin(y_), std::end(y_) - 1, std::end(y_));
    y_[0] = position;
    command = random_() % 2 == 0 ? 2.0F : -1.5F;
    std::rotate(std::begin(u_), std::end(u_) - 1, std::end(u_));
    u_[0] = command;
    if (k == 120) {
      position = std::numeric_limits<float>::infinity();
    } else if (k == 180) {
      position = 16.0F;  // 0.3 * 50 is the limit
    }
  }

  float command = 0.0F;
  float position = 0.0F;

 private:
  std::mt19937 random_{4};
  std::uniform_real_distribution<float> noise_{-1e-3F, 1.2e-3F};
  float y_[3] = {};
  float u_[4] = {};
  std::size_t u_at_;
};

std::uint32_t bits(float value) {
  std::uint32_t word = 0;
  std::memcpy(&word, &value, sizeof word);
  return word;
}

template <class Estimator>
void expect_same(const Heard& result, const Estimator& estimator, ehsid::Status status, float fit) {
  const Packet& body = result.body;
  ASSERT_EQ(result.kind, 0x84);
  ASSERT_EQ(body.size(), 51U + 4U * Estimator::kN);
  EXPECT_EQ(status_of(result), static_cast<int>(status));
  EXPECT_EQ((flags_of(result) & servo::kConverged) != 0, estimator.converged());
  EXPECT_EQ((flags_of(result) & servo::kResidualsNotWhite) == 0, estimator.whiteness().white());
  EXPECT_EQ(at<std::uint16_t>(body, 18), estimator.change_detector().alarms());
  EXPECT_EQ(at<std::uint32_t>(body, 20), bits(estimator.innovation()));
  EXPECT_EQ(at<std::uint32_t>(body, 24), bits(estimator.forgetting_factor()));
  EXPECT_EQ(at<std::uint32_t>(body, 28), bits(fit));
  EXPECT_EQ(at<std::uint32_t>(body, 32), bits(estimator.monitor().excitation()));
  EXPECT_EQ(at<std::uint32_t>(body, 36), bits(estimator.residual_variance()));
  const auto theta = estimator.theta_hat();
  for (int i = 0; i < Estimator::kN; ++i) {
    EXPECT_EQ(bits(theta_of(result)[static_cast<std::size_t>(i)]), bits(theta[i]));
  }
}

/// The estimator must be configured as the settings say.
template <class Estimator>
void compare(const Settings& settings, Estimator& estimator) {
  Host host = running(settings);
  Record record(settings.nk);
  ehsid::FitMonitor<float> fit;
  int resets = 0;
  int settled = 0;
  for (int k = 0; k < 500 && !::testing::Test::HasFailure(); ++k) {
    record.next(k);
    const Heard result =
        host.sample(static_cast<std::uint32_t>(k), record.position, 0.0F, 0.0F, record.command);
    const bool finite = std::isfinite(record.position);
    const float command = finite ? record.command : 0.0F;
    EXPECT_EQ(command_of(result), command);
    const ehsid::Status status = estimator.step(command, record.position);
    if (status == ehsid::Status::ok || status == ehsid::Status::no_information) {
      fit.update(record.position, estimator.innovation());
    }
    expect_same(result, estimator, status, fit.percent());
    resets += status == ehsid::Status::reset ? 1 : 0;
    settled += estimator.settled() ? 1 : 0;
  }
  // FRatio has learned the new plant before five errors are large, for which a reset waits.
  if constexpr (Estimator::Forgetting::kId != ehsid::FRatio<float>::kId) {
    EXPECT_GT(resets, 0) << "the change of the plant was not seen: the test compares too little";
  }
  EXPECT_GT(settled, 0) << "never settled: the test compares too little";
}

template <class Forgetting>
void compare_policy(std::uint8_t policy) {
  using Estimator = ehsid::ArxEstimator<float, 3, 3, 1, Forgetting>;
  const Settings settings = unusual(policy);
  Estimator estimator;
  ASSERT_EQ(estimator.configure(options<Estimator>(settings)), ehsid::Status::ok);
  compare(settings, estimator);
}

template <class Policy>
struct EstimatesOf : testing::Test {};
using Policies = PolicyTypes<float>;
TYPED_TEST_SUITE(EstimatesOf, Policies, );

TYPED_TEST(EstimatesOf, EachPolicy) {
  compare_policy<TypeParam>(static_cast<std::uint8_t>(TypeParam::kId - 1));
}

TEST(Estimates, SevenParametersFromAnEstimate) {
  using Estimator = ehsid::ArxEstimator<float, 3, 3, 2, ehsid::Exponential<float>, true>;
  Settings settings = unusual(1);
  settings.nk = 2;
  settings.flags = servo::kReset | servo::kOffset | servo::kSeed;
  typename Estimator::Parameters theta;
  ehsid::UdFactors<float, 7> factors;
  for (int i = 0; i < 7; ++i) {
    theta[i] = 0.1F * static_cast<float>(i) - 0.25F;
    factors.d[static_cast<std::size_t>(i)] = 10.0F + static_cast<float>(i);
  }
  for (std::size_t i = 0; i < factors.u.size(); ++i) {
    factors.u[i] = 0.01F * static_cast<float>(i) - 0.1F;
  }
  const float noise_variance = 2e-6F;
  settings.seed.assign(theta.data(), theta.data() + 7);
  settings.seed.insert(settings.seed.end(), factors.d.begin(), factors.d.end());
  settings.seed.insert(settings.seed.end(), factors.u.begin(), factors.u.end());
  settings.seed.push_back(noise_variance);

  Estimator estimator;
  ASSERT_EQ(estimator.configure(options<Estimator>(settings)), ehsid::Status::ok);
  ASSERT_EQ(estimator.seed(theta, factors, noise_variance), ehsid::Status::ok);
  compare(settings, estimator);
}

}  // namespace
}  // namespace test
