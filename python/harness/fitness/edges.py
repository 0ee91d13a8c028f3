# SPDX-License-Identifier: MIT
"""What the chamber pressures say about the areas and the supply, whatever the load is.

Both edges of a valve have the same opening and the same rated flow (Merritt, Hydraulic Control
Systems, Wiley 1967, ch. 6). The rated flow that the edge at A needs is in proportion to the area at
the cap side, that at B to the one at the rod side. So they only agree with the right ratio of the
areas. A wrong supply pressure makes the edge at A need too much extending and the edge at B
retracting, because these two are the edges from the supply; an offset of the valve's null changes
both edges in the same way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from ..catalogue.channels import SUPPLY_PRESSURE
from ..records import Record
from ..rigs import Rig
from .motion import Areas, FlowGain, Motion, flow_gain, has_pressures

# The supply pressure is looked for between these multiples of the rig's.
SUPPLY_RANGE = (0.4, 2.5)


@dataclass(frozen=True)
class Edges:
    """Ratio of the areas and supply pressure that the chamber pressures fit.

    Attributes
    ----------
    part
        area at the rod side over area at the cap side.
    supply_pa
        supply pressure at the valve, absolute, Pa; None where it is measured.
    gain
        rated flow with this supply pressure.
    """

    part: float
    supply_pa: float | None
    gain: FlowGain


def edges(record: Record, rig: Rig, moved: Motion, area: Areas) -> Edges | None:
    """Determines ratio and supply; None without pressures or without motion both ways."""
    if not has_pressures(record):
        return None
    supply = None
    if SUPPLY_PRESSURE not in record.columns:
        supply = _supply(record, rig, moved, area)
        if supply is None:
            return None
    gain = flow_gain(record, rig, moved, area, supply)
    if gain.edge_a is None or gain.edge_b is None or _sides(gain) is None:
        return None
    return Edges(area.annulus / area.cap * gain.edge_a / gain.edge_b, supply, gain)


def _supply(record: Record, rig: Rig, moved: Motion, area: Areas) -> float | None:
    """Supply pressure with which both edges agree on the difference between the directions."""
    known = rig.values["supply.pressure_pa"]

    def off(factor: float) -> float:
        sides = _sides(flow_gain(record, rig, moved, area, factor * known))
        return math.nan if sides is None else sides

    # Below the largest chamber pressure an edge passes nothing, and nothing can be told.
    factors = np.geomspace(*SUPPLY_RANGE, 25).tolist()
    found = [off(factor) for factor in factors]
    for i in range(len(factors) - 1):
        if found[i] * found[i + 1] < 0.0:
            return float(known * brentq(off, factors[i], factors[i + 1], xtol=1e-3))
    return None


def _sides(gain: FlowGain) -> float | None:
    """Logarithm of (a_out / a_back) / (b_out / b_back); None if one of them cannot be told."""
    if not (gain.a_out and gain.a_back and gain.b_out and gain.b_back):
        return None
    return math.log(gain.a_out / gain.a_back * gain.b_back / gain.b_out)
