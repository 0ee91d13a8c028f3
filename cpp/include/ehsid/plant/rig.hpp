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

namespace priors {

/// A value of the rig whose data sheet or drawing is right to this relative deviation. Dimensions are known well, masses
/// less well, flow and friction roughly, the stiffness of the oil hardly at all. A value of the linear servo has the
/// deviation of the values that it stands for.
constexpr Prior known(double sigma) { return {sigma}; }
/// The same of a value that no fit moves.
constexpr Prior held(double sigma) { return {sigma, false, true}; }
/// A nuisance about its typical value, in its own unit. A few of these deviations reach the ends of its range, so that
/// it cannot hide an effect.
constexpr Prior spread(double sigma) { return {sigma}; }
/// The same of its logarithm.
constexpr Prior factor(double sigma) { return {sigma, true}; }
constexpr Prior between(double low, double high, Prior prior) {
  prior.low = low;
  prior.high = high;
  return prior;
}

}  // namespace priors

/// `typical` is the value of the bench of the reference experiment, as far as it is known.
inline constexpr std::array<ParameterInfo, static_cast<std::size_t>(RigValue::count)> kRigValues{{
    {"cylinder.bore_m", "m", 1e-3, 2.0, 0.063, "diameter of the piston", 1.0,
     "bore of the cylinder", "", priors::held(0.002)},
    {"cylinder.rod_m", "m", 0.0, 1.9, 0.035, "diameter of the rod", 1.0, "diameter of the rod", "",
     priors::held(0.002)},
    {"cylinder.stroke_m", "m", 1e-3, 20.0, 0.3, "from end to end", 1.0, "stroke of the cylinder",
     "", priors::held(0.002)},
    {"cylinder.dead_volume_a_m3", "m^3", 1e-9, 1.0, 2.5e-4, "cap side, at position zero", 1.0,
     "dead volume of the cap side (A)", "", priors::known(0.2)},
    {"cylinder.dead_volume_b_m3", "m^3", 1e-9, 1.0, 2.5e-4, "rod side, fully extended", 1.0,
     "dead volume of the rod side (B)", "", priors::known(0.2)},
    {"load.mass_kg", "kg", 1e-2, 1e6, 120.0, "moved mass", 1.0, "mass of the load", "",
     priors::known(0.05)},
    {"load.viscous_friction_n_s_m", "N s/m", 0.0, 1e7, 900.0, "force over speed", 1.0,
     "viscous friction of the load", "", priors::known(0.5)},
    {"valve.rated_flow_m3_s", "m^3/s", 1e-7, 1.0, 6.33e-4,
     "across one metering edge, rated command", 1.0, "rated flow of the valve", "",
     priors::known(0.1)},
    {"valve.rated_pressure_drop_pa", "Pa", 1e4, 1e8, 3.5e6, "across one metering edge", 1.0,
     "pressure drop of the valve at rated flow", "", priors::held(0.001)},
    {"valve.rated_command_v", "V", 1e-3, 1e3, 10.0, "full opening", 1.0,
     "command of the valve at rated flow", "", priors::held(0.001)},
    {"supply.pressure_pa", "Pa", 1e5, 1e8, 12e6, "absolute, at no flow", 1.0, "supply pressure", "",
     priors::known(0.03)},
    {"supply.tank_pressure_pa", "Pa", 1e4, 1e7, 2e5, "absolute", 1.0, "tank pressure", "",
     priors::held(0.5)},
    {"fluid.bulk_modulus_pa", "Pa", 1e7, 5e9, 1.1e9, "without air", 1.0, "bulk modulus of the oil",
     "", priors::known(0.3)},
    {"axis.mass_kg", "kg", 1e-3, 1e6, 95.0, "moved mass", 1.0, "mass of the axis", "",
     priors::known(0.05)},
    {"axis.viscous_friction_n_s_m", "N s/m", 0.0, 1e7, 205.0, "force over speed", 1.0,
     "viscous friction of the axis", "", priors::known(0.5)},
    {"axis.force_per_volt", "N/V", 1e-6, 1e6, 35.15, "gain of the drive", 1.0,
     "force of the drive per volt", "", priors::known(0.05)},
    {"linear.spool_gain_1_v", "1/V", 1e-3, 1e3, 0.1, "K_v: share of full opening per volt", 1.0,
     "gain of the spool", "", priors::known(0.001)},
    {"linear.flow_gain_m3_s", "m^3/s", 1e-7, 1.0, 8e-4, "K_q: flow at full opening and no load",
     1.0, "flow gain of the valve", "", priors::known(0.1)},
    {"linear.flow_pressure_m3_s_pa", "m^3/(s Pa)", 0.0, 1e-8, 5e-12, "K_c: flow lost over load",
     1.0, "flow lost over load pressure", "", priors::known(0.5)},
    {"linear.leakage_m3_s_pa", "m^3/(s Pa)", 0.0, 1e-8, 1e-12, "C_p: leakage over load", 1.0,
     "leakage over load pressure", "", priors::known(0.5)},
    {"linear.area_m2", "m^2", 1e-6, 4.0, 2.6e-3, "A_p: area of the piston", 1.0,
     "area of the piston", "", priors::known(0.004)},
    {"linear.volume_m3", "m^3", 1e-8, 10.0, 1.3e-3, "V_t: both chambers and lines", 1.0,
     "volume of both chambers and lines", "", priors::known(0.2)},
    {"linear.bulk_modulus_pa", "Pa", 1e7, 5e9, 1.1e9, "beta_e: of oil and walls", 1.0,
     "bulk modulus of oil and walls", "", priors::known(0.3)},
    {"linear.mass_kg", "kg", 1e-2, 1e6, 120.0, "M_t: moved mass", 1.0, "mass of the load", "",
     priors::known(0.05)},
}};

