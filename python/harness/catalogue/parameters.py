# SPDX-License-Identifier: MIT
"""Values and effects of the plant, and forgetting policies, taken from the compiled code."""

from __future__ import annotations

import re
from functools import cache
from types import MappingProxyType
from typing import NamedTuple

import ehsid

from .spellings import ParameterKey

_NAMES = MappingProxyType(
    {
        "coulomb_friction_sides": "Coulomb friction by direction",
        "makeup_check": "make-up valve",
        "valve_dead_band_sides": "unequal valve dead band",
    }
)


def plain_name(identifier: str) -> str:
    """Returns an id, or the name of a value, in words; names of people begin with a capital."""
    words = _NAMES.get(identifier, identifier.replace("_", " "))
    words = words.replace("coulomb", "Coulomb").replace("stribeck", "Stribeck")
    return re.sub(r" [ab]\b", lambda side: side[0].upper(), words)


def size_name(name: str) -> str:
    """Returns a full name in words, without the unit, and without the effect that has this size."""
    info = plant_parameters().get(name)
    if info is not None and info.called:
        return info.called
    ending = "" if info is None or info.unit == "1" else "_" + _suffix(info.unit)
    return plain_name(ParameterKey(name).parameter.removesuffix(ending))


def _suffix(unit: str) -> str:
    """Returns the form of a unit at the end of a name, such as "m3_s" for "m^3/s"."""
    return re.sub(r"[/ ]", "_", re.sub(r"[\^()]", "", unit.lower()))


def value_name(name: str) -> str:
    """Returns a full name in words, without the unit; before the size of an effect, the effect."""
    effect = ParameterKey(name).effect
    return size_name(name) if effect is None else f"{plain_name(effect)}: {size_name(name)}"


def name_in_sentence(name: str) -> str:
    """Returns a full name in words; for the size of an effect that has no other, the effect."""
    effect = ParameterKey(name).effect
    if effect is None:
        return size_name(name)
    has_one = len(effects()[effect].parameters) == 1
    return plain_name(effect) if has_one else f"{plain_name(effect)} ({size_name(name)})"


# Subsystems that a plant does not have. A motor needs neither valve nor oil. In the linear model,
# two constants describe the oil completely. What a user's simulator lacks is told by its ports.
LACKS = MappingProxyType(
    {"ehs": (), "axis": ("valve", "hydraulics"), "linear": ("hydraulics",), "simulator": ()},
)
PLANTS = tuple(LACKS)
# What every servo has and can be put in front of a user's simulator.
OUTSIDE_NUISANCES = ("nuisance.null_bias", "nuisance.edge_gain_direction")
# Values of the rig that a user's simulator does not have itself, and that effects are stated with:
# whether a rig file must have them.
OF_SIMULATOR = MappingProxyType(
    {
        "valve.rated_command_v": True,
        "cylinder.stroke_m": False,
        "supply.pressure_pa": False,
        "supply.tank_pressure_pa": False,
    }
)


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
    if plant == "simulator":
        return OF_SIMULATOR.get(name, False)
    # The plant "ehs" has several sections, each of the others has one section of its own name.
    owner = key.section if key.section in PLANTS else "ehs"
    return key.is_rig_value and owner == plant


def may_have(name: str, plant: str) -> bool:
    """Returns whether a rig file of the plant may have this value of the plant."""
    if plant == "simulator":
        key = ParameterKey(name)
        return name in OF_SIMULATOR or name in OUTSIDE_NUISANCES or key.effect is not None
    return belongs_to(name, plant) or not ParameterKey(name).is_rig_value


def acts_on(effect: ehsid.EffectInfo, plant: str) -> bool:
    """Returns whether the plant has that on which the effect acts."""
    return missing_part(effect, plant) is None


def missing_part(effect: ehsid.EffectInfo, plant: str) -> str | None:
    """Returns what the plant lacks, so that the effect cannot act; None where it can."""
    if effect.subsystem in LACKS[plant]:
        return effect.subsystem
    if "hydraulics" in LACKS[plant] and "chamber_pressures" in effect.needs:
        return "chamber pressures"
    return None


def names_of(effect: ehsid.EffectInfo) -> list[ParameterKey]:
    """Returns the full names of the parameters of an effect."""
    return [ParameterKey.of_effect(effect.id, parameter.name) for parameter in effect.parameters]


POLICIES = MappingProxyType({info.id.replace("_", "-"): info for info in ehsid.policies()})

# What a command, a tool or a page takes where nobody chooses. Two policies, because a record can be
# read again and has an end, and a controller runs on and has to follow: docs/estimator.md.
RECORD_POLICY = "exponential"
TARGET_POLICY = "f-ratio"
SERVO_ORDERS = (3, 3, 1)  # na, nb, nk


class Method(NamedTuple):
    """A recursion: its name in words, and the noise that it is right with."""

    words: str
    noise: str


# See docs/which_estimator.md.
METHODS = MappingProxyType(
    {
        "rls": Method("least squares", "white noise in the equation of the model"),
        "riv": Method("instrumental variables", "noise of the position sensor"),
    }
)


def policies_of(method: str) -> tuple[str, ...]:
    """Returns the names of the policies that a recursion takes."""
    return tuple(POLICIES) if method == "rls" else ("constant", "exponential")
