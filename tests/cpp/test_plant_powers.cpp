// SPDX-License-Identifier: MIT
#include <ehsid/plant/powers.hpp>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

namespace {

using ehsid::plant::Four;
using ehsid::plant::Powers;

constexpr double kUnit = std::numeric_limits<double>::epsilon();

/// Four numbers somewhere in the range of the metering edges, and at the ends of pieces and octaves.
std::array<double, 4> numbers(std::mt19937& random, double least) {
  std::uniform_real_distribution<double> octaves(0.0, 90.0);
  std::uniform_int_distribution<int> whole(0, 90 * 32);
  const double edge = std::exp2(whole(random) / 32);
  const double piece = edge * (1.0 + (whole(random) % 32) / 32.0);
  return {least * std::exp2(octaves(random)), least + edge, least * piece,
          std::nextafter(least * piece, 0.5 * least) + least};
}

TEST(PlantPowers, AreThoseOfTheLibrary) {
  std::mt19937 random(19);
  for (const double exponent : {-0.275, -0.25, -0.2, 0.0, 0.7}) {
    for (const double least : {1.0, 1e4, 4.2e8, 2.5e11}) {
      const Powers powers(least, exponent);
      for (int i = 0; i < 500; ++i) {
        const std::array<double, 4> w = numbers(random, least);
        const auto parts = powers.parts(Four<2>(w));
        const Four<2> power = powers.power(parts);
        const Four<2> logarithm = powers.logarithm(parts);
        for (std::size_t k = 0; k < 4; ++k) {
          // Half a unit each: both tables, their product, t, the series, the last product.
          EXPECT_NEAR(power[k] / std::pow(w[k], exponent), 1.0, 4.0 * kUnit) << w[k];
          const double exact = std::log(w[k]);
          EXPECT_NEAR(logarithm[k], exact, 2.0 * kUnit * (1.0 + std::abs(exact))) << w[k];
        }
      }
    }
  }
}

TEST(PlantPowers, TheWidthOfTheBlocksChangesNoBit) {
  std::mt19937 random(23);
  const Powers powers(4e8, -0.24);
  for (int i = 0; i < 200; ++i) {
    const std::array<double, 4> w = numbers(random, 4e8);
    const auto alone = powers.parts(Four<1>(w));
    const auto pairs = powers.parts(Four<2>(w));
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_EQ(powers.power(alone)[k], powers.power(pairs)[k]);
      EXPECT_EQ(powers.logarithm(alone)[k], powers.logarithm(pairs)[k]);
    }
  }
}

// A simulation that diverges asks for powers of what is no number. Nothing outside of the tables is read.
TEST(PlantPowers, AnyNumberIsTaken) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const Powers powers(4e8, -0.24);
  const auto parts =
      powers.parts(Four<2>({kNone, -kNone, std::numeric_limits<double>::infinity(), 0.0}));
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_TRUE(std::isfinite(powers.power(parts)[k]));
  }
}

}  // namespace