enum class Nuisance : std::size_t {
  spool_bandwidth,
  spool_damping,
  spool_slew,
  null_bias,
  edge_rounding,
  edge_rounding_direction,
  edge_rounding_sides,
  edge_rounding_tank,
  edge_closing,
  edge_overlap,
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
  between_samples,
  count
};

/// `typical` is the value where nothing is known. A spool bandwidth of zero switches the hidden spool off. In a fit, a
/// spool of 130 Hz with a damping of 1.1 has a delay of 2.7 ms; one of 100 Hz with 1.5 would have 5 ms, and only an
/// effect (a lag or a delay) should have that much.
inline constexpr std::array<ParameterInfo, static_cast<std::size_t>(Nuisance::count)> kNuisances{{
    {"nuisance.spool_bandwidth_hz", "Hz", 100.0, 1000.0, 250.0,
     "hidden spool, where no valve_lag is configured", 1.0, "natural frequency of the spool", "",
     priors::between(130.0, 1000.0, priors::factor(0.4))},
    {"nuisance.spool_damping", "1", 0.4, 1.5, 0.9, "of the hidden spool", 1.0,
     "damping ratio of the spool", "", priors::between(0.5, 1.1, priors::spread(0.2))},
    {"nuisance.spool_slew_1_s", "1/s", 30.0, 10000.0, 3000.0,
     "largest speed of the spool, full openings a second", 1.0, "largest speed of the spool", "",
     priors::factor(1.2)},
    {"nuisance.null_bias", "1", -0.004, 0.004, 0.0,
     "hydraulic null away from electric null, as delivered", 1.0,
     "null bias of the valve as delivered", kRatedCommand, priors::spread(0.002)},
    {"nuisance.edge_rounding", "1", 1e-4, 0.03, 2e-3, "width of the rounded metering edges", 1.0,
     "rounding of the metering edges", kRatedCommand, priors::factor(0.7)},
    {"nuisance.edge_rounding_direction", "1", -1.0, 1.0, 0.0,
     "logarithm of the rounding of the edges that extend, beyond the common one; less of those "
     "that retract",
     1.0, "rounding extending beyond retracting, logarithm", "", priors::spread(0.3)},
    {"nuisance.edge_rounding_sides", "1", -1.0, 1.0, 0.0, "the same of the edges at A; less at B",
     1.0, "rounding at A beyond that at B, logarithm", "", priors::spread(0.3)},
    {"nuisance.edge_rounding_tank", "1", -1.0, 1.0, 0.0,
     "the same of the edges to tank; less from the supply", 1.0,
     "rounding to tank beyond that from the supply, logarithm", "", priors::spread(0.3)},
    {"nuisance.edge_closing", "1", 0.0, 1.0, 0.0,
     "0: a closed edge leaks, less the further it is closed; 1: it closes where its rounding ends",
     1.0, "closing of the metering edges", "", priors::spread(0.5)},
    {"nuisance.edge_overlap", "1", -0.004, 0.004, 0.0,
     "overlap of all edges as delivered; less: they are open at null", 1.0,
     "overlap of the metering edges as delivered", kRatedCommand, priors::spread(0.002)},
    {"nuisance.edge_overlap_sides", "1", -0.02, 0.02, 0.0,
     "overlap of both edges at A beyond the common one; less at B", 1.0,
     "overlap at A beyond that at B", kRatedCommand, priors::spread(0.005)},
    {"nuisance.edge_overlap_tank", "1", -0.02, 0.02, 0.0,
     "overlap of both edges to tank beyond the common one; less from the supply", 1.0,
     "overlap to tank beyond that from the supply", kRatedCommand, priors::spread(0.005)},
    {"nuisance.edge_gain_direction", "1", -0.1, 0.1, 0.0,
     "flow of the edges that extend, relative; less of those that retract", 1.0,
     "flow extending beyond retracting", "", priors::spread(0.02)},
    {"nuisance.edge_gain_sides", "1", -0.1, 0.1, 0.0, "the same of the edges at A; less at B", 1.0,
     "flow at A beyond that at B", "", priors::spread(0.02)},
    {"nuisance.edge_gain_tank", "1", -0.1, 0.1, 0.0,
     "the same of the edges to tank; less from the supply", 1.0,
     "flow to tank beyond that from the supply", "", priors::spread(0.02)},
    {"nuisance.flow_exponent", "1", 0.45, 0.6, 0.5, "flow over pressure drop, turbulent", 1.0,
     "exponent of flow over pressure drop", "", priors::spread(0.02)},
    {"nuisance.laminar_pressure_pa", "Pa", 1e2, 5e5, 2e4,
     "pressure drop where the flow turns laminar", 1.0,
     "pressure drop where the flow turns laminar", "", priors::factor(0.7)},
    {"nuisance.presliding_m", "m", 1e-6, 5e-4, 2e-5, "give of the seals before they slide", 1.0,
     "give of the seals before they slide", "", priors::factor(0.5)},
    {"nuisance.sliding_onset_m_s", "m/s", 1e-6, 3e-3, 1e-5, "speed where friction has come up", 1.0,
     "speed where the friction has come up", "", priors::factor(2.0)},
    {"nuisance.free_gas", "1", 1e-6, 5e-4, 2e-5,
     "volume of gas come out of the oil, at atmospheric pressure", 1.0, "free gas in the oil",
     "volume", priors::factor(1.2)},
    {"nuisance.bulk_slope", "1", -5.0, 15.0, 0.0,
     "rise of the bulk modulus with the pressure, about half the supply pressure", 1.0,
     "rise of the bulk modulus with the pressure", "", priors::spread(5.0)},
    {"nuisance.atmosphere", "1", 0.0, 1.0, 1.0,
     "share of the atmosphere on the rod; 0 where pressures are gauge pressures", 1.0,
     "share of the atmosphere on the rod", "", priors::spread(0.5)},
    {"nuisance.between_samples", "1", 0.0, 1.0, 0.0,
     "move of the command towards the next sample; 0: held", 1.0,
     "move of the command between samples", "", priors::spread(0.25)},
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
