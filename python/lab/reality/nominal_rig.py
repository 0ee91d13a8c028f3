# SPDX-License-Identifier: MIT
"""Values in the rig file; they are drawn first, and the true values are drawn about them.

Rigs of the grade "wide": single and double rods of all sizes and pressures of servo drives.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

PlantKind = Literal["ehs", "axis"]
PLANTS: tuple[PlantKind, ...] = ("ehs", "axis")

# Relative standard deviation that the rig file states, by the full name of the value.
UNCERTAINTY: Mapping[PlantKind, Mapping[str, float]] = {
    "ehs": {
        "valve.rated_flow_m3_s": 0.06,
        "fluid.bulk_modulus_pa": 0.25,
        "load.viscous_friction_n_s_m": 0.25,
        "load.mass_kg": 0.03,
        "cylinder.dead_volume_a_m3": 0.1,
        "cylinder.dead_volume_b_m3": 0.1,
        "supply.pressure_pa": 0.015,
    },
    "axis": {
        "axis.mass_kg": 0.03,
        "axis.viscous_friction_n_s_m": 0.25,
        "axis.force_per_volt": 0.03,
    },
}
LAG = ("effects.valve_lag.bandwidth_hz", "effects.valve_lag.damping")


@dataclass(frozen=True)
class NominalRig:
    """Values by full name, as the rig file states them, and figures that follow from them."""

    plant: PlantKind
    values: Mapping[str, float]
    speed_m_s: float
    """Speed at full opening or full force, without load."""
    force_n: float
    """Largest force of the drive: supply pressure on the piston, or rated command times gain."""
    damping_1_s: float
    """Viscous friction over mass, 1/s; it limits the bandwidth of a position loop."""
    stroke_m: float


def spread(rng: np.random.Generator, low: float, high: float) -> float:
    """Draws a number between low and high; its logarithm is uniformly distributed."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def four_digits(values: Mapping[str, float]) -> dict[str, float]:
    """Returns the values with the four digits of a data sheet."""
    return {name: float(f"{value:.4g}") for name, value in values.items()}


@dataclass(frozen=True)
class Range:
    """Ends of what is drawn, SI; rates and damping ratios as told by `draw_wide_rig`."""

    bore_m: tuple[float, float] = (0.020, 0.100)
    stroke_m: tuple[float, float] = (0.08, 1.0)
    supply_pa: tuple[float, float] = (7e6, 28e6)
    natural_hz: tuple[float, float] = (15.0, 150.0)
    strokes_1_s: tuple[float, float] = (0.3, 4.0)
    rated_flow_m3_s: tuple[float, float] = (5.0 / 60e3, 250.0 / 60e3)  # 5 to 250 l/min
    mass_kg: tuple[float, float] = (1.0, 2e4)
    dead: tuple[float, float] = (0.08, 0.45)
    """Dead volume of a side over the swept one of the cap side."""
    damping: tuple[float, float] = (0.01, 0.3)
    rated_drops_pa: tuple[float, ...] = (3.5e6, 7e6, 0.5e6)
    rated_commands_v: tuple[float, ...] = (10.0, 10.0, 5.0)


def draw_drive(
    rng: np.random.Generator, of: Range, bore: float, rod: float, stroke: float
) -> tuple[NominalRig, float]:
    """Draws what a cylinder of this size drives, and its valve.

    Returns
    -------
    the rig without the lag of its valve, and the frequency of the oil spring at mid-stroke, rad/s.
    """
    area_a = math.pi / 4.0 * bore**2
    area_b = area_a - math.pi / 4.0 * rod**2
    dead_a, dead_b = area_a * stroke * rng.uniform(*of.dead, 2)
    supply, tank = spread(rng, *of.supply_pa), float(rng.choice([1.5e5, 2e5, 3e5]))
    bulk = spread(rng, 0.75e9, 1.4e9)
    # k = B (A_a^2 / V_a + A_b^2 / V_b), at mid-stroke
    stiffness = bulk * (
        area_a**2 / (dead_a + 0.5 * area_a * stroke) + area_b**2 / (dead_b + 0.5 * area_b * stroke)
    )
    natural = 2.0 * math.pi * spread(rng, *of.natural_hz)
    mass = stiffness / natural**2
    viscous = 2.0 * spread(rng, *of.damping) * mass * natural
    speed = stroke * spread(rng, *of.strokes_1_s)
    flow_gain = speed * 0.5 * (area_a + area_b) / math.sqrt(0.5 * (supply - tank))
    rated_drop = float(rng.choice(of.rated_drops_pa))
    values = four_digits(
        {
            "cylinder.bore_m": bore,
            "cylinder.rod_m": rod,
            "cylinder.stroke_m": stroke,
            "cylinder.dead_volume_a_m3": dead_a,
            "cylinder.dead_volume_b_m3": dead_b,
            "load.mass_kg": mass,
            "load.viscous_friction_n_s_m": viscous,
            "valve.rated_flow_m3_s": flow_gain * math.sqrt(rated_drop),
            "valve.rated_pressure_drop_pa": rated_drop,
            "valve.rated_command_v": float(rng.choice(of.rated_commands_v)),
            "supply.pressure_pa": supply,
            "supply.tank_pressure_pa": tank,
            "fluid.bulk_modulus_pa": bulk,
        }
    )
    return NominalRig("ehs", values, speed, supply * area_a, viscous / mass, stroke), natural


