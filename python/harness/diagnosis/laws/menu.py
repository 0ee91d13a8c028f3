# SPDX-License-Identifier: MIT
"""The laws that are tried: equations, variables, and the sizes that a term may have."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from ...base.arrays import FloatArray
from ...rigs import Rig
from ..model.case import Case
from ..model.law import Law
from ..model.machine import machine_scale
from ..search.candidates import FittedCandidate
from .trajectory import trajectories

# Variables of each equation, as far as physics knows such laws: friction, springs and bearings;
# flow laws of the edges, leakage and air; errors of sensors; clocks that drift.
MENU: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "force": ("velocity_m_s", "position_m", "time_s"),
        "flow_a": ("spool", "pressure_a_pa", "position_m", "time_s"),
        "flow_b": ("spool", "pressure_b_pa", "position_m", "time_s"),
        "spool": ("spool", "time_s"),
        "sensor": ("position_m", "time_s"),
        "delay": ("time_s",),
    }
)
# Standard deviation of a term by the prior: share of the largest force, of the rated flow, of full
# opening, of the stroke; and seconds.
SHARE = MappingProxyType(
    {"force": 0.1, "flow_a": 0.1, "flow_b": 0.1, "spool": 0.1, "sensor": 0.01, "delay": 0.01}
)
# Below the pressure of the tank free gas decides, of which every oil has another share: a law over
# the pressure of a chamber begins there.
CHAMBERS = ("pressure_a_pa", "pressure_b_pa")
KNOTS = 12
# Over the time a law may come and go several times.
KNOTS_OF_TIME = 30
# Share of the samples beyond the outer knots at either end.
TAIL = 0.002
# Friction and metering edges bend near zero: there knots are closer, on the scale asinh(x / x_0)
# with x_0 this share of the range.
BENDS_AT_ZERO = ("velocity_m_s", "spool")
NEAR_ZERO = 0.03


def laws(case: Case, candidate: FittedCandidate) -> list[Law]:
    """Returns the laws of the menu that the plant can have, over the range that the rod visited."""
    here = visited(case, candidate)
    scale = sizes(case)
    found = []
    for equation, variables in MENU.items():
        for variable in variables:
            if equation not in scale or variable not in here:
                continue
            places = knots_over(variable, here[variable], case.rig)
            if places is not None:
                law = Law(equation, variable, places, scale[equation])
                found.append(_with_free_name(law, case.rig))
    return found


def _with_free_name(law: Law, rig: Rig) -> Law:
    """A rig that an earlier diagnosis augmented has its laws already: a new one adds to them."""
    number = 2
    while law.name in rig.tables:
        law, number = replace(law, suffix=f"_{number}"), number + 1
    return law


def sizes(case: Case) -> dict[str, float]:
    """Sizes of terms by equation; without those that the plant does not have."""
    values = case.rig.values
    travel = values.get("cylinder.stroke_m") or float(
        max(np.ptp(record.column("position_m")) for record in case.records)
    )
    of = {"force": machine_scale(case.rig).force_n, "sensor": travel, "delay": 1.0}
    if case.rig.plant == "ehs":
        of |= {"flow_a": values["valve.rated_flow_m3_s"], "spool": 1.0}
        of["flow_b"] = of["flow_a"]
    return {name: SHARE[name] * unit for name, unit in of.items() if math.isfinite(unit)}


def visited(case: Case, candidate: FittedCandidate) -> dict[str, FloatArray]:
    """What the simulation of a candidate visits, by variable, all fitted records together."""
    problem = case.problem(candidate.effects, laws=candidate.laws)
    records = trajectories(problem, candidate.x)
    return {name: np.concatenate([here[name] for here in records]) for name in records[0]}


def knots_over(variable: str, samples: FloatArray, rig: Rig) -> FloatArray | None:
    """Knots of a table over a variable; None where it does not vary.

    samples: of the variable. Below the tank pressure a chamber holds a cavity, which no table has.
    """
    if variable in CHAMBERS:
        samples = samples[samples > rig.values["supply.tank_pressure_pa"]]
    count = KNOTS_OF_TIME if variable == "time_s" else KNOTS
    return knots(samples, count, bends=variable in BENDS_AT_ZERO)


def knots(samples: FloatArray, count: int, *, bends: bool) -> FloatArray | None:
    """Knots over what was visited, shape (count,); None where the variable does not vary."""
    if samples.size < count:
        return None
    low, high = np.quantile(samples, [TAIL, 1.0 - TAIL])
    if not high - low > 1e-9 * max(abs(low), abs(high)):
        return None
    if not bends:
        return np.asarray(np.linspace(low, high, count))
    near = NEAR_ZERO * (high - low)
    ends = np.arcsinh(np.array([low, high]) / near)
    return np.asarray(near * np.sinh(np.linspace(ends[0], ends[1], count)))
