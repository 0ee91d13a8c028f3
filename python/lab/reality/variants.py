# SPDX-License-Identifier: MIT
"""Laws of friction, hysteresis, laps and supply that real machines have in place of the usual ones.

Each leaves the size of an effect as it is. Sources: Dahl 1976 and Ikhouane, Rodellar 2007
(friction), Kuhnen 2003 (hysteresis); all in full in `machine`.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from .nominal_rig import spread
from .truth import NO_PLAYS, Plays, Truth

Seals = Literal["LuGre", "Dahl", "Bouc-Wen"]
# Largest flow, in multiples of that at half the pressure difference: with all of it over one edge,
# a flow law of exponent 0.5 to 0.54 passes 2^0.5 to 2^0.54; the rest is for unequal edges.
LARGEST_FLOW = 1.5
RELIEF_PART = 0.1  # share of the loss of pressure up to the flow at which the relief valve closes


@dataclass(frozen=True)
class Variants:
    """The laws of one machine.

    Attributes
    ----------
    seals
        law of friction; Stribeck friction is not of Dahl's law, which has none.
    dahl_exponent, bouc_wen_power, bouc_wen_sigma
        constants of the two laws.
    play_shares, play_weights
        half-widths of a hysteresis in multiples of its size, and their weights: the weighted sum is
        1, so is the sum of the weights; all 0: one play.
    lap_difference
        by which share of a dead band its end at positive commands is wider than their mean.
    relief_flow
        flow of a pump with relief valve, in multiples of the flow at half the pressure difference;
        0: no such pump.
    relief_loss
        loss of its pressure at the largest flow, as a share of it, where droop is not an effect.
    """

    seals: Seals = "LuGre"
    dahl_exponent: float = 1.0
    bouc_wen_power: float = 1.5
    bouc_wen_sigma: float = 1.0
    play_shares: Plays = NO_PLAYS
    play_weights: Plays = NO_PLAYS
    lap_difference: float = 0.0
    relief_flow: float = 0.0
    relief_loss: float = 0.0


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
    if "valve_hysteresis" in effects and variants.play_weights[0] > 0.0:
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
