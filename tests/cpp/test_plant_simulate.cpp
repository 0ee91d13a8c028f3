// SPDX-License-Identifier: MIT
// The compiled plant as C++ calls it; what it computes is checked from Python (tests/python/core/test_plant*.py). Here the
// sanitizers see every plant, every effect and every size of the dual numbers.
#include <ehsid/plant/parameters.hpp>
#include <ehsid/plant/simulate.hpp>

#include "sensitivities.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

namespace {

using ehsid::plant::kOutputs;
using ehsid::plant::kStates;
using ehsid::plant::PlantKind;
using ehsid::plant::Simulation;

constexpr std::size_t kSamples = 300;

/// Typical values; effects off but for those whose name holds `effect`.
std::vector<double> typical(const std::string& effect) {
  std::vector<double> values;
  for (const auto& parameter : ehsid::plant::plant_parameters()) {
    const bool is_effect = parameter.name.rfind("effects.", 0) == 0;
    const bool on = !is_effect || parameter.name.find("effects." + effect) == 0;
    values.push_back(on ? parameter.info.typical : 0.0);
  }
  return values;
}

std::vector<double> steps() {
  std::vector<double> command(kSamples);
  for (std::size_t k = 0; k < kSamples; ++k) {
    command[k] = (k / 50) % 2 == 0 ? 3.0 : -4.0;
  }
  return command;
}

struct Trace {
  std::vector<double> outputs, sensitivities;
};

Trace run(PlantKind kind, const std::string& effect, std::vector<std::size_t> varied,
          const double* aligned = nullptr) {
  Simulation simulation;
  simulation.kind = kind;
  simulation.values = typical(effect);
  simulation.substeps = 4;
  simulation.varied = std::move(varied);
  const std::vector<double> command = steps();
  Trace made;
  made.outputs.assign(kSamples * kOutputs, -1.0);
  made.sensitivities.assign(kSamples * kOutputs * simulation.varied.size(), -1.0);
  ehsid::plant::simulate(simulation, command.data(), aligned, kSamples, made.outputs.data(),
                         made.sensitivities.empty() ? nullptr : made.sensitivities.data());
  return made;
}

class PlantSimulate : public testing::TestWithParam<PlantKind> {};

TEST_P(PlantSimulate, SensitivitiesDoNotChangeTheRunWhateverTheirNumber) {
  const Trace plain = run(GetParam(), "", {});
  // As many at a time as the processor takes, up to 8, 16 or 32, with a rest of every kind.
  for (const std::size_t count : {1U, 4U, 5U, 8U, 9U, 13U, 16U, 17U, 32U, 35U}) {
    std::vector<std::size_t> varied(count);
    std::iota(varied.begin(), varied.end(), std::size_t{0});
    const Trace made = run(GetParam(), "", varied);
    for (std::size_t i = 0; i < plain.outputs.size(); ++i) {
      if (std::isnan(plain.outputs[i])) {
        EXPECT_TRUE(std::isnan(made.outputs[i]));
      } else {
        // The same operations but for the quotients of dual numbers: rounding apart.
        EXPECT_NEAR(made.outputs[i], plain.outputs[i], 1e-6 * (1e-3 + std::abs(plain.outputs[i])));
      }
    }
  }
}

TEST_P(PlantSimulate, EachSensitivityIsThatOfARunOfItsOwn) {
  std::vector<std::size_t> varied(36);
  std::iota(varied.begin(), varied.end(), std::size_t{0});
  const Trace together = run(GetParam(), "", varied);
  for (const std::size_t i : {0U, 7U, 8U, 15U, 16U, 18U, 31U, 32U, 35U}) {
    const Trace alone = run(GetParam(), "", {varied[i]});
    for (std::size_t k = 0; k < kSamples * kOutputs; ++k) {
      const double found = together.sensitivities[k * varied.size() + i];
      if (std::isnan(alone.sensitivities[k])) {
        EXPECT_TRUE(std::isnan(found));
      } else {
        EXPECT_EQ(found, alone.sensitivities[k]) << i;
      }
    }
  }
}

TEST_P(PlantSimulate, DisturbancesAddNothingButDerivatives) {
  Simulation simulation;
  simulation.kind = GetParam();
  simulation.values = typical("");
  simulation.substeps = 4;
  simulation.varied = {0, 2, 6};
  const std::vector<double> command = steps();
  const std::size_t row = kSamples * kOutputs;
  std::vector<double> plain(row), of_values(row * simulation.varied.size());
  ehsid::plant::simulate(simulation, command.data(), nullptr, kSamples, plain.data(),
                         of_values.data());
  // Enough for several parts, of which one has values and disturbances.
  const std::vector<double> signal(kSamples, 1.0);
  for (int i = 0; i < 34; ++i) {
    const auto equation = static_cast<ehsid::plant::Equation>(i % 6);
    simulation.disturbances.push_back({equation, signal.data()});
  }
  const std::size_t count = ehsid::plant::directions(simulation);
  std::vector<double> outputs(row), all(row * count);
  ehsid::plant::simulate(simulation, command.data(), nullptr, kSamples, outputs.data(), all.data());
  const auto same = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
  for (std::size_t k = 0; k < row; ++k) {
    EXPECT_PRED2(same, outputs[k], plain[k]);
    for (std::size_t i = 0; i < simulation.varied.size(); ++i) {
      EXPECT_PRED2(same, all[k * count + i], of_values[k * simulation.varied.size() + i]);
    }
    // The same signal in the same equation, computed in other parts.
    EXPECT_PRED2(same, all[k * count + 3], all[k * count + 33]);
  }
}

TEST(PlantInstructionSets, GiveTheSameBits) {
  namespace detail = ehsid::plant::detail;
  std::vector<detail::Kernels> all{detail::portable_kernels()};
#if defined(EHSID_PLANT_X86)
  if (__builtin_cpu_supports("avx2")) {
    all.push_back(detail::avx2_kernels());
  }
  if (__builtin_cpu_supports("avx512f")) {
    all.push_back(detail::avx512_kernels());
  }
#endif
  Simulation simulation;
  simulation.values = typical("stribeck_friction");
  simulation.varied = {0, 2, 6, 12};
  simulation.watched = {0, 2};
  const std::vector<double> command = steps();
  const std::size_t size = simulation.watched.size() * kSamples * simulation.varied.size();
  std::vector<double> first;
  for (const detail::Kernels& kernels : all) {
    for (const detail::Kernel& kernel : kernels) {
      std::vector<double> outputs(kSamples * kOutputs);
      std::vector<double> sensitivities(size);
      kernel.run(simulation, {0, 4}, {command.data(), nullptr, kSamples}, outputs.data(),
                 sensitivities.data());
      first = first.empty() ? sensitivities : first;
      EXPECT_EQ(sensitivities, first);
    }
  }
  EXPECT_NE(first.back(), 0.0);
}

TEST_P(PlantSimulate, EveryEffectRuns) {
  for (const ehsid::plant::EffectDescription& effect : ehsid::plant::effect_descriptions()) {
    const Trace made = run(GetParam(), effect.info.id, {});
    EXPECT_TRUE(std::isfinite(made.outputs[(kSamples - 1) * kOutputs])) << effect.info.id;
  }
  const Trace all = run(GetParam(), "", {0, 5});
  EXPECT_TRUE(std::isfinite(all.outputs[(kSamples - 1) * kOutputs]));
}

TEST_P(PlantSimulate, AStateThatIsToldIsThere) {
  constexpr double kGoesOn = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> aligned(kSamples * kStates, kGoesOn);
  constexpr std::size_t kAt = 120;
  aligned[kAt * kStates] = 0.123;
  aligned[kAt * kStates + 1] = 0.05;
  const Trace made = run(GetParam(), "", {}, aligned.data());
  EXPECT_NEAR(made.outputs[kAt * kOutputs], 0.123, 1e-12);
  EXPECT_NEAR(made.outputs[kAt * kOutputs + 1], 0.05, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Kinds, PlantSimulate,
                         testing::Values(PlantKind::ehs, PlantKind::axis, PlantKind::linear));

TEST(PlantSubsteps, FollowTheStiffnessAndStayInBounds) {
  std::vector<double> values = typical("none");
  const int usual = ehsid::plant::recommended_substeps(PlantKind::ehs, values, 1e-3);
  // Twice the sampling time, twice the steps, but for rounding up.
  const int twice = ehsid::plant::recommended_substeps(PlantKind::ehs, values, 2e-3);
  EXPECT_GE(usual, 2);
  EXPECT_NEAR(twice, 2 * usual, 1);
  EXPECT_EQ(ehsid::plant::recommended_substeps(PlantKind::ehs, values, 1e3), 1000);
  EXPECT_EQ(ehsid::plant::recommended_substeps(PlantKind::ehs, values, 1e-6), 2);
}

}  // namespace
