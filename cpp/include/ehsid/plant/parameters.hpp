// SPDX-License-Identifier: MIT
// Everything the plant can be told, by name and in order: rig, nuisances, initial state, effects.
#pragma once

#include <ehsid/plant/catalogue.hpp>
#include <ehsid/plant/rig.hpp>

#include <string>
#include <tuple>
#include <vector>

namespace ehsid::plant {

/// A parameter of the plant under its full name, e.g. "effects.coulomb_friction.force_n".
struct PlantParameter {
  std::string name;
  ParameterInfo info;
};

/// Calls `use(info, parameters)` with every effect of the catalogue, in order.
template <class Use>
void for_each_effect(Use use) {
  std::apply([&](const auto&... effect) { (use(effect.kInfo, effect.kParameters), ...); },
             Catalogue<double>{});
}

/// In the order in which ServoPlant reads values.
inline std::vector<PlantParameter> plant_parameters() {
  std::vector<PlantParameter> all;
  all.reserve(2 * kFirstOfEffects);
  for (const ParameterInfo& info : kRigValues) {
    all.push_back({info.name, info});
  }
  for (const ParameterInfo& info : kNuisances) {
    all.push_back({info.name, info});
  }
  for (const ParameterInfo& info : kInitials) {
    all.push_back({info.name, info});
  }
  for_each_effect([&](const EffectInfo& effect, const auto& parameters) {
    for (const ParameterInfo& info : parameters) {
      all.push_back({std::string("effects.") + effect.id + "." + info.name, info});
    }
  });
  return all;
}

}  // namespace ehsid::plant
