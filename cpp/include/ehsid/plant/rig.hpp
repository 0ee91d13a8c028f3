// SPDX-License-Identifier: MIT
// What the simulator must know about the machine, besides its effects: names, units and ranges, in the order in which
// the plant reads the values. Nuisances are what every real servo has and no data sheet gives.
#pragma once

#include <ehsid/plant/effect.hpp>

#include <array>
#include <cstddef>
#include <limits>
#include <vector>

namespace ehsid::plant {

enum class RigValue : std::size_t {
  bore,
  rod,
  stroke,
  dead_volume_a,
  dead_volume_b,
  mass,
  viscous_friction,
  rated_flow,
  rated_pressure_drop,
  rated_command,
  supply_pressure,
  tank_pressure,
  bulk_modulus,
  axis_mass,
  axis_viscous_friction,
  force_per_volt,
  linear_spool_gain,
  linear_flow_gain,
  linear_flow_pressure,
  linear_leakage,
  linear_area,
  linear_volume,
  linear_bulk_modulus,
  linear_mass,
  count
};

/// `typical` is the value of the bench of the reference experiment, as far as it is known.
inline constexpr std::array<ParameterInfo, static_cast<std::size_t>(RigValue::count)> kRigValues{{
    {"cylinder.bore_m", "m", 1e-3, 2.0, 0.063, "diameter of the piston"},
    {"cylinder.rod_m", "m", 0.0, 1.9, 0.035, "diameter of the rod"},
    {"cylinder.stroke_m", "m", 1e-3, 20.0, 0.3, "from end to end"},
    {"cylinder.dead_volume_a_m3", "m^3", 1e-9, 1.0, 2.5e-4, "cap side, at position zero"},
    {"cylinder.dead_volume_b_m3", "m^3", 1e-9, 1.0, 2.5e-4, "rod side, fully extended"},
    {"load.mass_kg", "kg", 1e-2, 1e6, 120.0, "moved mass"},
    {"load.viscous_friction_n_s_m", "N s/m", 0.0, 1e7, 900.0, "force over speed"},
    {"valve.rated_flow_m3_s", "m^3/s", 1e-7, 1.0, 6.33e-4,
     "across one metering edge, rated command"},
    {"valve.rated_pressure_drop_pa", "Pa", 1e4, 1e8, 3.5e6, "across one metering edge"},
    {"valve.rated_command_v", "V", 1e-3, 1e3, 10.0, "full opening"},
    {"supply.pressure_pa", "Pa", 1e5, 1e8, 12e6, "absolute, at no flow"},
    {"supply.tank_pressure_pa", "Pa", 1e4, 1e7, 2e5, "absolute"},
    {"fluid.bulk_modulus_pa", "Pa", 1e7, 5e9, 1.1e9, "without air"},
    {"axis.mass_kg", "kg", 1e-3, 1e6, 95.0, "moved mass"},
    {"axis.viscous_friction_n_s_m", "N s/m", 0.0, 1e7, 205.0, "force over speed"},
    {"axis.force_per_volt", "N/V", 1e-6, 1e6, 35.15, "gain of the drive"},
    {"linear.spool_gain_1_v", "1/V", 1e-3, 1e3, 0.1, "K_v: share of full opening per volt"},
    {"linear.flow_gain_m3_s", "m^3/s", 1e-7, 1.0, 8e-4, "K_q: flow at full opening and no load"},
    {"linear.flow_pressure_m3_s_pa", "m^3/(s Pa)", 0.0, 1e-8, 5e-12, "K_c: flow lost over load"},
    {"linear.leakage_m3_s_pa", "m^3/(s Pa)", 0.0, 1e-8, 1e-12, "C_p: leakage over load"},
    {"linear.area_m2", "m^2", 1e-6, 4.0, 2.6e-3, "A_p: area of the piston"},
    {"linear.volume_m3", "m^3", 1e-8, 10.0, 1.3e-3, "V_t: both chambers and lines"},
    {"linear.bulk_modulus_pa", "Pa", 1e7, 5e9, 1.1e9, "beta_e: of oil and walls"},
    {"linear.mass_kg", "kg", 1e-2, 1e6, 120.0, "M_t: moved mass"},
}};

enum class Nuisance : std::size_t {
  spool_bandwidth,
  spool_damping,
  spool_slew,
  null_bias,
  edge_rounding,
  edge_overlap_sides,
  edge_overlap_tank,
  edge_gain_direction,
  edge_gain_sides,
  edge_gain_tank,
  flow_exponent,
  laminar_pressure,
  presliding,
  sliding_onset,
  free_gas,
  bulk_slope,
  atmosphere,
  count
};

/// `typical` is the value where nothing is known. A spool bandwidth of zero switches the hidden spool off.
inline constexpr std::array<ParameterInfo, static_cast<std::size_t>(Nuisance::count)> kNuisances{{
    {"nuisance.spool_bandwidth_hz", "Hz", 100.0, 1000.0, 250.0,
     "hidden spool, where no valve_lag is configured"},
    {"nuisance.spool_damping", "1", 0.4, 1.5, 0.9, "of the hidden spool"},
    {"nuisance.spool_slew_1_s", "1/s", 30.0, 10000.0, 3000.0,
     "largest speed of the spool, full openings a second"},
    {"nuisance.null_bias", "1", -0.004, 0.004, 0.0,
     "hydraulic null away from electric null, as delivered"},
    {"nuisance.edge_rounding", "1", 1e-4, 0.03, 2e-3, "width of the rounded metering edges"},
    {"nuisance.edge_overlap_sides", "1", -0.02, 0.02, 0.0,
     "overlap of both edges at A beyond the common one; less at B"},
    {"nuisance.edge_overlap_tank", "1", -0.02, 0.02, 0.0,
     "overlap of both edges to tank beyond the common one; less from the supply"},
    {"nuisance.edge_gain_direction", "1", -0.1, 0.1, 0.0,
     "flow of the edges that extend, relative; less of those that retract"},
    {"nuisance.edge_gain_sides", "1", -0.1, 0.1, 0.0, "the same of the edges at A; less at B"},
    {"nuisance.edge_gain_tank", "1", -0.1, 0.1, 0.0,
     "the same of the edges to tank; less from the supply"},
    {"nuisance.flow_exponent", "1", 0.45, 0.6, 0.5, "flow over pressure drop, turbulent"},
    {"nuisance.laminar_pressure_pa", "Pa", 1e2, 5e5, 2e4,
     "pressure drop where the flow turns laminar"},
    {"nuisance.presliding_m", "m", 1e-6, 5e-4, 2e-5, "give of the seals before they slide"},
    {"nuisance.sliding_onset_m_s", "m/s", 1e-6, 3e-3, 1e-5, "speed where friction has come up"},
    {"nuisance.free_gas", "1", 1e-6, 5e-4, 2e-5,
     "volume of gas come out of the oil, at atmospheric pressure"},
    {"nuisance.bulk_slope", "1", -5.0, 15.0, 0.0,
     "rise of the bulk modulus with the pressure, about half the supply pressure"},
    {"nuisance.atmosphere", "1", 0.0, 1.0, 1.0,
     "share of the atmosphere on the rod; 0 where pressures are gauge pressures"},
}};

enum class Initial : std::size_t { position, velocity, pressure_a, pressure_b, count };

/// NaN pressures are those of equilibrium.
inline constexpr std::array<ParameterInfo, static_cast<std::size_t>(Initial::count)> kInitials{{
    {"initial.position_m", "m", 0.0, 20.0, 0.15, "of the rod, from the cap end"},
    {"initial.velocity_m_s", "m/s", -10.0, 10.0, 0.0, "of the rod"},
    {"initial.pressure_a_pa", "Pa", 1e3, 1e8, std::numeric_limits<double>::quiet_NaN(), "cap side"},
    {"initial.pressure_b_pa", "Pa", 1e3, 1e8, std::numeric_limits<double>::quiet_NaN(), "rod side"},
}};

template <class Scalar>
Scalar value_at(const std::vector<Scalar>& values, RigValue which) {
  return values[static_cast<std::size_t>(which)];
}
template <class Scalar>
Scalar value_at(const std::vector<Scalar>& values, Nuisance which) {
  return values[kRigValues.size() + static_cast<std::size_t>(which)];
}
template <class Scalar>
Scalar value_at(const std::vector<Scalar>& values, Initial which) {
  return values[kRigValues.size() + kNuisances.size() + static_cast<std::size_t>(which)];
}

/// Where the parameters of the effects begin.
inline constexpr std::size_t kFirstOfEffects =
    kRigValues.size() + kNuisances.size() + kInitials.size();

}  // namespace ehsid::plant
