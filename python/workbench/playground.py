# SPDX-License-Identifier: MIT
"""The playground without its page: rigs, effects and their ranges, and a run beside another."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

import ehsid
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.catalogue.parameters import acts_on, effects
from ehsid.harness.catalogue.spellings import ParameterKey
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig
from ehsid.harness.signals.excitation import named_signal
from ehsid.harness.signals.simulation import command_limit, inside_stroke, simulate

DURATION_S, DT_S = 4.0, 1e-3
TOP_HZ = 10.0  # of the test signals: what a servo of usual size follows in part
LARGEST_V = 10.0  # of a drive that has no rated command
STEPS = 40  # of a slider
# A range that begins at nothing and reaches far beyond the typical size has equal factors between
# its steps; the first one above nothing is so small beside the typical size.
FAR, SMALL = 10.0, 0.02
SUBSYSTEMS = ("valve", "hydraulics", "mechanics", "sensor", "timing")


def effects_of(plant: str) -> dict[str, list[ehsid.EffectInfo]]:
    """Returns the effects that a plant can have, by their subsystem."""
    found = [effect for effect in effects().values() if acts_on(effect, plant)]
    return {
        name: [effect for effect in found if effect.subsystem == name]
        for name in SUBSYSTEMS
        if any(effect.subsystem == name for effect in found)
    }


def slider_values(parameter: ehsid.PlantParameter) -> FloatArray:
    """Returns the sizes at which a slider stops: the range of the catalogue, the typical one too.

    Where the range reaches over decades, the factors between the sizes are equal, otherwise their
    differences.
    """
    low, high, typical = parameter.minimum, parameter.maximum, parameter.typical
    if low >= 0.0 and typical > 0.0 and high > FAR * typical:
        first = low if low > 0.0 else SMALL * typical
        sizes = np.geomspace(first, high, STEPS)
    else:
        sizes = np.linspace(low, high, STEPS + 1)
    return np.unique(np.append(sizes, [low, typical]))


def typical_sizes(effect: ehsid.EffectInfo, rig: Rig) -> dict[str, float]:
    """Returns the sizes with which an effect begins: those of the rig, otherwise typical ones."""
    keys = {
        ParameterKey.of_effect(effect.id, parameter.name): parameter
        for parameter in effect.parameters
    }
    return {key: rig.values.get(key, parameter.typical) for key, parameter in keys.items()}


def excitation(rig: Rig, name: str, share: float, seed: int = 0) -> FloatArray:
    """Returns a command of `DURATION_S` that keeps the rod of the rig inside its stroke, V.

    Parameters
    ----------
    rig
        the machine without the effects that are tried.
    name
        of a test signal.
    share
        peak as a share of the rated command, 0 to 1.
    seed
        of the random numbers.
    """
    limit = command_limit(rig)
    peak = share * (limit if math.isfinite(limit) else LARGEST_V)
    count = round(DURATION_S / DT_S)
    command = named_signal(name, count, DT_S, peak=peak, top_hz=TOP_HZ, seed=seed)
    return inside_stroke(rig, command, DT_S)


@dataclass(frozen=True, eq=False)
class Beside:
    """Two runs on the same command."""

    without: Record
    having: Record
    """Records of the rig as it is, and with the effects."""
    seconds: float
    """That the simulation of the run with the effects took."""


def beside(rig: Rig, sizes: dict[str, float], without: Record) -> Beside:
    """Simulates the rig with effects on the command of a run without them.

    Raises
    ------
    RigError, SimulationError
        the sizes contradict each other, or the rig cannot be simulated with them.
    """
    began = time.perf_counter()
    if not sizes:
        return Beside(without, without, 0.0)
    run = simulate(rig.with_values(sizes), without.column("command_v"), dt_s=DT_S)
    return Beside(without, run.record, time.perf_counter() - began)
