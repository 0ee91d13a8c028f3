// SPDX-License-Identifier: MIT
#include <Eigen/Dense>
#include <cmath>
#include <cstring>
#include <ehsid/rls.hpp>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "policy_types.hpp"

namespace {

using ehsid::Status;

template <class Policy>
struct RlsPolicy : testing::Test {
  using Recursion = ehsid::Rls<float, 6, Policy>;
};
using Policies = test::PolicyTypes<float>;
TYPED_TEST_SUITE(RlsPolicy, Policies, );

/// Model (16) of the paper, driven with equation noise.
class Plant {
 public:
  explicit Plant(unsigned seed) : random_(seed) {}

  ehsid::Vector<float, 6> regressor() const {
    ehsid::Vector<float, 6> phi;
    for (int i = 0; i < 3; ++i) {
      phi[i] = static_cast<float>(-y_[i]);
      phi[3 + i] = static_cast<float>(u_[i]);
    }
    return phi;
  }

  float advance(double command, double noise) {
    const double y = 2.2390 * y_[0] - 1.7820 * y_[1] + 0.5427 * y_[2] + 0.3850 * u_[0] -
                     0.5810 * u_[1] + 0.2954 * u_[2] + noise * normal_(random_);
    for (int i = 2; i > 0; --i) {
      y_[i] = y_[i - 1];
      u_[i] = u_[i - 1];
    }
    y_[0] = y;
    u_[0] = command;
    return static_cast<float>(y);
  }

