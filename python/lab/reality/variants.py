# SPDX-License-Identifier: MIT
"""Laws of friction, hysteresis, laps and supply that real machines have in place of the usual ones.

Each leaves the size of an effect as it is. Sources: Dahl 1976 and Ikhouane, Rodellar 2007
(friction), Kuhnen 2003 (hysteresis); all in full in `machine`.

The true machine without an effect: its true values, and structure that no data sheet states.

Families of wide machines: short names by which results can be grouped.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from .excitation import Excitation
from .machine import compression
from .noise import Logger
from .nominal_rig import LAG, NominalRig, spread
from .truth import NO_PLAYS, NO_WEAR, Edges, Plays, Truth

Grade = Literal["plain", "hard", "confusable", "slow", "wide", "abroad", "linkage", "field"]
GRADES: tuple[Grade, ...] = (
    "plain",
    "hard",
    "confusable",
    "slow",
    "wide",
    "abroad",
    "linkage",
    "field",
)
WIDE: tuple[Grade, ...] = ("wide", "abroad", "linkage", "field")  # of all sizes and laws
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


def families(
    rig: NominalRig,
    machine: Truth,
    structure: Mapping[str, float],
    logger: Logger,
    dt_s: float,
    effects: Collection[str],
    excitations: tuple[Excitation, Excitation],
) -> dict[str, str]:
    """Returns the family of a machine and its records by each trait, in a few words."""
    deviation = max(abs(structure[f"gain_{name}"] - 1.0) for name in ("pa", "at", "pb", "bt"))
    edges = "even" if deviation < 0.01 else "uneven"
    if machine.worn != NO_WEAR:
        edges = "worn"
    elif "valve_dead_band" in effects and abs(_ends(machine)) > 0.05:
        edges = "unequal ends"
    hysteresis = "none"
    if "valve_hysteresis" in effects:
        hysteresis = "Prandtl-Ishlinskii" if machine.play_weights[0] > 0.0 else "play"
        if machine.spool_friction > 0.0:
            hysteresis = "Dahl spool"
    seals = "LuGre"
    if machine.dahl_exponent > 0.0:
        seals = "Dahl"
    elif machine.bouc_wen_power > 0.0:
        seals = "Bouc-Wen"
    return {
        "rods": "double" if rig.values["cylinder.rod_m"] == 0.0 else "single",
        "flow law": _flow_law(machine.flow_exponent),
        "seals": seals,
        "supply": "relief valve" if machine.pump_flow_m3_s > 0.0 else "accumulator",
        "edges": edges,
        "hysteresis": hysteresis,
        "noise": "coloured" if logger.coloured_share > 0.3 else "nearly white",
        "timing": "late by 0.5 %" if logger.largest_late_s <= 0.005 * dt_s else "late by 2 %",
        "excitation": "+".join(sorted(excitations)),
        "air": "below 100 ppm" if machine.gas_fraction < 1e-4 else "from 100 ppm on",
        "clock": _group(1e3 * dt_s, (1.0, 5.0), "ms"),
        "bore": _group(1e3 * rig.values["cylinder.bore_m"], (40.0, 80.0), "mm"),
    }


def _group(value: float, ends: tuple[float, float], unit: str) -> str:
    low, high = (f"{end:g}" for end in ends)
    if value <= ends[0] * (1.0 + 1e-9):
        return f"to {low} {unit}"
    return f"{low} to {high} {unit}" if value <= ends[1] * (1.0 + 1e-9) else f"above {high} {unit}"


def _ends(machine: Truth) -> float:
    """Difference of the positive and the negative end of the dead band over their sum."""
    positive = machine.overlap_pa + machine.overlap_bt
    negative = machine.overlap_at + machine.overlap_pb
    return (positive - negative) / (positive + negative)


def _flow_law(exponent: float) -> str:
    if exponent < 0.51:
        return "square root"
    return "exponent to 0.525" if exponent < 0.525 else "exponent to 0.54"


Seals = Literal["LuGre", "Dahl", "Bouc-Wen"]
# Largest flow, in multiples of that at half the pressure difference: with all of it over one edge,
# a flow law of exponent 0.5 to 0.54 passes 2^0.5 to 2^0.54; the rest is for unequal edges.
LARGEST_FLOW = 1.5
RELIEF_PART = 0.1  # share of the loss of pressure up to the flow at which the relief valve closes


@dataclass(frozen=True)
class Variants:
    """The laws of one machine."""

    seals: Seals = "LuGre"
    """Law of friction; Stribeck friction is not of Dahl's law, which has none."""
    dahl_exponent: float = 1.0
    bouc_wen_power: float = 1.5
    bouc_wen_sigma: float = 1.0
    """Constants of the two laws."""
    play_shares: Plays = NO_PLAYS
    play_weights: Plays = NO_PLAYS
    """Half-widths of a hysteresis in multiples of its size, and their weights: the weighted sum is
    1, so is the sum of the weights; all 0: one play."""
    lap_difference: float = 0.0
    """By which share of a dead band its end at positive commands is wider than their mean."""
    relief_flow: float = 0.0
    """Flow of a pump with relief valve, in multiples of the flow at half the pressure difference;
    0: no such pump."""
    relief_loss: float = 0.0
    """Loss of its pressure at the largest flow, as a share of it, where droop is not an effect."""
    spool_friction_way: float = 0.0
    """Way in which the friction of a spool has reversed, in half-widths of the hysteresis, which is
    then due to this friction; 0: it is a play, or a sum of plays."""
    worn: Edges = NO_WEAR
    """Further rounding of the metering edges PA, AT, PB, BT by wear, as a fraction of full opening.
    """


