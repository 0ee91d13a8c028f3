# SPDX-License-Identifier: MIT
"""Effects of the catalogue: how their sizes are drawn for a machine, and how they change it.

Names and parameters are those of the diagnosis; the equations in which they act are not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from .nominal_rig import NominalRig, spread
from .structure import balance, with_friction
from .truth import Truth

Sizes = Mapping[str, float]


@dataclass(frozen=True)
class Effect:
    """An effect that the generator can put into a machine.

    `draw` draws sizes for a rig file. `put` puts them into a machine; its last argument is the
    deflection of the friction's bristles before they slide, m.
    """

    subsystem: str
    draw: Callable[[np.random.Generator, NominalRig], dict[str, float]]
    put: Callable[[Truth, Sizes, float], Truth]
    axis: bool = False  # it acts on a motor-driven axis, too


def signed(rng: np.random.Generator, low: float, high: float) -> float:
    """Draws a number between low and high, with either sign."""
    return float(rng.choice([-1.0, 1.0]) * rng.uniform(low, high))


def full_flow(rig: NominalRig) -> float:
    """Flow at full opening and half the pressure difference of supply and tank, m^3/s."""
    v = rig.values
    drop = 0.5 * (v["supply.pressure_pa"] - v["supply.tank_pressure_pa"])
    return v["valve.rated_flow_m3_s"] * math.sqrt(drop / v["valve.rated_pressure_drop_pa"])


def _dead_band(machine: Truth, sizes: Sizes, _: float) -> Truth:
    lap = sizes["overlap"]
    return machine._replace(
        overlap_pa=machine.overlap_pa + lap,
        overlap_at=machine.overlap_at + lap,
        overlap_pb=machine.overlap_pb + lap,
        overlap_bt=machine.overlap_bt + lap,
    )


def _saturation(machine: Truth, sizes: Sizes, _: float) -> Truth:
    return machine._replace(opening_limit=sizes["limit"])


def _external_leakage(machine: Truth, sizes: Sizes, _: float) -> Truth:
    return machine._replace(
        leak_a_m3_s_pa=sizes["coefficient_a_m3_s_pa"],
        leak_b_m3_s_pa=sizes["coefficient_b_m3_s_pa"],
    )


def _air(machine: Truth, sizes: Sizes, _: float) -> Truth:
    machine = machine._replace(gas_fraction=machine.gas_fraction + sizes["volume_fraction"])
    return machine._replace(balance_pa=balance(machine))


def _droop(machine: Truth, sizes: Sizes, _: float) -> Truth:
    return machine._replace(
        source_resistance_pa_s_m3=sizes["source_resistance_pa_s_m3"],
        accumulator_m3_pa=sizes["accumulator_capacitance_m3_pa"],
    )


def _draw_droop(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    resistance = rng.uniform(0.1, 0.35) * rig.values["supply.pressure_pa"] / full_flow(rig)
    return {
        "source_resistance_pa_s_m3": float(resistance),
        "accumulator_capacitance_m3_pa": spread(rng, 5e-3, 1e-1) / float(resistance),
    }


def _coulomb(machine: Truth, sizes: Sizes, bristle_m: float) -> Truth:
    return with_friction(machine, sizes["force_n"], sizes["force_n"], 0.02, bristle_m)


def _stribeck(machine: Truth, sizes: Sizes, bristle_m: float) -> Truth:
    return with_friction(
        machine, sizes["coulomb_n"], sizes["static_n"], sizes["stribeck_velocity_m_s"], bristle_m
    )


def _draw_stribeck(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    coulomb = rig.force_n * rng.uniform(0.015, 0.05)
    return {
        "coulomb_n": float(coulomb),
        "static_n": float(coulomb * rng.uniform(1.5, 2.2)),
        "stribeck_velocity_m_s": rig.speed_m_s * spread(rng, 0.02, 0.08),
    }


def _spring(machine: Truth, sizes: Sizes, _: float) -> Truth:
    return machine._replace(
        spring_n_m=sizes["stiffness_n_m"], load_n=sizes["force_at_mid_stroke_n"]
    )


def _draw_spring(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    return {
        "stiffness_n_m": rig.force_n * float(rng.uniform(0.06, 0.2)) / (0.5 * rig.stroke_m),
        "force_at_mid_stroke_n": rig.force_n * signed(rng, 0.0, 0.05),
    }


CATALOGUE: Mapping[str, Effect] = {
    "valve_dead_band": Effect(
        "valve", lambda rng, rig: {"overlap": float(rng.uniform(0.02, 0.06))}, _dead_band
    ),
    "valve_hysteresis": Effect(
        "valve",
        lambda rng, rig: {"half_width": float(rng.uniform(0.01, 0.05))},
        lambda machine, sizes, _: machine._replace(play=sizes["half_width"]),
    ),
    "valve_null_bias": Effect(
        "valve",
        lambda rng, rig: {"offset": signed(rng, 0.01, 0.05)},
        lambda machine, sizes, _: machine._replace(null_bias=sizes["offset"]),
    ),
    "valve_lag": Effect(
        "valve",
        lambda rng, rig: {
            "bandwidth_hz": float(rng.uniform(15.0, 40.0)),
            "damping": float(rng.uniform(0.5, 1.0)),
        },
        lambda machine, sizes, _: machine._replace(
            spool_rad_s=2.0 * math.pi * sizes["bandwidth_hz"], spool_damping=sizes["damping"]
        ),
    ),
    "valve_flow_saturation": Effect(
        "valve", lambda rng, rig: {"limit": float(rng.uniform(0.3, 0.8))}, _saturation
    ),
    "internal_leakage": Effect(
        "hydraulics",
        lambda rng, rig: {
            "coefficient_m3_s_pa": spread(rng, 0.15, 0.6)
            * full_flow(rig)
            / rig.values["supply.pressure_pa"]
        },
        lambda machine, sizes, _: machine._replace(leak_ab_m3_s_pa=sizes["coefficient_m3_s_pa"]),
    ),
    "external_leakage": Effect(
        "hydraulics",
        lambda rng, rig: {
            f"coefficient_{side}_m3_s_pa": spread(rng, 0.03, 0.15)
            * full_flow(rig)
            / (0.5 * rig.values["supply.pressure_pa"])
            for side in "ab"
        },
        _external_leakage,
    ),
    "entrained_air": Effect(
        "hydraulics", lambda rng, rig: {"volume_fraction": spread(rng, 0.005, 0.03)}, _air
    ),
    "supply_droop": Effect("hydraulics", _draw_droop, _droop),
    "coulomb_friction": Effect(
        "mechanics",
        lambda rng, rig: {"force_n": rig.force_n * float(rng.uniform(0.02, 0.08))},
        _coulomb,
        axis=True,
    ),
    "stribeck_friction": Effect("mechanics", _draw_stribeck, _stribeck, axis=True),
    "load_spring": Effect("mechanics", _draw_spring, _spring, axis=True),
    "load_force": Effect(
        "mechanics",
        lambda rng, rig: {"force_n": rig.force_n * signed(rng, 0.03, 0.12)},
        lambda machine, sizes, _: machine._replace(load_n=sizes["force_n"]),
        axis=True,
    ),
    "transport_delay": Effect(
        "timing",
        lambda rng, rig: {"delay_s": round(float(rng.uniform(2e-3, 1e-2)), 4)},
        lambda machine, sizes, _: machine._replace(delay_s=sizes["delay_s"]),
        axis=True,
    ),
    "sensor_lag": Effect(
        "sensor",
        lambda rng, rig: {"time_constant_s": float(rng.uniform(2e-3, 1e-2))},
        lambda machine, sizes, _: machine._replace(sensor_lag_s=sizes["time_constant_s"]),
        axis=True,
    ),
    "sensor_quantisation": Effect(
        "sensor",
        lambda rng, rig: {"step_m": float(f"{rig.stroke_m / 0.3 * spread(rng, 5e-5, 2e-4):.2g}")},
        lambda machine, sizes, _: machine._replace(sensor_step_m=sizes["step_m"]),
        axis=True,
    ),
    "sensor_backlash": Effect(
        "sensor",
        lambda rng, rig: {"half_width_m": rig.stroke_m / 0.3 * spread(rng, 5e-5, 3e-4)},
        lambda machine, sizes, _: machine._replace(sensor_play_m=sizes["half_width_m"]),
        axis=True,
    ),
}

# Pairs that are not drawn together: one effect contains the other, or both set the same field.
EXCLUSIVE_PAIRS = (
    frozenset({"coulomb_friction", "stribeck_friction"}),
    frozenset({"load_spring", "load_force"}),
)
