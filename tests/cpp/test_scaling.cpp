// SPDX-License-Identifier: MIT
#include <ehsid/scaling.hpp>

#include <gtest/gtest.h>

#include <limits>

namespace {

using Scaling = ehsid::Scaling<double>;

TEST(Scaling, ParametersOfScaledSignalsGiveTheModelInUnits) {
  const Scaling scaling{5.0, 0.3, 1.5, 0.1};
  // A scaled model of order one with a constant, on one sample.
  const double theta[] = {-0.8, 0.4, 0.05};
  const double y_before = 0.17;
  const double u_before = 3.1;
  const double scaled = -theta[0] * scaling.scale_position(y_before) +
                        theta[1] * scaling.scale_command(u_before) + theta[2];
  // The same in units, about the offsets.
  const double in_units = -theta[0] * scaling.parameter_unit(0, 1, 1) * (y_before - 0.1) +
                          theta[1] * scaling.parameter_unit(1, 1, 1) * (u_before - 1.5) +
                          theta[2] * scaling.parameter_unit(2, 1, 1);
  EXPECT_NEAR(scaling.unscale_position(scaled), in_units + 0.1, 1e-15);
}

TEST(Scaling, PositionGoesThereAndBack) {
  const Scaling scaling{5.0, 0.3, 1.5, 0.1};
  for (const double position : {-1.0, 0.0, 0.1, 0.29}) {
    EXPECT_NEAR(scaling.unscale_position(scaling.scale_position(position)), position, 1e-15);
  }
}

TEST(Scaling, ScalesMustBePositiveAndAllFinite) {
  EXPECT_TRUE(Scaling{}.valid());
  const double inf = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {0.0, -1.0, inf, nan}) {
    EXPECT_FALSE((Scaling{bad, 1.0, 0.0, 0.0}).valid());
    EXPECT_FALSE((Scaling{1.0, bad, 0.0, 0.0}).valid());
  }
  for (const double bad : {inf, nan}) {
    EXPECT_FALSE((Scaling{1.0, 1.0, bad, 0.0}).valid());
    EXPECT_FALSE((Scaling{1.0, 1.0, 0.0, bad}).valid());
  }
}

TEST(Scaling, UnitsOfVariancesMustBeNormalNumbers) {
  using Single = ehsid::Scaling<float>;
  EXPECT_TRUE((Single{1e9F, 1e-9F, 0.0F, 0.0F}).valid());
  EXPECT_TRUE((Single{1e-9F, 1e9F, 0.0F, 0.0F}).valid());
  EXPECT_FALSE((Single{1.0F, 1e20F, 0.0F, 0.0F}).valid());   // its square is infinite
  EXPECT_FALSE((Single{1.0F, 1e-20F, 0.0F, 0.0F}).valid());  // and here zero
  EXPECT_FALSE((Single{1e10F, 1e-10F, 0.0F, 0.0F}).valid());
  EXPECT_FALSE((Single{1e-40F, 1.0F, 0.0F, 0.0F}).valid());
}

TEST(Scaling, APositionBeyondTheTypeStaysFinite) {
  const ehsid::Scaling<float> scaling{1.0F, 1e18F, 0.0F, 3e38F};
  EXPECT_TRUE(ehsid::is_finite(scaling.unscale_position(1e30F)));
  EXPECT_LT(scaling.unscale_position(-1e30F), 0.0F);
}

}  // namespace