def with_lag(
    rng: np.random.Generator, rig: NominalRig, low_hz: float, high_hz: float
) -> NominalRig:
    """Returns the rig, in half of the cases with the lag of its valve, of a bandwidth between."""
    lag = (float(round(spread(rng, low_hz, high_hz))), round(float(rng.uniform(0.7, 1.0)), 2))
    if rng.random() < 0.5:
        return replace(rig, values={**rig.values, **dict(zip(LAG, lag, strict=True))})
    return rig


def draw_nominal_rig(rng: np.random.Generator, plant: PlantKind) -> NominalRig:
    """Draws the values in the rig file of a machine of this kind, of any size."""
    return _draw_axis(rng) if plant == "axis" else _draw_servo(rng)


# Ranges of `draw_nominal_rig`.
PLAIN_RANGE = Range(
    supply_pa=(8e6, 21e6),
    natural_hz=(25.0, 110.0),
    strokes_1_s=(0.6, 2.5),
    dead=(0.13, 0.45),
    damping=(0.008, 0.04),
    rated_drops_pa=(3.5e6, 3.5e6, 0.5e6),
    rated_commands_v=(10.0, 10.0, 10.0, 5.0),
)


def _draw_servo(rng: np.random.Generator) -> NominalRig:
    bore = round(spread(rng, 0.032, 0.125), 3)
    rod = round(bore * rng.uniform(0.5, 0.72), 3)
    stroke = round(max(bore * rng.uniform(3.0, 7.0), 0.12), 2)
    rig, _ = draw_drive(rng, PLAIN_RANGE, bore, rod, stroke)
    has_lag = rng.random() < 0.4
    lag = dict(zip(LAG, (float(round(spread(rng, 50.0, 140.0))), 0.85), strict=True))
    return replace(rig, values={**rig.values, **lag}) if has_lag else rig


def _draw_axis(rng: np.random.Generator) -> NominalRig:
    mass = spread(rng, 2.0, 200.0)
    speed = spread(rng, 0.5, 2.0)
    viscous = mass * spread(rng, 1.0, 6.0)
    force = viscous * speed
    values = four_digits(
        {
            "axis.mass_kg": mass,
            "axis.viscous_friction_n_s_m": viscous,
            "axis.force_per_volt": force / 10.0,
        }
    )
    return NominalRig("axis", values, speed, force, viscous / mass, spread(rng, 0.3, 1.0))


def draw_true_values(
    rng: np.random.Generator, rig: NominalRig, kind: Literal["exact", "within", "moved"]
) -> dict[str, float]:
    """Draws true values about the values in the rig file.

    "exact": the values in the rig file. "within": normally distributed with the stated sigma and
    at most two sigma away. "moved": as "within", but one to three of them are 2 to 3 sigma away.
    """
    sigma = dict(UNCERTAINTY[rig.plant])
    draws = {name: float(np.clip(rng.standard_normal(), -2.0, 2.0)) for name in sigma}
    count = int(rng.integers(1, 4))
    moved = [str(name) for name in rng.permutation(list(sigma))[:count]]
    outliers = {name: float(rng.choice([-1.0, 1.0]) * rng.uniform(2.0, 3.0)) for name in moved}
    lag = float(np.clip(0.1 * rng.standard_normal(), -0.2, 0.2))
    if kind == "moved":
        draws |= outliers
    if kind == "exact":
        return dict(rig.values)
    true_values = {
        name: value * (1.0 + sigma.get(name, 0.0) * draws.get(name, 0.0))
        for name, value in rig.values.items()
    }
    if LAG[0] in true_values:
        true_values[LAG[0]] *= 1.0 + lag
    return true_values


