# SPDX-License-Identifier: MIT
"""Values and effects of the plant with units and ranges, taken from the compiled simulator.

Names of effects for people, where their ids do not read as words.

Names for people of the values of a plant, and of what a value without a unit is a share.
"""

from __future__ import annotations

from functools import cache
from types import MappingProxyType

import ehsid

from .spellings import ParameterKey

_NAMES = MappingProxyType(
    {
        "coulomb_friction_sides": "Coulomb friction by direction",
        "makeup_check": "make-up valve",
        "valve_dead_band_sides": "unequal valve dead band",
    }
)


def effect_name(identifier: str) -> str:
    """Returns an id in words; names of people begin with a capital letter."""
    words = _NAMES.get(identifier, identifier.replace("_", " "))
    return words.replace("coulomb", "Coulomb").replace("stribeck", "Stribeck")


# Subsystems that a plant does not have. A motor needs neither valve nor oil. In the linear model,
# two constants describe the oil completely.
LACKS = MappingProxyType(
    {"ehs": (), "axis": ("valve", "hydraulics"), "linear": ("hydraulics",)},
)
PLANTS = tuple(LACKS)


@cache
def plant_parameters() -> MappingProxyType[str, ehsid.PlantParameter]:
    """Returns every parameter of the plant by its full name, in the order of the plant."""
    return MappingProxyType({p.name: p for p in ehsid.plant_parameters()})


@cache
def parameter_keys() -> tuple[ParameterKey, ...]:
    """Returns the names of all parameters of the plant, in its order."""
    return tuple(ParameterKey(p.name) for p in ehsid.plant_parameters())


@cache
def effects() -> MappingProxyType[str, ehsid.EffectInfo]:
    """Returns the catalogue of effects by effect id."""
    return MappingProxyType({effect.id: effect for effect in ehsid.effects()})


def belongs_to(name: str, plant: str) -> bool:
    """Returns whether the plant needs this value of the rig."""
    key = ParameterKey(name)
    # The plant "ehs" has several sections, each of the others has one section of its own name.
    owner = key.section if key.section in PLANTS else "ehs"
    return key.is_rig_value and owner == plant


def acts_on(effect: ehsid.EffectInfo, plant: str) -> bool:
    """Returns whether the plant has the subsystem on which the effect acts."""
    return effect.subsystem not in LACKS[plant]


def names_of(effect: ehsid.EffectInfo) -> list[ParameterKey]:
    """Returns the full names of the parameters of an effect."""
    return [ParameterKey.of_effect(effect.id, parameter.name) for parameter in effect.parameters]


# Relative 1-sigma of a value from a data sheet or drawing, if the rig file gives no uncertainty.
# Dimensions are known well, masses less well, flow and friction roughly, the stiffness of the oil
# hardly at all.
DEFAULT_UNCERTAINTY = MappingProxyType(
    {
        "cylinder.bore_m": 0.002,
        "cylinder.rod_m": 0.002,
        "cylinder.stroke_m": 0.002,
        "cylinder.dead_volume_a_m3": 0.2,
        "cylinder.dead_volume_b_m3": 0.2,
        "load.mass_kg": 0.05,
        "load.viscous_friction_n_s_m": 0.5,
        "valve.rated_flow_m3_s": 0.1,
        # These two values define the operating point of the rated flow, so they are nearly exact.
        "valve.rated_pressure_drop_pa": 0.001,
        "valve.rated_command_v": 0.001,
        "supply.pressure_pa": 0.03,
        "supply.tank_pressure_pa": 0.5,
        "fluid.bulk_modulus_pa": 0.3,
        "axis.mass_kg": 0.05,
        "axis.viscous_friction_n_s_m": 0.5,
        "axis.force_per_volt": 0.05,
        # These take the uncertainty of the values of the servo that they represent. The spool gain
        # is nearly exact, because the spool position is the unit to which the flow gain refers.
        "linear.spool_gain_1_v": 0.001,
        "linear.flow_gain_m3_s": 0.1,
        "linear.flow_pressure_m3_s_pa": 0.5,
        "linear.leakage_m3_s_pa": 0.5,
        "linear.area_m2": 0.004,
        "linear.volume_m3": 0.2,
        "linear.bulk_modulus_pa": 0.3,
        "linear.mass_kg": 0.05,
    }
)

# The rig file states that the effect exists, but its size is only a guess.
DEFAULT_EFFECT_UNCERTAINTY = 0.3


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