def draw_variants(rng: np.random.Generator) -> Variants:
    """Draws the laws of a machine; what is drawn does not depend on its effects."""
    law = float(rng.random())
    exponent, power = float(rng.uniform(1.0, 2.0)), float(rng.uniform(1.2, 2.0))
    sigma = float(rng.uniform(0.6, 1.0))
    shares, weights = _draw_plays(rng)
    is_operator, is_unequal, has_relief = (bool(rng.random() < p) for p in (0.5, 0.5, 0.3))
    difference = float(rng.choice([-1.0, 1.0])) * float(rng.uniform(0.05, 0.2))
    flow, loss = float(rng.uniform(0.4, 0.6)), spread(rng, 0.004, 0.016)
    return Variants(
        seals="LuGre" if law < 0.5 else "Dahl" if law < 0.75 else "Bouc-Wen",
        dahl_exponent=exponent,
        bouc_wen_power=power,
        bouc_wen_sigma=sigma,
        play_shares=shares if is_operator else NO_PLAYS,
        play_weights=weights if is_operator else NO_PLAYS,
        lap_difference=difference if is_unequal else 0.0,
        relief_flow=flow if has_relief else 0.0,
        relief_loss=loss if has_relief else 0.0,
    )


def draw_field_variants(rng: np.random.Generator, variants: Variants) -> Variants:
    """Draws what only machines of the grade "field" have: spools with friction, worn edges.

    A worn edge opens by less than 5 % of full opening too early.
    """
    rubs, wears = (bool(rng.random() < p) for p in (0.4, 0.5))
    way, worn = float(rng.uniform(0.2, 0.6)), [float(each) for each in rng.uniform(0.005, 0.05, 4)]
    return replace(
        variants,
        spool_friction_way=way if rubs else 0.0,
        worn=(worn[0], worn[1], worn[2], worn[3]) if wears else NO_WEAR,
    )


def _draw_plays(rng: np.random.Generator) -> tuple[Plays, Plays]:
    count = int(rng.integers(3, 6))
    widths = np.zeros(5)
    weights = np.zeros(5)
    widths[:count] = np.sort(rng.uniform(0.2, 1.8, 5)[:count])
    weights[:count] = rng.uniform(0.5, 1.5, 5)[:count]
    weights /= weights.sum()
    widths /= float(weights @ widths)
    return _plays(widths), _plays(weights)


def _plays(values: Iterable[float]) -> Plays:
    a, b, c, d, e = (float(value) for value in values)
    return a, b, c, d, e


def with_variants(machine: Truth, variants: Variants, effects: Collection[str]) -> Truth:
    """Returns the machine, which has these effects already, with these laws."""
    if variants.seals == "Dahl" and "stribeck_friction" not in effects:
        machine = machine._replace(dahl_exponent=variants.dahl_exponent)
    elif variants.seals == "Bouc-Wen":
        machine = machine._replace(
            bouc_wen_power=variants.bouc_wen_power, bouc_wen_sigma=variants.bouc_wen_sigma
        )
    machine = machine._replace(worn=variants.worn)
    if "valve_hysteresis" in effects and variants.spool_friction_way > 0.0:
        way = variants.spool_friction_way * machine.play
        machine = machine._replace(play=0.0, spool_friction=machine.play, spool_friction_way=way)
    elif "valve_hysteresis" in effects and variants.play_weights[0] > 0.0:
        machine = machine._replace(
            play_half_widths=_plays(share * machine.play for share in variants.play_shares),
            play_weights=variants.play_weights,
        )
    if "valve_dead_band" in effects:
        machine = _with_unequal_ends(machine, variants.lap_difference)
    if variants.relief_flow > 0.0:
        machine = _with_relief_valve(machine, variants, "supply_droop" in effects)
    return machine


def _with_unequal_ends(machine: Truth, difference: float) -> Truth:
    more = (
        difference
        * 0.25
        * math.fsum(
            (machine.overlap_pa, machine.overlap_at, machine.overlap_pb, machine.overlap_bt)
        )
    )
    return machine._replace(
        overlap_pa=machine.overlap_pa + more,
        overlap_bt=machine.overlap_bt + more,
        overlap_at=machine.overlap_at - more,
        overlap_pb=machine.overlap_pb - more,
    )


def _with_relief_valve(machine: Truth, variants: Variants, droops: bool) -> Truth:
    """Replaces the linear characteristic of the supply by that of a pump with a relief valve.

    Both lose the same pressure at full flow where droop is the effect. Elsewhere the loss is that
    of the variant, at the largest flow.
    """
    full_flow = machine.flow_gain * math.pow(
        0.5 * (machine.source_pa - machine.tank_pa), machine.flow_exponent
    )
    pump_flow = variants.relief_flow * full_flow
    flow = full_flow if droops else LARGEST_FLOW * full_flow
    loss = (
        machine.source_resistance_pa_s_m3 * full_flow
        if droops
        else variants.relief_loss * machine.source_pa
    )
    return machine._replace(
        pump_flow_m3_s=pump_flow,
        source_resistance_pa_s_m3=RELIEF_PART * loss / pump_flow,
        slip_resistance_pa_s_m3=(1.0 - RELIEF_PART) * loss / (flow - pump_flow),
    )
