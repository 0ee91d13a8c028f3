# SPDX-License-Identifier: MIT
"""Names for people of the values of a plant, and of what a value without a unit is a share."""

from __future__ import annotations

from types import MappingProxyType

# Names where the words of the id do not say enough. Values of the rig and nuisances have a name
# that stands alone. The size of an effect is named beside its effect.
VALUE_NAMES = MappingProxyType(
    {
        "cylinder.bore_m": "bore of the cylinder",
        "cylinder.rod_m": "diameter of the rod",
        "cylinder.stroke_m": "stroke of the cylinder",
        "cylinder.dead_volume_a_m3": "dead volume of the cap side (A)",
        "cylinder.dead_volume_b_m3": "dead volume of the rod side (B)",
        "load.mass_kg": "mass of the load",
        "load.viscous_friction_n_s_m": "viscous friction of the load",
        "valve.rated_flow_m3_s": "rated flow of the valve",
        "valve.rated_pressure_drop_pa": "pressure drop of the valve at rated flow",
        "valve.rated_command_v": "command of the valve at rated flow",
        "supply.pressure_pa": "supply pressure",
        "supply.tank_pressure_pa": "tank pressure",
        "fluid.bulk_modulus_pa": "bulk modulus of the oil",
        "axis.mass_kg": "mass of the axis",
        "axis.viscous_friction_n_s_m": "viscous friction of the axis",
        "axis.force_per_volt": "force of the drive per volt",
        "linear.spool_gain_1_v": "gain of the spool",
        "linear.flow_gain_m3_s": "flow gain of the valve",
        "linear.flow_pressure_m3_s_pa": "flow lost over load pressure",
        "linear.leakage_m3_s_pa": "leakage over load pressure",
        "linear.area_m2": "area of the piston",
        "linear.volume_m3": "volume of both chambers and lines",
        "linear.bulk_modulus_pa": "bulk modulus of oil and walls",
        "linear.mass_kg": "mass of the load",
        "nuisance.spool_bandwidth_hz": "natural frequency of the spool",
        "nuisance.spool_damping": "damping ratio of the spool",
        "nuisance.spool_slew_1_s": "largest speed of the spool",
        "nuisance.null_bias": "null bias of the valve as delivered",
        "nuisance.edge_rounding": "rounding of the metering edges",
        "nuisance.edge_overlap_sides": "overlap at A beyond that at B",
        "nuisance.edge_overlap_tank": "overlap to tank beyond that from the supply",
        "nuisance.edge_gain_direction": "flow extending beyond retracting",
        "nuisance.edge_gain_sides": "flow at A beyond that at B",
        "nuisance.edge_gain_tank": "flow to tank beyond that from the supply",
        "nuisance.flow_exponent": "exponent of flow over pressure drop",
        "nuisance.laminar_pressure_pa": "pressure drop where the flow turns laminar",
        "nuisance.presliding_m": "give of the seals before they slide",
        "nuisance.sliding_onset_m_s": "speed where the friction has come up",
        "nuisance.free_gas": "free gas in the oil",
        "nuisance.bulk_slope": "rise of the bulk modulus with the pressure",
        "nuisance.atmosphere": "share of the atmosphere on the rod",
        "effects.valve_dead_band_sides.overlap_a": "overlap of the edges that extend the rod",
        "effects.valve_dead_band_sides.overlap_b": "overlap of the edges that retract the rod",
        "effects.external_leakage.coefficient_a_m3_s_pa": "coefficient of the cap side (A)",
        "effects.external_leakage.coefficient_b_m3_s_pa": "coefficient of the rod side (B)",
        "effects.stribeck_friction.coulomb_n": "force at high speed",
        "effects.stribeck_friction.static_n": "force at rest",
        "effects.position_friction.force_n": "force at mid-stroke",
    }
)

_COMMAND = "rated command"
# Of what a value is a share.
SHARE_OF = MappingProxyType(
    {
        "effects.valve_hysteresis.half_width": _COMMAND,
        "effects.spool_stiction.threshold": _COMMAND,
        "effects.valve_null_bias.offset": _COMMAND,
        "effects.valve_flow_saturation.limit": _COMMAND,
        "effects.valve_dead_band.overlap": _COMMAND,
        "effects.valve_dead_band_sides.overlap_a": _COMMAND,
        "effects.valve_dead_band_sides.overlap_b": _COMMAND,
        "effects.entrained_air.volume_fraction": "volume",
        "effects.flexible_load.mass_share": "moved mass",
        "nuisance.null_bias": _COMMAND,
        "nuisance.edge_rounding": _COMMAND,
        "nuisance.edge_overlap_sides": _COMMAND,
        "nuisance.edge_overlap_tank": _COMMAND,
        "nuisance.free_gas": "volume",
    }
)