def rig_text(rig: NominalRig, name: str) -> str:
    """Returns the text of the rig file."""
    lines = [f'name = "{name}"', f'plant = "{rig.plant}"']
    section = ""
    effect_lines: list[str] = []
    for full_name, value in rig.values.items():
        section_name, key = full_name.rsplit(".", 1)
        target = effect_lines if section_name.startswith("effects") else lines
        if section_name != section:
            target += ["", f"[{section_name}]"]
            section = section_name
        target.append(f"{key} = {_number(value)}")
    lines += ["", "[uncertainty]"]
    lines += [f'"{full_name}" = {value}' for full_name, value in UNCERTAINTY[rig.plant].items()]
    return "\n".join([*lines, *effect_lines]) + "\n"


def _number(value: float) -> str:
    """Returns the number as text with a point or exponent, which TOML requires of a float."""
    text = f"{value:.10g}"
    return text if any(mark in text for mark in ".e") else text + ".0"


USUAL = Range()
# Machines of the grade "field".
FIELD_RANGE = Range(
    (0.012, 0.160),
    (0.04, 2.0),
    (4e6, 35e6),
    (8.0, 200.0),
    (0.2, 6.0),
    (2 / 60e3, 600 / 60e3),
    (0.2, 1e5),
)
DOUBLE_RODS = 0.25  # share of the machines
# A reversal of full speed within half a period of the oil spring swings the load pressure by about
# v m omega / A; a designer keeps it below two times the supply pressure.
LARGEST_SWING = 2.0
# Viscous friction at full speed takes less than this share of the force of the supply pressure.
LARGEST_FRICTION = 0.2
# The slowest decay of the oil spring, 1/s, with which the weak loop of an open-loop record, of
# 1.5 rad/s, keeps a reserve.
LEAST_DAMPING_1_S = 2.5


def draw_wide_rig(rng: np.random.Generator, of: Range = USUAL) -> NominalRig:
    """Draws the rig file's values of a machine that a designer would build.

    Bores of 20 to 100 mm, strokes of 80 mm to 1 m, 70 to 280 bar, 15 to 150 Hz, damping ratios of
    0.01 to 0.3, 0.3 to 4 strokes a second at full opening, and areas of the two sides whose ratio
    is 0.45 to 1. A machine that no valve of 5 to 250 l/min fits, or that could not reach or reverse
    its speed, is drawn again. `of`: other ranges than these.
    """
    while True:
        rig, natural_rad_s = _draw(rng, of)
        if is_built(rig, natural_rad_s, of):
            return rig


def _draw(rng: np.random.Generator, of: Range) -> tuple[NominalRig, float]:
    bore = round(spread(rng, *of.bore_m), 3)
    is_double = bool(rng.random() < DOUBLE_RODS)
    # The area of a double rod is stated as that of a piston without a rod.
    ratio = 1.0 if is_double else float(rng.uniform(0.45, 0.9))
    rod = round(bore * math.sqrt(1.0 - ratio), 4)
    stroke = round(spread(rng, *of.stroke_m), 2)
    rig, natural_rad_s = draw_drive(rng, of, bore, rod, stroke)
    return with_lag(rng, rig, 50.0, 140.0), natural_rad_s


def is_built(rig: NominalRig, natural_rad_s: float, of: Range = USUAL) -> bool:
    """Whether there is a valve for it, and it reaches and reverses its speed."""
    v = rig.values
    mass = v["load.mass_kg"]
    return (
        of.rated_flow_m3_s[0] <= v["valve.rated_flow_m3_s"] <= of.rated_flow_m3_s[1]
        and of.mass_kg[0] <= mass <= of.mass_kg[1]
        and rig.speed_m_s * mass * natural_rad_s <= LARGEST_SWING * rig.force_n
        and v["load.viscous_friction_n_s_m"] * rig.speed_m_s <= LARGEST_FRICTION * rig.force_n
        and rig.damping_1_s >= LEAST_DAMPING_1_S
    )
