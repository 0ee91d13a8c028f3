// SPDX-License-Identifier: MIT
// All effects, in the order in which they act on the command path and in the sensor. A new effect is a file of its
// own and its name here; simulation, bindings, rigs and documents read the rest from it.
#pragma once

#include <ehsid/plant/effects/coulomb_friction.hpp>
#include <ehsid/plant/effects/entrained_air.hpp>
#include <ehsid/plant/effects/external_leakage.hpp>
#include <ehsid/plant/effects/internal_leakage.hpp>
#include <ehsid/plant/effects/load_force.hpp>
#include <ehsid/plant/effects/load_spring.hpp>
#include <ehsid/plant/effects/sensor_backlash.hpp>
#include <ehsid/plant/effects/sensor_lag.hpp>
#include <ehsid/plant/effects/sensor_quantisation.hpp>
#include <ehsid/plant/effects/stribeck_friction.hpp>
#include <ehsid/plant/effects/supply_droop.hpp>
#include <ehsid/plant/effects/transport_delay.hpp>
#include <ehsid/plant/effects/valve_dead_band.hpp>
#include <ehsid/plant/effects/valve_flow_saturation.hpp>
#include <ehsid/plant/effects/valve_hysteresis.hpp>
#include <ehsid/plant/effects/valve_lag.hpp>
#include <ehsid/plant/effects/valve_null_bias.hpp>

#include <cstddef>
#include <tuple>
#include <vector>

namespace ehsid::plant {

template <class Scalar>
using Catalogue =
    std::tuple<TransportDelay<Scalar>, ValveHysteresis<Scalar>, ValveLag<Scalar>,
               ValveNullBias<Scalar>, ValveFlowSaturation<Scalar>, ValveDeadBand<Scalar>,
               InternalLeakage<Scalar>, ExternalLeakage<Scalar>, EntrainedAir<Scalar>,
               SupplyDroop<Scalar>, CoulombFriction<Scalar>, StribeckFriction<Scalar>,
               LoadSpring<Scalar>, LoadForce<Scalar>, SensorBacklash<Scalar>, SensorLag<Scalar>,
               SensorQuantisation<Scalar>>;

/// The effects of a plant. An effect is on where one of its parameters is not zero or is varied.
template <class Scalar>
class Effects {
 public:
  /// The parameters of all effects stand in `values` from `first` on.
  Effects(const std::vector<Scalar>& values, std::size_t first) {
    const auto tell = [&](auto& effect) {
      effect.active = false;
      for (Scalar& parameter : effect.parameters) {
        parameter = values[first++];
        effect.active = effect.active || !is_nothing(parameter);
      }
    };
    std::apply([&](auto&... effect) { (tell(effect), ...); }, all_);
  }

  /// Asks every effect that is on, in the order of the catalogue.
  template <class Place>
  void each(Place place) {
    std::apply([&](auto&... effect) { ((effect.active ? place(effect) : void()), ...); }, all_);
  }
  template <class Place>
  void each(Place place) const {
    std::apply([&](const auto&... effect) { ((effect.active ? place(effect) : void()), ...); },
               all_);
  }

 private:
  Catalogue<Scalar> all_{};
};

}  // namespace ehsid::plant
