# SPDX-License-Identifier: MIT
"""Values and effects of the plant with units and ranges, taken from the compiled simulator."""

from __future__ import annotations

from functools import cache
from types import MappingProxyType

import ehsid

from .keys import ParameterKey

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
