# SPDX-License-Identifier: MIT
"""In which equation a term is missing, whatever its form: where the gap lies.

To each equation in turn smooth terms over all variables that could matter there are added at once,
and fitted through the simulator together with all values of the rig. Each term gets the size that
the records ask for (`model.relevance`), so that an equation with more terms has no advantage. Terms
over rates, which a table cannot have, act where a law depends on the direction or on a change:
play, a lag, a mass, a volume of gas. They are directions of the linearised simulator. The gain is
the logarithm of the evidence above that of the rig without any term.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from ...base.numbers import FloatArray
from ...base.parallel import Progress, run_together
from ..model.case import Case
from ..model.fit import descent
from ..model.linear import Linear
from ..model.parameters import Law
from ..model.problem import Problem
from ..model.separation import Relevance, quadratic, relevance
from ..search.candidates import FittedCandidate
from .forms import (
    BY_DIRECTION,
    KNOTS,
    LOAD_PRESSURE,
    RATES,
    SPRING,
    knots,
    knots_over,
    sizes,
    trajectories,
)

# Variables of each equation: first those that a table can have, then those of linear terms.
TABLES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "spool": ("spool", "time_s"),
        "flow_a": ("spool", "pressure_a_pa", "position_m", "time_s"),
        "flow_b": ("spool", "pressure_b_pa", "position_m", "time_s"),
        "force": ("velocity_m_s", "position_m", "time_s"),
        "sensor": ("position_m", "velocity_m_s", "time_s"),
        "delay": ("time_s",),
    }
)
LINEAR: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "spool": ("spool_rate_1_s",),
        "flow_a": ("pressure_a_rate_pa_s", LOAD_PRESSURE),
        "flow_b": ("pressure_b_rate_pa_s", LOAD_PRESSURE),
        "force": ("acceleration_m_s2", BY_DIRECTION),
        "sensor": ("acceleration_m_s2",),
        "delay": ("spool_rate_1_s",),
    }
)
# Opening and delay belong to a part of the machine each. A wrong flow of the valve that is no
# opening (its edges differ, the supply gives way) cannot be told from another one.
SUBSYSTEM: Mapping[str, str] = MappingProxyType(
    {
        "spool": "valve",
        "flow_a": "hydraulics",
        "flow_b": "hydraulics",
        "force": "mechanics",
        "sensor": "sensor",
        "delay": "timing",
    }
)
# Steps of the fit with terms of the expected size, and of that with those of the right size.
FIRST, SECOND = 3, 3
# A term whose prior variance shrank by this factor is off.
OFF = 1e-6
# Values of a term stay within this many of its new standard deviations.
WITHIN = 4.0


@dataclass(frozen=True, eq=False)
class EquationTerms:
    """The terms of an equation."""

    equation: str
    """Name of the equation."""
    gain: float
    """Logarithm of their evidence above that of none, nats, >= 0."""
    problem: Problem
    x: FloatArray
    """The fit with the terms over tables, with their sizes."""
    sizes: Mapping[str, float]
    """Standard deviation of each term by its variable, in the unit of the equation."""
    scale: float
    """Size that a term may be expected to have."""


def equation_terms(
    case: Case, calibrated: FittedCandidate, progress: Progress | None = None
) -> tuple[EquationTerms, ...]:
    """Fits the terms of each equation that the plant has, beside the rig without effects."""
    problem = case.problem()
    # A calibration may have moved values far to hide what is missing.
    starts = [(x, problem.linear(x)) for x in (calibrated.x, problem.centre())]
    without = _relevance(problem, calibrated.x, starts[0][1], ()).evidence
    here = _together(trajectories(problem, calibrated.x), problem)
    tasks = [
        partial(_fitted, case, equation, _laws(case, equation, here), starts, without)
        for equation in TABLES
        if equation in sizes(case)
    ]
    return tuple(run_together(tasks, progress))


def _together(
    records: Sequence[Mapping[str, FloatArray]], problem: Problem
) -> dict[str, FloatArray]:
    """Variables inside windows, all records together."""
    return {
        name: np.concatenate(
            [each.inside(here[name]) for each, here in zip(problem.records, records, strict=True)]
        )
        for name in records[0]
    }


def _laws(case: Case, equation: str, here: Mapping[str, FloatArray]) -> tuple[Law, ...]:
    """The terms over tables, over what was visited."""
    laws = []
    for variable in TABLES[equation]:
        if variable not in here:
            continue
        places = knots_over(variable, here[variable], case.rig)
        if places is not None:
            # A rig may have a table of the same name already.
            laws.append(Law(equation, variable, places, sizes(case)[equation], "_missing"))
            if (equation, variable) == SPRING and "mass" in sizes(case):
                # A linkage changes the force and the mass: both belong to the same equation.
                laws.append(Law("mass", variable, places, sizes(case)["mass"], "_missing"))
    return tuple(laws)


def _fitted(
    case: Case,
    equation: str,
    laws: tuple[Law, ...],
    starts: Sequence[tuple[FloatArray, Linear]],
    without: float,
) -> EquationTerms:
    problem = case.problem(laws=laws)
    fits = []
    for x, linear in starts:
        start = np.concatenate([x, np.zeros(problem.low.size - x.size)])
        *_, last = itertools.islice(descent(problem, start, linear), FIRST)
        fits.append(last)
    x = min(fits, key=lambda each: each.cost).x
    linear = problem.linear(x)
    first = _relevance(problem, x, linear, _blocks(problem))
    found = [(first, problem, x, linear)]
    laws, x = _with_sizes(problem, x, first)
    problem = case.problem(laws=laws)
    *_, last = itertools.islice(descent(problem, x), SECOND)
    linear = problem.linear(last.x)
    found.append((_relevance(problem, last.x, linear, _blocks(problem)), problem, last.x, linear))
    best, problem, x, linear = max(found, key=lambda each: each[0].evidence)
    terms = {
        law.of: law.size * math.sqrt(factor)
        for law, factor in zip(problem.laws, best.factors, strict=True)
        if law.adds_to == equation
    }
    joined, variables = _with_linear_terms(problem, x, linear, equation, sizes(case)[equation])
    more = [np.arange(x.size + KNOTS * k, x.size + KNOTS * (k + 1)) for k in range(len(variables))]
    with_rates = _relevance(problem, x, joined, [*_blocks(problem), *more])
    if with_rates.evidence > best.evidence:
        best = with_rates
        terms |= {
            variable: sizes(case)[equation] * math.sqrt(factor)
            for variable, factor in zip(variables, best.factors[len(problem.laws) :], strict=True)
        }
    # Terms that are off are none: a fit that ended behind that has found nothing.
    gain = best.evidence - without
    gain = gain if gain > 0.0 else 0.0
    return EquationTerms(equation, gain, problem, x, terms, sizes(case)[equation])


def _blocks(problem: Problem) -> list[npt.NDArray[np.int64]]:
    """Indices of the parameters of each law of a problem."""
    first = problem.low.size - sum(law.knots.size for law in problem.laws)
    blocks = []
    for law in problem.laws:
        blocks.append(np.arange(first, first + law.knots.size))
        first += law.knots.size
    return blocks


def _relevance(
    problem: Problem, x: FloatArray, linear: Linear, blocks: Sequence[npt.NDArray[np.int64]]
) -> Relevance:
    """Evidence of a linearised problem; parameters beyond those of x have a standard prior."""
    errors = quadratic(problem, linear)
    more = errors.products.shape[1] - x.size
    free = np.append(problem.high > problem.low, np.ones(more, dtype=bool))
    place = np.cumsum(free) - 1
    errors = replace(
        errors, products=errors.products[:, free], grams=errors.grams[:, free][:, :, free]
    )
    offset = np.append(problem.centres() - x, np.zeros(more))[free]
    information = np.append(problem.information(), np.ones(more))[free]
    return relevance(errors, offset, information, [place[block] for block in blocks])


def _with_sizes(
    problem: Problem, x: FloatArray, found: Relevance
) -> tuple[tuple[Law, ...], FloatArray]:
    """The laws that are not off with the sizes that were found, and x with the same values."""
    blocks = _blocks(problem)
    laws, parts = [], [x[: blocks[0][0]] if blocks else x]
    for law, block, factor in zip(problem.laws, blocks, found.factors, strict=True):
        if factor >= OFF:
            times = math.sqrt(factor)
            laws.append(replace(law, size=times * law.size))
            parts.append(np.clip(x[block] / times, -WITHIN, WITHIN))
    return tuple(laws), np.concatenate(parts)


def _with_linear_terms(
    problem: Problem, x: FloatArray, linear: Linear, equation: str, size: float
) -> tuple[Linear, list[str]]:
    """The linearised problem with the linear terms of an equation, and their variables."""
    records = trajectories(problem, x)
    inside = _together(records, problem)
    signals: list[list[tuple[str, FloatArray]]] = [[] for _ in records]
    variables = []
    for variable in LINEAR[equation]:
        places = (
            knots(inside[variable], KNOTS, bends=variable in RATES) if variable in inside else None
        )
        if places is None:
            continue
        variables.append(variable)
        law = Law(equation, variable, places, size)
        for own, here in zip(signals, records, strict=True):
            at_knots = np.stack([np.interp(here[variable], places, row) for row in law.basis.T])
            own += [(equation, row) for row in at_knots]
    if not variables:
        return linear, []
    return linear.joined(linear.errors, problem.responses(x, signals)), variables
