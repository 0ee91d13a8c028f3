// SPDX-License-Identifier: MIT
// All parameters of the plant by name, in its order: rig, nuisances, initial state, effects.
#pragma once

#include <ehsid/plant/description.hpp>
#include <ehsid/plant/rig.hpp>

#include <string>
#include <vector>

namespace ehsid::plant {

/// A parameter of the plant under its full name, e.g. "effects.coulomb_friction.force_n".
struct PlantParameter {
  std::string name;
  ParameterInfo info;
};

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
  for (const EffectDescription& effect : effect_descriptions()) {
    for (const ParameterInfo& info : effect.parameters) {
      all.push_back({std::string("effects.") + effect.info.id + "." + info.name, info});
    }
  }
  return all;
}

}  // namespace ehsid::plant
