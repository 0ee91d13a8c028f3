# SPDX-License-Identifier: MIT
"""The laws that are tried: equations, variables, and the sizes that a term may have.

What a term of an equation may depend on, along a simulation.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

import ehsid

from ...base.numbers import FloatArray
from ...rigs import Rig
from ..model.case import Case, machine_scale
from ..model.parameters import Law
from ..model.problem import Problem
from ..search.candidates import FittedCandidate

# Rates are the slopes of outputs over this time: one simulated sample has steps.
RATE_S = 0.005
RATES = {
    "acceleration_m_s2": "velocity_m_s",
    "spool_rate_1_s": "spool",
    "pressure_a_rate_pa_s": "pressure_a_pa",
    "pressure_b_rate_pa_s": "pressure_b_pa",
}
LOAD_PRESSURE = "load_pressure_pa"
# The position where the rod extends, and its negative where it retracts: a law that differs by
# direction.
BY_DIRECTION = "position_by_direction_m"


def trajectories(problem: Problem, x: FloatArray) -> list[dict[str, FloatArray]]:
    """Variables of each record by name, shape (N,) each; without those that the plant lacks."""
    values = problem.plant_values(x)[np.newaxis]
    found = []
    for record in problem.records:
        outputs, _ = ehsid.simulate_plant(
            problem.rig.plant,
            values,
            record.record.column("command_v"),
            dt_s=record.dt_s,
            substeps=problem.substeps,
            aligned=record.aligned,
            tables=problem.rig.table_shapes(),
        )
        here = {
            name: np.asarray(column, dtype=np.float64)
            for name, column in zip(ehsid.plant_outputs(), outputs[0].T, strict=True)
            if np.isfinite(column).all()
        }
        for rate, name in RATES.items():
            if name in here:
                here[rate] = _rate(here[name], record.dt_s)
        if {"pressure_a_pa", "pressure_b_pa"} <= here.keys():
            here[LOAD_PRESSURE] = here["pressure_a_pa"] - here["pressure_b_pa"]
        here[BY_DIRECTION] = np.where(here["velocity_m_s"] < 0.0, -1.0, 1.0) * (
            here["position_m"] - float(np.min(here["position_m"]))
        )
        here["time_s"] = record.dt_s * np.arange(len(record.record), dtype=np.float64)
        found.append(here)
    return found


def _rate(signal: FloatArray, dt_s: float) -> FloatArray:
    length = max(1, round(RATE_S / dt_s))
    smooth = np.convolve(signal, np.full(length, 1.0 / length), mode="same")
    return np.asarray(np.gradient(smooth, dt_s), dtype=np.float64)


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
