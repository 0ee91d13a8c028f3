# SPDX-License-Identifier: MIT
"""Effects that came into the catalogue after the pools of the drawn effects.

They are put into machines on request only, so that a seed goes on to make the same machine. Names
and parameters are those of the diagnosis; the equations in which they act are not.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from .effects import Effect, Sizes, full_flow, signed
from .nominal_rig import NominalRig
from .structure import with_friction
from .truth import Truth

BAR_PA = 1e5


def _draw_two_overlaps(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    sides = [float(rng.uniform(0.03, 0.06)), float(rng.uniform(0.0, 0.02))]
    rng.shuffle(sides)
    return {"overlap_a": sides[0], "overlap_b": sides[1]}


def _two_overlaps(machine: Truth, sizes: Sizes, _: float) -> Truth:
    """Edges that extend the rod are those from supply to A and from B to tank."""
    return machine._replace(
        overlap_pa=machine.overlap_pa + sizes["overlap_a"],
        overlap_bt=machine.overlap_bt + sizes["overlap_a"],
        overlap_at=machine.overlap_at + sizes["overlap_b"],
        overlap_pb=machine.overlap_pb + sizes["overlap_b"],
    )


def _draw_friction_by_direction(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    mean, difference = rig.force_n * float(rng.uniform(0.03, 0.06)), signed(rng, 0.3, 0.6)
    return {
        "force_extending_n": mean * (1.0 + difference),
        "force_retracting_n": mean * (1.0 - difference),
    }


def _friction_by_direction(machine: Truth, sizes: Sizes, bristle_m: float) -> Truth:
    extending, retracting = sizes["force_extending_n"], sizes["force_retracting_n"]
    mean = 0.5 * (extending + retracting)
    return with_friction(machine, mean, mean, 0.02, bristle_m)._replace(
        friction_by_direction=(extending - mean) / mean
    )


def _draw_rising_friction(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    force = rig.force_n * float(rng.uniform(0.03, 0.06))
    return {"force_n": force, "rise_n_m": signed(rng, 0.5, 0.9) * force / (0.5 * rig.stroke_m)}


def _rising_friction(machine: Truth, sizes: Sizes, bristle_m: float) -> Truth:
    force = sizes["force_n"]
    return with_friction(machine, force, force, 0.02, bristle_m)._replace(
        friction_rise_1_m=sizes["rise_n_m"] / force
    )


def _draw_flexible_load(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    return {
        "mass_share": float(rng.uniform(0.3, 0.6)),
        "frequency_hz": float(rng.uniform(4.0, 12.0)),
        "damping": float(rng.uniform(0.02, 0.1)),
    }


def _flexible_load(machine: Truth, sizes: Sizes, _: float) -> Truth:
    """Splits the load into two masses; the rig file states the sum of both."""
    mass = sizes["mass_share"] * machine.mass_kg
    natural = 2.0 * math.pi * sizes["frequency_hz"]
    return machine._replace(
        mass_kg=machine.mass_kg - mass,
        second_mass_kg=mass,
        second_spring_n_m=mass * natural**2,
        second_damper_n_s_m=2.0 * sizes["damping"] * mass * natural,
    )


LATER: Mapping[str, Effect] = {
    "valve_dead_band_sides": Effect("valve", _draw_two_overlaps, _two_overlaps),
    "flow_gain_drift": Effect(
        "valve",
        lambda rng, rig: {"rate_1_s": signed(rng, 0.006, 0.015)},
        lambda machine, sizes, _: machine._replace(gain_rate_1_s=sizes["rate_1_s"]),
    ),
    "relief_valve": Effect(
        "hydraulics",
        lambda rng, rig: {
            "pressure_pa": float(rng.uniform(0.55, 0.7)) * rig.values["supply.pressure_pa"],
            "flow_gain_m3_s_pa": float(rng.uniform(1.0, 3.0))
            * full_flow(rig)
            / rig.values["supply.pressure_pa"],
        },
        lambda machine, sizes, _: machine._replace(
            relief_pa=sizes["pressure_pa"], relief_m3_s_pa=sizes["flow_gain_m3_s_pa"]
        ),
    ),
    "makeup_check": Effect(
        "hydraulics",
        lambda rng, rig: {
            "pressure_pa": float(rng.uniform(1e4, 5e4)),
            "flow_gain_m3_s_pa": float(rng.uniform(0.3, 0.8)) * full_flow(rig) / BAR_PA,
        },
        lambda machine, sizes, _: machine._replace(
            makeup_pa=sizes["pressure_pa"], makeup_m3_s_pa=sizes["flow_gain_m3_s_pa"]
        ),
    ),
    "coulomb_friction_sides": Effect(
        "mechanics", _draw_friction_by_direction, _friction_by_direction, axis=True
    ),
    "position_friction": Effect("mechanics", _draw_rising_friction, _rising_friction, axis=True),
    "flexible_load": Effect("mechanics", _draw_flexible_load, _flexible_load, axis=True),
    "sensor_nonlinearity": Effect(
        "sensor",
        lambda rng, rig: {
            "amplitude_m": rig.stroke_m * signed(rng, 0.002, 0.006),
            "period_m": rig.stroke_m * float(rng.uniform(0.1, 0.3)),
        },
        lambda machine, sizes, _: machine._replace(
            scale_wave_m=sizes["amplitude_m"], scale_period_m=sizes["period_m"]
        ),
        axis=True,
    ),
}
