# SPDX-License-Identifier: MIT
"""Effects of the simulated machine that may be moved while a run goes on: which, and how far."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

import ehsid
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.catalogue.parameters import acts_on, effects, value_name
from ehsid.harness.catalogue.spellings import ParameterKey
from ehsid.harness.rigs import Rig
from ehsid.harness.show.gap_words import quantity, unit_of

from ..playground import FAR, STEPS

# Each moves the estimate or the traces in its own way. A rig file can have any other.
EFFECTS = (
    "valve_dead_band",
    "valve_lag",
    "internal_leakage",
    "coulomb_friction",
    "transport_delay",
)


def moved(plant: str) -> dict[str, ehsid.EffectInfo]:
    """Returns the effects that a plant can have, by the full name of the size that is moved."""
    found = [effects()[name] for name in EFFECTS]
    return {
        ParameterKey.of_effect(one.id, one.parameters[0].name): one
        for one in found
        if acts_on(one, plant)
    }


def stops(parameter: ehsid.PlantParameter, own: float) -> FloatArray:
    """Returns the sizes at which a slider stops, in order.

    The limits of the catalogue hold for machines of every size: the slider ends at ten times the
    typical size, so that it can be set finely.

    Parameters
    ----------
    parameter
        the size that is moved.
    own
        size that the rig has, at which the slider begins; 0 where it is without the effect.
    """
    low, high = parameter.minimum, min(parameter.maximum, FAR * parameter.typical)
    spaced = np.geomspace if low > 0.0 else np.linspace
    return np.unique(np.append(spaced(low, high, STEPS + 1), own))


def sizes_of(chosen: Mapping[str, float], rig: Rig) -> dict[str, float]:
    """Returns values of the machine for the sizes that were chosen; those of the rig are left out.

    An effect with several sizes takes the others of the rig, or typical ones.
    """
    values: dict[str, float] = {}
    for key, effect in moved(rig.plant).items():
        own = rig.values.get(key, 0.0)
        if chosen.get(key, own) == own:
            continue
        for parameter in effect.parameters:
            name = ParameterKey.of_effect(effect.id, parameter.name)
            values[name] = rig.values.get(name, parameter.typical)
        values[key] = chosen[key]
    return values


def machine_words(values: Mapping[str, float]) -> str:
    """Returns in words how a machine differs from its rig file."""
    told = [f"{value_name(key)} {quantity(size, unit_of(key), 3)}" for key, size in values.items()]
    return "; ".join(told) or "as its rig file says"


def effect_text(values: Mapping[str, float]) -> str:
    """Returns values as the option `--effect` takes them."""
    return " ".join(f"{key.partition('.')[2]}={size!r}" for key, size in values.items())
