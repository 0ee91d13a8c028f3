# SPDX-License-Identifier: MIT
"""Rigs of the grade "wide": single and double rods of all sizes and pressures of servo drives."""

from __future__ import annotations

import math

import numpy as np

from .nominal_rig import LAG, NominalRig, four_digits, spread

RATED_FLOWS_M3_S = (5.0 / 60e3, 250.0 / 60e3)  # 5 to 250 l/min
MASSES_KG = (1.0, 2e4)
DOUBLE_RODS = 0.25  # share of the machines
# A reversal of full speed within half a period of the oil spring swings the load pressure by about
# v m omega / A; a designer keeps it below two times the supply pressure.
LARGEST_SWING = 2.0
# Viscous friction at full speed takes less than this share of the force of the supply pressure.
LARGEST_FRICTION = 0.2
# The slowest decay of the oil spring, 1/s, with which the weak loop of an open-loop record, of
# 1.5 rad/s, keeps a reserve.
LEAST_DAMPING_1_S = 2.5


def draw_wide_rig(rng: np.random.Generator) -> NominalRig:
    """Draws the rig file's values of a machine that a designer would build.

    Bores of 20 to 100 mm, strokes of 80 mm to 1 m, 70 to 280 bar, 15 to 150 Hz, damping ratios of
    0.01 to 0.3, 0.3 to 4 strokes a second at full opening, and areas of the two sides whose ratio
    is 0.45 to 1. A machine that no valve of 5 to 250 l/min fits, or that could not reach or reverse
    its speed, is drawn again.
    """
    while True:
        rig, natural_rad_s = _draw(rng)
        if _is_built(rig, natural_rad_s):
            return rig


def _draw(rng: np.random.Generator) -> tuple[NominalRig, float]:
    bore = round(spread(rng, 0.020, 0.100), 3)
    is_double = bool(rng.random() < DOUBLE_RODS)
    # The area of a double rod is stated as that of a piston without a rod.
    ratio = 1.0 if is_double else float(rng.uniform(0.45, 0.9))
    rod = round(bore * math.sqrt(1.0 - ratio), 4)
    stroke = round(spread(rng, 0.08, 1.0), 2)
    area_a = math.pi / 4.0 * bore**2
    area_b = area_a - math.pi / 4.0 * rod**2
    dead_a, dead_b = area_a * stroke * rng.uniform(0.08, 0.45, 2)
    supply, tank = spread(rng, 7e6, 28e6), float(rng.choice([1.5e5, 2e5, 3e5]))
    bulk = spread(rng, 0.75e9, 1.4e9)
    # k = B (A_a^2 / V_a + A_b^2 / V_b), at mid-stroke
    stiffness = bulk * (
        area_a**2 / (dead_a + 0.5 * area_a * stroke) + area_b**2 / (dead_b + 0.5 * area_b * stroke)
    )
    natural = 2.0 * math.pi * spread(rng, 15.0, 150.0)
    mass = stiffness / natural**2
    viscous = 2.0 * spread(rng, 0.01, 0.3) * mass * natural
    speed = stroke * spread(rng, 0.3, 4.0)
    flow_gain = speed * 0.5 * (area_a + area_b) / math.sqrt(0.5 * (supply - tank))
    rated_drop = float(rng.choice([3.5e6, 7e6, 0.5e6]))
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
            "valve.rated_command_v": float(rng.choice([10.0, 10.0, 5.0])),
            "supply.pressure_pa": supply,
            "supply.tank_pressure_pa": tank,
            "fluid.bulk_modulus_pa": bulk,
        }
    )
    lag = (float(round(spread(rng, 50.0, 140.0))), round(float(rng.uniform(0.7, 1.0)), 2))
    if rng.random() < 0.5:
        values |= dict(zip(LAG, lag, strict=True))
    return NominalRig("ehs", values, speed, supply * area_a, viscous / mass, stroke), natural


def _is_built(rig: NominalRig, natural_rad_s: float) -> bool:
    v = rig.values
    mass = v["load.mass_kg"]
    return (
        RATED_FLOWS_M3_S[0] <= v["valve.rated_flow_m3_s"] <= RATED_FLOWS_M3_S[1]
        and MASSES_KG[0] <= mass <= MASSES_KG[1]
        and rig.speed_m_s * mass * natural_rad_s <= LARGEST_SWING * rig.force_n
        and v["load.viscous_friction_n_s_m"] * rig.speed_m_s <= LARGEST_FRICTION * rig.force_n
        and rig.damping_1_s >= LEAST_DAMPING_1_S
    )
