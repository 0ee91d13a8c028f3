// SPDX-License-Identifier: MIT
// The effects of the catalogue as data, for programs that go over all of them. Everything is read from the struct of the
// effect; sizes are vectors in the order of its parameters.
#pragma once

#include <ehsid/plant/catalogue.hpp>
#include <ehsid/plant/effect_info.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <tuple>
#include <utility>
#include <vector>

namespace ehsid::plant {

using SizeVector = std::vector<double>;

struct EffectDescription {
  EffectInfo info;
  std::vector<ParameterInfo> parameters;
  std::vector<Need> needs;
  Reach reach;
  const char* contains;
  const char* together_with;
  const char* nuisance;
  std::vector<std::array<std::size_t, 2>> not_below;
  LogPlace log_place;
  std::vector<const char*> does_not_commute;
  std::function<std::vector<SizeVector>(const MachineScale&)> starts;
  std::function<bool(const SizeVector&, const MachineScale&)> matters;
  /// Empty where the effect contains no other.
  std::function<SizeVector(const SizeVector&)> simplified;
  std::function<SizeVector(const SizeVector&)> same;
  std::function<std::vector<SizeVector>(const SizeVector&, const MachineScale&)> grown;
};

namespace detail {

template <std::size_t N>
SizeVector vector_of(const Sizes<N>& sizes) {
  return {sizes.begin(), sizes.end()};
}

template <std::size_t N>
Sizes<N> sizes_of(const SizeVector& sizes) {
  Sizes<N> all{};
  std::copy_n(sizes.begin(), (std::min)(N, sizes.size()), all.begin());
  return all;
}

/// The simpler effect has as many parameters as simplified() returns.
template <class Effect, std::size_t N>
inline constexpr std::size_t kSimplerSize =
    std::tuple_size_v<decltype(Effect::simplified(std::declval<Sizes<N>>()))>;

template <class Effect>
std::vector<SizeVector> starts_of(const MachineScale& machine) {
  std::vector<SizeVector> all;
  for (const auto& sizes : Effect::starts(machine)) {
    all.push_back(vector_of(sizes));
  }
  return all;
}

template <class Effect>
EffectDescription describe() {
  constexpr std::size_t kSize = Effect::kParameters.size();
  EffectDescription all{Effect::kInfo,
                        {Effect::kParameters.begin(), Effect::kParameters.end()},
                        {Effect::kNeeds.begin(), Effect::kNeeds.end()},
                        Effect::kReach,
                        Effect::kContains,
                        Effect::kTogetherWith,
                        Effect::kNuisance,
                        {Effect::kNotBelow.begin(), Effect::kNotBelow.end()},
                        Effect::kLogPlace,
                        {Effect::kDoesNotCommute.begin(), Effect::kDoesNotCommute.end()},
                        starts_of<Effect>,
                        [](const SizeVector& sizes, const MachineScale& machine) {
                          return Effect::matters(sizes_of<kSize>(sizes), machine);
                        },
                        {},
                        {},
                        {}};
  if constexpr (Effect::kContains != nullptr) {
    all.simplified = [](const SizeVector& sizes) {
      return vector_of(Effect::simplified(sizes_of<kSize>(sizes)));
    };
    all.same = [](const SizeVector& simple) {
      return vector_of(Effect::same(sizes_of<kSimplerSize<Effect, kSize>>(simple)));
    };
    all.grown = [](const SizeVector& simple, const MachineScale& machine) {
      std::vector<SizeVector> all_sizes;
      for (const auto& sizes :
           Effect::grown(sizes_of<kSimplerSize<Effect, kSize>>(simple), machine)) {
        all_sizes.push_back(vector_of(sizes));
      }
      return all_sizes;
    };
  }
  return all;
}

template <class... Each>
std::vector<EffectDescription> describe_each(const std::tuple<Each...>& /*all*/) {
  return {describe<Each>()...};
}

}  // namespace detail

/// In the order of the catalogue.
inline std::vector<EffectDescription> effect_descriptions() {
  return detail::describe_each(Catalogue<double>{});
}

}  // namespace ehsid::plant
