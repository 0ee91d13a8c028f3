# SPDX-License-Identifier: MIT
"""Which values a rig has, with units and ranges: read off the compiled plant, told nowhere else."""

from __future__ import annotations

from functools import cache
from types import MappingProxyType

import ehsid

EFFECT_PREFIX = "effects."
NUISANCE_PREFIX = "nuisance."
INITIAL_PREFIX = "initial."

# Subsystems that a plant does not have: a motor needs neither valve nor oil, and in the linear
# model the oil has its two constants and no more.
LACKS = MappingProxyType(
    {"ehs": (), "axis": ("valve", "hydraulics"), "linear": ("hydraulics",)},
)
PLANTS = tuple(LACKS)


@cache
def plant_parameters() -> MappingProxyType[str, ehsid.PlantParameter]:
    """Every parameter of the plant by its full name, in the order of the plant."""
    return MappingProxyType({p.name: p for p in ehsid.plant_parameters()})


@cache
def effects() -> MappingProxyType[str, ehsid.EffectInfo]:
    """The catalogue by id."""
    return MappingProxyType({effect.id: effect for effect in ehsid.effects()})


def is_rig_value(name: str) -> bool:
    """Is it a number of the machine, not of an effect, a nuisance or the start?"""
    return not name.startswith((EFFECT_PREFIX, NUISANCE_PREFIX, INITIAL_PREFIX))


def belongs_to(name: str, plant: str) -> bool:
    """Does the plant need this value of the rig?"""
    section = name.partition(".")[0]
    # "ehs" has several sections, the others one of their own name.
    owner = section if section in PLANTS else "ehs"
    return is_rig_value(name) and owner == plant


def acts_on(effect: ehsid.EffectInfo, plant: str) -> bool:
    """Has the plant the subsystem of the effect?"""
    return effect.subsystem not in LACKS[plant]


def names_of(effect: ehsid.EffectInfo) -> list[str]:
    """Full names of its parameters."""
    return [f"{EFFECT_PREFIX}{effect.id}.{parameter.name}" for parameter in effect.parameters]


# Relative 1-sigma of what a data sheet or a drawing says, where the rig file does not tell:
# dimensions are known, masses nearly, flow and friction roughly, the oil's stiffness hardly.
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
        # The point for which the rated flow is given: two definitions.
        "valve.rated_pressure_drop_pa": 0.001,
        "valve.rated_command_v": 0.001,
        "supply.pressure_pa": 0.03,
        "supply.tank_pressure_pa": 0.5,
        "fluid.bulk_modulus_pa": 0.3,
        "axis.mass_kg": 0.05,
        "axis.viscous_friction_n_s_m": 0.5,
        "axis.force_per_volt": 0.05,
        # As those of the servo they stand for; the spool is the unit of the flow.
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

# An effect that is told is known to exist; its size is a guess.
DEFAULT_EFFECT_UNCERTAINTY = 0.3
