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

#include <tuple>

namespace ehsid::plant {

template <class Scalar>
using Catalogue =
    std::tuple<TransportDelay<Scalar>, ValveHysteresis<Scalar>, ValveLag<Scalar>,
               ValveNullBias<Scalar>, ValveFlowSaturation<Scalar>, ValveDeadBand<Scalar>,
               InternalLeakage<Scalar>, ExternalLeakage<Scalar>, EntrainedAir<Scalar>,
               SupplyDroop<Scalar>, CoulombFriction<Scalar>, StribeckFriction<Scalar>,
               LoadSpring<Scalar>, LoadForce<Scalar>, SensorBacklash<Scalar>, SensorLag<Scalar>,
               SensorQuantisation<Scalar>>;

}  // namespace ehsid::plant
