# SPDX-License-Identifier: MIT
"""The true machine without an effect: its true values, and structure that no data sheet states."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from .machine import compression
from .nominal_rig import LAG, NominalRig
from .truth import Truth

Grade = Literal["plain", "hard", "confusable", "slow", "wide"]
GRADES: tuple[Grade, ...] = ("plain", "hard", "confusable", "slow", "wide")
LEAST_AMPLIFIER_S = 5e-5  # a shorter lag is hidden behind that of the spool, and costs many steps


def draw_structure(rng: np.random.Generator, rig: NominalRig, severity: float) -> dict[str, float]:
    """Draws the deviations of the true machine from the simulator that are not effects.

    They are large, all at once, with a severity of 1, and small with 0; in between, their ranges
    are geometric means. Every severity takes the same draws from the stream.
    """
    draws = {name: float(rng.uniform(-1.0, 1.0)) for name in _DRAWS}

    def mean(plain: float, hard: float) -> float:
        return math.pow(plain, 1.0 - severity) * math.pow(hard, severity)

    def between(
        name: str, plain_range: tuple[float, float], hard_range: tuple[float, float]
    ) -> float:
        low, high = (mean(*ends) for ends in zip(plain_range, hard_range, strict=True))
        return low * math.pow(high / low, 0.5 + 0.5 * draws[name])

    bristle_m = between("bristle", (8e-6, 2e-5), (1.5e-5, 4e-5))  # deflection when it slides
    structure = {"bristle_m": bristle_m}
    if rig.plant == "axis":
        return structure
    gain_deviation, overlap = mean(0.003, 0.03), mean(0.0005, 0.004)
    structure |= {
        "spool_rad_s": 2.0 * math.pi * between("spool", (250.0, 400.0), (150.0, 260.0)),
        "spool_damping": 0.8 + 0.15 * draws["damping"],
        "spool_slew_1_s": between("slew", (1500.0, 3000.0), (90.0, 200.0)),
        "flow_exponent": 0.5 + severity * (0.0225 + 0.0175 * draws["exponent"]),
        "transition_pa": between("transition", (1e4, 3e4), (3e4, 2e5)),
        "round_width": between("round", (8e-4, 2e-3), (2e-3, 8e-3)),
        "bulk_slope": between("slope", (3.0, 6.0), (8.0, 16.0)),
        "gas_fraction": between("gas", (5e-6, 2e-5), (5e-5, 4e-4)),
        "hum_share": between("hum", (1e-4, 4e-4), (1e-3, 4e-3)),
        "hum_hz": 225.0 + 75.0 * draws["hum_hz"],
        # Pressure lost at full flow, as a share of the supply pressure, and its time constant.
        "droop_share": between("droop", (5e-4, 1.5e-3), (2e-3, 6e-3)),
        "droop_s": between("droop_s", (3e-3, 1e-2), (3e-3, 3e-2)),
        "warming_viscous": -abs(draws["warming"]) * mean(0.02, 0.15),
        "warming_bulk": -abs(draws["warming"]) * mean(0.004, 0.03),
    }
    for name in ("pa", "at", "pb", "bt"):
        structure[f"gain_{name}"] = 1.0 + gain_deviation * draws[f"gain_{name}"]
        structure[f"overlap_{name}"] = overlap * draws[f"overlap_{name}"]
    if severity > 0.0:
        amplifier_s = severity * (2.75e-4 + 1.25e-4 * draws["amplifier"])
        structure["amplifier_s"] = max(amplifier_s, LEAST_AMPLIFIER_S)
        structure["seal_n"] = rig.force_n * between("seal", (2e-5, 1e-4), (2e-4, 1e-3))
    return structure


# Names of the draws; each is uniform between -1 and 1.
_DRAWS = (
    *("bristle", "spool", "damping", "slew", "exponent", "transition", "round", "slope", "gas"),
    *("hum", "hum_hz", "droop", "droop_s", "warming", "seal", "amplifier"),
    *(f"{kind}_{name}" for kind in ("gain", "overlap") for name in ("pa", "at", "pb", "bt")),
)


def build(
    rig: NominalRig, true_values: Mapping[str, float], structure: Mapping[str, float]
) -> Truth:
    """Returns the constants of the machine with these true values and this structure."""
    constants: dict[str, Any] = dict(structure)
    bristle_m = constants.pop("bristle_m")
    if rig.plant == "axis":
        machine = Truth(
            mass_kg=true_values["axis.mass_kg"],
            viscous_n_s_m=true_values["axis.viscous_friction_n_s_m"],
            stroke_m=rig.stroke_m,
            force_per_unit_n=10.0 * true_values["axis.force_per_volt"],
        )
        return with_friction(machine, 0.0, 0.0, 0.01, bristle_m)
    bore, rod = true_values["cylinder.bore_m"], true_values["cylinder.rod_m"]
    area_a = math.pi / 4.0 * bore**2
    supply, tank = true_values["supply.pressure_pa"], true_values["supply.tank_pressure_pa"]
    flow = true_values["valve.rated_flow_m3_s"]
    # The rig file gives the flow at one pressure drop. Whatever the exponent, the flow equals that
    # of the square-root law at the middle of the pressure drops that occur.
    exponent = constants["flow_exponent"]
    middle = 0.5 * (supply - tank)
    gain = flow * math.sqrt(middle / true_values["valve.rated_pressure_drop_pa"]) / middle**exponent
    droop_share, droop_s, seal = (
        constants.pop("droop_share"),
        constants.pop("droop_s"),
        constants.pop("seal_n", 0.0),
    )
    full_flow = gain * middle**exponent
    resistance = droop_share * supply / full_flow
    if LAG[0] in true_values:
        constants["spool_rad_s"] = 2.0 * math.pi * true_values[LAG[0]]
        constants["spool_damping"] = true_values[LAG[1]]
    slope, bulk = constants["bulk_slope"], true_values["fluid.bulk_modulus_pa"]
    machine = Truth(
        mass_kg=true_values["load.mass_kg"],
        viscous_n_s_m=true_values["load.viscous_friction_n_s_m"],
        stroke_m=true_values["cylinder.stroke_m"],
        area_a_m2=area_a,
        area_b_m2=area_a - math.pi / 4.0 * rod**2,
        dead_volume_a_m3=true_values["cylinder.dead_volume_a_m3"],
        dead_volume_b_m3=true_values["cylinder.dead_volume_b_m3"],
        bulk_modulus_0_pa=bulk - slope * 0.5 * supply,  # `bulk` holds at half the supply pressure
        flow_gain=gain,
        source_pa=supply,
        tank_pa=tank,
        source_resistance_pa_s_m3=resistance,
        accumulator_m3_pa=droop_s / resistance,
        **constants,
    )
    machine = machine._replace(balance_pa=balance(machine))
    return with_friction(machine, seal, seal, 0.02, bristle_m)


def balance(machine: Truth) -> float:
    """Pressure, Pa, at which `compression` is zero: its terms of oil and gas are equal."""
    low, high = 1.0, 5e7
    for _ in range(200):
        middle = math.sqrt(low * high)
        value = compression(
            middle, machine.bulk_slope, machine.bulk_modulus_0_pa, machine.gas_fraction
        )
        low, high = (middle, high) if value < 0.0 else (low, middle)
    return low


def with_friction(
    machine: Truth, coulomb: float, static: float, stribeck_m_s: float, bristle_m: float
) -> Truth:
    """Returns the machine with the friction of seals, whose bristles bend before they slide.

    They bend by bristle_m; their damping is a fifth of the critical one.
    """
    stiffness = max(static, 1e-6) / bristle_m
    return machine._replace(
        coulomb_n=coulomb,
        static_n=static,
        stribeck_m_s=stribeck_m_s,
        bristle_n_m=stiffness,
        bristle_n_s_m=0.4 * math.sqrt(stiffness * machine.mass_kg),
    )
