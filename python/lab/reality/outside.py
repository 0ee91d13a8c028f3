# SPDX-License-Identifier: MIT
"""Effects that the catalogue of the diagnosis does not contain."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ehsid.harness.base.arrays import FloatArray

from .effects import Effect, Sizes, full_flow
from .nominal_rig import NominalRig, spread
from .structure import with_friction
from .truth import Truth


def _unchanged(machine: Truth, sizes: Sizes, _: float) -> Truth:
    return machine


def _draw_second_mass(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    total = rig.values["load.mass_kg" if rig.plant == "ehs" else "axis.mass_kg"]
    share = float(rng.uniform(0.3, 0.6))
    natural = 2.0 * math.pi * float(rng.uniform(4.0, 12.0))
    mass = share * total
    return {
        "share": share,
        "spring_n_m": mass * natural**2,
        "damper_n_s_m": 2.0 * float(rng.uniform(0.02, 0.1)) * mass * natural,
    }


def _second_mass(machine: Truth, sizes: Sizes, _: float) -> Truth:
    """Splits the load into two masses; the rig file states the sum of both."""
    return machine._replace(
        mass_kg=(1.0 - sizes["share"]) * machine.mass_kg,
        second_mass_kg=sizes["share"] * machine.mass_kg,
        second_spring_n_m=sizes["spring_n_m"],
        second_damper_n_s_m=sizes["damper_n_s_m"],
    )


def _local_friction(machine: Truth, sizes: Sizes, bristle_m: float) -> Truth:
    """Adds the friction force at one place; elsewhere friction is at least a fiftieth of it."""
    least = max(machine.static_n, 0.02 * sizes["force_n"])
    machine = with_friction(machine, least, least, machine.stribeck_m_s, bristle_m)
    share = sizes["force_n"] / least
    return machine._replace(
        local_share=share,
        local_at_m=sizes["at_m"],
        local_width_m=sizes["width_m"],
        # This keeps the damping ratio at the place where the bristles are stiffest.
        bristle_n_s_m=machine.bristle_n_s_m / math.sqrt(1.0 + share),
    )


OUTSIDE: Mapping[str, Effect] = {
    "second_load_mass": Effect("mechanics", _draw_second_mass, _second_mass, axis=True),
    "supply_ripple": Effect(
        "hydraulics",
        lambda rng, rig: {
            "amplitude": float(rng.uniform(0.06, 0.15)),
            "frequency_hz": float(rng.uniform(4.0, 25.0)),
        },
        lambda machine, sizes, _: machine._replace(
            hum_share=sizes["amplitude"], hum_hz=sizes["frequency_hz"]
        ),
    ),
    "lost_command_frames": Effect(
        "timing",
        lambda rng, rig: {"share": float(rng.uniform(0.15, 0.4)), "burst_s": 0.02},
        _unchanged,
        axis=True,
    ),
    "warming_oil": Effect(
        "hydraulics",
        lambda rng, rig: {
            "viscous": float(rng.uniform(-0.7, -0.5)),
            "bulk": float(rng.uniform(-0.25, -0.15)),
            "leak_m3_s_pa": float(rng.uniform(0.4, 0.8))
            * full_flow(rig)
            / rig.values["supply.pressure_pa"],
        },
        lambda machine, sizes, _: machine._replace(
            warming_viscous=sizes["viscous"],
            warming_bulk=sizes["bulk"],
            warming_leak_m3_s_pa=sizes["leak_m3_s_pa"],
        ),
    ),
    "position_dependent_friction": Effect(
        "mechanics",
        lambda rng, rig: {
            "force_n": rig.force_n * float(rng.uniform(0.06, 0.12)),
            "at_m": rig.stroke_m * float(rng.uniform(0.42, 0.58)),
            "width_m": rig.stroke_m * float(rng.uniform(0.03, 0.07)),
        },
        _local_friction,
        axis=True,
    ),
    "valve_stiction": Effect(
        "valve",
        lambda rng, rig: {"band": float(rng.uniform(0.04, 0.09))},
        lambda machine, sizes, _: machine._replace(stick=sizes["band"]),
    ),
    "drifting_sensor": Effect(
        "sensor",
        lambda rng, rig: {
            "amplitude_m": rig.stroke_m * float(rng.uniform(0.01, 0.02)),
            "period_s": float(rng.uniform(4.0, 10.0)),
        },
        _unchanged,
        axis=True,
    ),
    "spiking_sensor": Effect(
        "sensor",
        lambda rng, rig: {
            "amplitude_m": rig.stroke_m * spread(rng, 0.004, 0.015),
            "rate_1_s": float(rng.uniform(2.0, 6.0)),
        },
        _unchanged,
        axis=True,
    ),
}


@dataclass(frozen=True)
class Faults:
    """Faults that are not in the equations.

    `error`, (n,), is the error of the measured position, m; `lost`, (n,), is true where a
    command is lost.
    """

    error: FloatArray
    lost: npt.NDArray[np.bool_]


def faults(
    effects: Mapping[str, Sizes], rng: np.random.Generator, samples: int, dt_s: float
) -> Faults:
    """Draws sensor drift, sensor spikes and lost frames; each only if it is among the effects."""
    error = np.zeros(samples)
    lost = np.zeros(samples, dtype=np.bool_)
    time = dt_s * np.arange(samples)
    if sizes := effects.get("drifting_sensor"):
        phase = rng.uniform(0.0, 2.0 * math.pi)
        error += sizes["amplitude_m"] * np.sin(2.0 * math.pi * time / sizes["period_s"] + phase)
    if sizes := effects.get("spiking_sensor"):
        for start in np.flatnonzero(rng.random(samples) < sizes["rate_1_s"] * dt_s):
            size = sizes["amplitude_m"] * rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.5)
            error[start : start + int(rng.integers(1, 4))] += size
    if sizes := effects.get("lost_command_frames"):
        # A Markov chain of two states has the given mean length of a burst and share of time.
        leave = min(dt_s / sizes["burst_s"], 1.0)
        enter = leave * sizes["share"] / (1.0 - sizes["share"])
        draws = rng.random(samples)
        state = False
        for k in range(samples):
            state = draws[k] < enter if not state else draws[k] >= leave
            lost[k] = state
    return Faults(error, lost)