  double random_command() { return normal_(random_) > 0.0 ? 1.0 : -1.0; }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  double y_[3] = {};
  double u_[3] = {};
};

template <class Recursion>
void expect_usable(const Recursion& rls) {
  EXPECT_TRUE(rls.state().factors.usable());
  EXPECT_TRUE(ehsid::all_finite<6>(rls.state().theta));
}

template <class Recursion>
void excite(Recursion& rls, Plant& plant, int samples) {
  for (int k = 0; k < samples; ++k) {
    const auto phi = plant.regressor();
    static_cast<void>(rls.update(phi, plant.advance(plant.random_command(), 1e-3)));
  }
}

TYPED_TEST(RlsPolicy, BadInputLeavesEveryBitAsItWas) {
  typename TestFixture::Recursion rls;
  Plant plant(1);
  excite(rls, plant, 500);
  const auto before = rls.state();
  const float bad[] = {std::numeric_limits<float>::quiet_NaN(),
                       std::numeric_limits<float>::infinity(),
                       -std::numeric_limits<float>::infinity()};
  for (const float value : bad) {
    EXPECT_EQ(rls.update(plant.regressor(), value), Status::invalid_input);
    for (int i = 0; i < 6; ++i) {
      auto phi = plant.regressor();
      phi[i] = value;
      EXPECT_EQ(rls.update(phi, 0.0F), Status::invalid_input);
    }
  }
  // Finite, but the result overflows.
  EXPECT_EQ(rls.update(plant.regressor(), 1e30F), Status::numerical_limit);
  EXPECT_EQ(std::memcmp(&before, &rls.state(), sizeof before), 0);
}

TYPED_TEST(RlsPolicy, HugeInputsAtAnyTimeStayFinite) {
  typename TestFixture::Recursion rls;
  Plant plant(2);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> exponent(-38.0F, 38.0F);
  for (int k = 0; k < 20000; ++k) {
    auto phi = plant.regressor();
    float y = plant.advance(plant.random_command(), 1e-3);
    if (k % 7 == 0) {
      phi[k % 6] = std::pow(10.0F, exponent(random));
    }
    if (k % 11 == 0) {
      y = -std::pow(10.0F, exponent(random));
    }
    static_cast<void>(rls.update(phi, y));
    ASSERT_TRUE(rls.state().factors.usable()) << "at sample " << k;
    ASSERT_TRUE(ehsid::all_finite<6>(rls.state().theta)) << "at sample " << k;
  }
}

TYPED_TEST(RlsPolicy, CovarianceNeverExceedsTheCeiling) {
  typename TestFixture::Recursion rls;
  Plant plant(4);
  excite(rls, plant, 500);
  for (int k = 0; k < 100000; ++k) {
    const auto phi = plant.regressor();
    static_cast<void>(rls.update(phi, plant.advance(0.0, 1e-3)));
  }
  double mean = 0.0;
  for (int i = 0; i < 6; ++i) {
    mean += static_cast<double>(rls.state().factors.variance(i)) / 6.0;
  }
  // One rounding for each of the operations on the diagonal: 100 eps is generous.
  EXPECT_LE(mean, 1e6 * (1.0 + 100.0 * static_cast<double>(std::numeric_limits<float>::epsilon())));
}

TYPED_TEST(RlsPolicy, SlowHeldInputForAHundredMillionUpdatesStaysFinite) {
  typename TestFixture::Recursion rls;
  Plant plant(5);
  excite(rls, plant, 2000);
  // Noise from a fixed block: drawing 1e8 normal numbers would take longer than the updates.
  constexpr int kBlock = 1 << 16;
  static float outputs[kBlock];
  static ehsid::Vector<float, 6> regressors[kBlock];
  for (int k = 0; k < kBlock; ++k) {
    regressors[k] = plant.regressor();
    outputs[k] = plant.advance(0.5, 1e-3);
  }
#ifdef __OPTIMIZE__
  constexpr int kBlocks = 1526;  // 1e8 updates
#else
  constexpr int kBlocks = 16;
#endif
  for (int block = 0; block < kBlocks; ++block) {
    for (int k = 0; k < kBlock; ++k) {
      static_cast<void>(rls.update(regressors[k], outputs[k]));
    }
    ASSERT_TRUE(rls.state().factors.usable()) << "after block " << block;
    ASSERT_TRUE(ehsid::all_finite<6>(rls.state().theta)) << "after block " << block;
  }
  expect_usable(rls);
}

TEST(Rls, ZeroRegressorIsSkipped) {
  ehsid::Rls<float, 6, ehsid::Constant<float>> rls;
  EXPECT_EQ(rls.update(ehsid::Vector<float, 6>::Zero(), 1.0F), Status::no_information);
}

TEST(Rls, AStepWhoseVarianceOrFactorLeavesTheNumbersIsRefused) {
  using Limits = std::numeric_limits<float>;
  using Factors = ehsid::UdFactors<float, 2>;
  struct Case {
    Factors before;
    Eigen::Vector2f phi;
  };
  const Case cases[] = {
      {{{1.0F, 3.39e36F}, {10.0F}}, {1e-22F, 0.0F}},     // P_11 = 10^2 3.39e36 / 0.99 overflows
      {{{Limits::min(), 1.0F}, {0.0F}}, {1e19F, 0.0F}},  // D_11 falls below the normal numbers
      {{{1e4F, 1e-10F}, {0.0F}}, {0.01F, 1e18F}},        // U_12 = -5e19 overflows in its square
  };
  // Up to nearly the largest that is taken: there the ceiling weighs next to nothing.
  for (const float variance : {1e6F, 4e37F}) {
    for (const Case& one : cases) {
      ehsid::Rls<float, 2, ehsid::Constant<float>> rls;
      ASSERT_EQ(rls.start(Eigen::Vector2f::Zero(), Eigen::Vector2f::Constant(variance)),
                Status::ok);
      ASSERT_EQ(rls.seed(Eigen::Vector2f::Zero(), one.before, 0.0F), Status::ok);
      const auto state = rls.state();
      EXPECT_EQ(rls.update(one.phi, 0.0F), Status::numerical_limit);
      EXPECT_EQ(std::memcmp(&state, &rls.state(), sizeof state), 0);
    }
  }
}

TEST(Rls, RefusesASeedOfWhichANumberOverflows) {
  using Factors = ehsid::UdFactors<float, 2>;
  ehsid::Rls<float, 2, ehsid::Constant<float>> rls;
  const Eigen::Vector2f zero = Eigen::Vector2f::Zero();
  const Factors good({1.0F, 1.0F}, {0.0F});
  const Factors infinite_variance({1.0F, 1e38F}, {10.0F});
  EXPECT_EQ(rls.seed(zero, infinite_variance, 0.0F), Status::invalid_argument);
  EXPECT_EQ(rls.seed(zero, good, 1e19F), Status::invalid_argument);  // beyond 2^63
  EXPECT_EQ(rls.seed(Eigen::Vector2f(1e19F, 0.0F), good, 0.0F), Status::invalid_argument);
  EXPECT_EQ(rls.seed(zero, good, 9e18F), Status::ok);
}

TEST(Rls, OfOneParameterStaysAFiniteState) {
  // One parameter has no factor, but a number in its place is saved and restored.
  ehsid::Rls<float, 1, ehsid::Constant<float>> rls;
  for (int k = 1; k < 100; ++k) {
    ASSERT_EQ(rls.update(ehsid::Vector<float, 1>(1.0F), 2.0F), Status::ok);
    ASSERT_EQ(rls.state().factors.u[0], 0.0F);
  }
  EXPECT_TRUE(decltype(rls)::usable(rls.state()));
}

TEST(Rls, RefusesACovarianceThatIsNotPositiveDefinite) {
  ehsid::Rls<double, 2, ehsid::Constant<double>> rls;
  Eigen::Matrix2d indefinite;
  indefinite << 1.0, 2.0, 2.0, 1.0;
  EXPECT_EQ(rls.start_from_covariance(Eigen::Vector2d::Zero(), indefinite),
            Status::invalid_argument);
  Eigen::Matrix2d good;
  good << 2.0, 0.5, 0.5, 1.0;
  ASSERT_EQ(rls.start_from_covariance(Eigen::Vector2d::Zero(), good), Status::ok);
  EXPECT_LT((rls.P() - good).norm(), 1e-15);
}

TYPED_TEST(RlsPolicy, GoodSamplesAreTakenAgainAfterHostileOnes) {
  std::mt19937 random{15};
  std::uniform_real_distribution<float> uniform{-1.0F, 1.0F};
  // The scale of the hostile samples: of noise, and of noise with spikes.
  for (const bool spikes : {false, true}) {
    typename TestFixture::Recursion rls;
    for (int k = 0; k < 1500; ++k) {
      ehsid::Vector<float, 6> phi;
      const float scale = spikes && k % 50 != 0 ? 1.0F : 1e4F;
      for (int i = 0; i < 6; ++i) {
        phi[i] = scale * uniform(random);
      }
      static_cast<void>(rls.update(phi, scale * uniform(random)));
    }
    Plant plant(3);
    int taken = 0;
    for (int k = 0; k < 700; ++k) {
      const auto phi = plant.regressor();
      const Status status = rls.update(phi, plant.advance(plant.random_command(), 1e-3));
      taken += k >= 500 && status == Status::ok ? 1 : 0;
    }
    EXPECT_GT(taken, 0) << "spikes " << spikes;
    expect_usable(rls);
  }
}

TYPED_TEST(RlsPolicy, DeviationsStayFiniteAtTheLimits) {
  typename TestFixture::Recursion rls;
  ASSERT_EQ(rls.start(ehsid::Vector<float, 6>::Zero(), ehsid::Vector<float, 6>::Constant(1e36F)),
            Status::ok);
  for (int k = 0; k < 200; ++k) {
    ehsid::Vector<float, 6> phi = ehsid::Vector<float, 6>::Zero();
    phi[0] = k % 2 == 0 ? 1.0F : -1.0F;
    static_cast<void>(rls.update(phi, k % 3 == 0 ? 2e9F : -1e9F));
  }
  EXPECT_TRUE(ehsid::is_finite(rls.residual_variance()));
  EXPECT_TRUE(ehsid::all_finite<6>(rls.standard_deviation()));
}

TEST(Rls, StartValuesOutsideTheNormalRangeAreRefused) {
  ehsid::Rls<float, 2, ehsid::Constant<float>> rls;
  const ehsid::Vector<float, 2> zero = ehsid::Vector<float, 2>::Zero();
  for (const float bad : {1e-40F, 3e38F}) {
    EXPECT_EQ(rls.start(zero, ehsid::Vector<float, 2>::Constant(bad)), Status::invalid_argument);
  }
  EXPECT_EQ(
      rls.start(ehsid::Vector<float, 2>::Constant(1e19F), ehsid::Vector<float, 2>::Constant(1.0F)),
      Status::invalid_argument);
  EXPECT_EQ(rls.start(ehsid::Vector<float, 2>::Constant(-1e18F),
                      ehsid::Vector<float, 2>::Constant(1e36F)),
            Status::ok);
}

TYPED_TEST(RlsPolicy, HandsOverTheVariancesOfTheFactorsThatItKept) {
  using Tested = typename TestFixture::Recursion;
  int limited = 0;
  for (const float margin : {-1.0F, 0.0F}) {
    TypeParam policy;
    Tested rls{policy, typename Tested::Options{margin, 1e-4F}};
    ASSERT_EQ(rls.start(Tested::Parameters::Zero(), Tested::Parameters::Constant(1e3F)),
              Status::ok);
    Plant plant(3);
    for (int k = 0; k < 600; ++k) {
      const auto phi = plant.regressor();
      const float y = plant.advance(k < 300 ? plant.random_command() : 0.5, 1e-2);
      ehsid::Array<float, 6> handed;
      handed.fill(-1.0F);
      if (rls.update(phi, y, handed) == Status::ok) {
        ehsid::Array<float, 6> formed{};
        rls.state().factors.variances(formed);
        ASSERT_EQ(std::memcmp(handed.data(), formed.data(), sizeof formed), 0) << "at " << k;
        float mean = 0.0F;
        for (const float variance : formed) {
          mean += variance / (6.0F * 1e3F);
        }
        limited += mean > 0.999e-4F ? 1 : 0;
      }
    }
  }
  EXPECT_GT(limited, 0);  // the ceiling was met, where the factors are scaled after the sum
}

}  // namespace
