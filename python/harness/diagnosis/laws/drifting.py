# SPDX-License-Identifier: MIT
"""Values of the rig that change in the course of the records, as where the oil warms.

One value for all windows cannot follow oil that warms: viscous friction and leakage change by half
in 20 K, and the bulk modulus with them. No term of an equation over the time is like that, because
friction that fades is no force over the time. A leakage that grows is most like one that does not,
so that a constant one is named, and only its growth tells that this is not all. Here each value of
the rig and of the effects has, besides, a share that grows with the time, zero in the middle of the
longest record. Its derivative is that of the value in a window, times the time of the window:
values act within a window, so that exact sensitivities of one point suffice, and nothing is
simulated again.

Sound machines whose excitation changes in the course of a record, such as a chirp, could seem to
drift, because errors depend on frequency and amplitude. The fitted and the held-out records have
excitations of their own. Only a change that makes the errors of both smaller counts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ...base.numbers import FloatArray, plain_number
from ...catalogue.parameters import name_in_sentence
from ...catalogue.spellings import ParameterKey
from ..deciding import DRIFT_SIGMA, DRIFTS
from ..model.case import Case
from ..model.fit import hats
from ..model.problem import Problem
from ..model.separation import Quadratic, quadratic, reweighted
from ..search.candidates import FittedCandidate, decision_case

# Other values are told where they explain this share of what the best one does.
AS_GOOD = 0.6
MOST_TOLD = 3


@dataclass(frozen=True)
class Drift:
    """Values that change in the course of the records."""

    gain: float
    """By which the errors become smaller in the fitted or in the held-out data, ln on the average,
    whichever is less."""
    changes: tuple[tuple[str, float], ...]
    """Values any of which explains most of it alone, the best first: full name, and relative change
    over the longest record."""

    @property
    def sentence(self) -> str:
        """What changes, for the reader."""
        told = []
        for name, change in self.changes:
            went = "rose" if change > 0.0 else "fell"
            told.append(
                f"{name_in_sentence(name)} {went} by {plain_number(100.0 * abs(change), 2)} %"
            )
        return (
            "Values change in the course of the records, as where the oil warms: it is most nearly "
            f"as if {', or '.join(told)}."
        )


def values_that_drift(case: Case, best: FittedCandidate) -> Drift | None:
    """Values of the rig and of effects that change with the time; None where none does.

    best: the fit of the rig with the best set of effects, or without any. On a user's simulator
    none is looked for.
    """
    if case.engine is not None:
        return None
    fine = decision_case(case)
    problems = [fine.problem(best.effects, held_out=held_out) for held_out in (False, True)]
    parameters = problems[0].parameters
    own = [
        place
        for place, each in enumerate(parameters)
        if each.logarithmic and each.low < each.high and _may_change(each.name)
    ]
    longest_s = max(record.dt_s * len(record.record) for p in problems for record in p.records)
    parts = [_with_time(problem, best.x, own, longest_s) for problem in problems]
    if not own or not all(np.isfinite(part.grams).all() for part in parts):
        return None
    x, size = best.x, len(parameters)
    bounds = np.array([(each.low, each.high) for each in parameters]) - x[:, np.newaxis]
    information = problems[0].information()
    offset = np.where(information > 0.0, x - problems[0].centres(), 0.0)

    def left(drifting: list[int]) -> tuple[FloatArray, FloatArray]:
        """Errors of both parts with these values drifting, ln, and the changes over the record."""
        kept = np.array([*range(size), *(size + each for each in drifting)])
        some = [_restricted(part, kept) for part in parts]
        free = np.full((len(drifting), 2), np.inf) * (-1.0, 1.0)
        _, change = reweighted(
            _joined(some),
            np.concatenate([information, np.full(len(drifting), DRIFT_SIGMA**-2)]),
            np.concatenate([offset, np.zeros(len(drifting))]),
            *np.concatenate([bounds, free]).T,
        )
        return np.array([_left(each, change) for each in some]), change[size:]

    without, _ = left([])
    gain = float(np.min(without - left(list(range(len(own))))[0]))
    if not gain >= DRIFTS:
        return None
    alone = [left([each]) for each in range(len(own))]
    gains = [float(np.mean(without - each)) for each, _ in alone]
    order = sorted(range(len(own)), key=lambda each: -gains[each])
    return Drift(
        gain,
        tuple(
            (parameters[own[each]].name, math.expm1(float(alone[each][1][0])))
            for each in order[:MOST_TOLD]
            if gains[each] >= AS_GOOD * gains[order[0]]
        ),
    )


def _may_change(name: str) -> bool:
    """Whether a value may change within minutes: not one of steel, nor one of our simulator."""
    return not (ParameterKey(name).is_nuisance or name.startswith("cylinder."))


def _with_time(problem: Problem, x: FloatArray, own: list[int], longest_s: float) -> Quadratic:
    """Squares of the errors by all parameters, and by a share of these that grows with the time."""
    middles = []
    for record in problem.records:
        length = record.full_windows[1]
        middles.append((hats(record).begins + 0.5 * length) * record.dt_s / longest_s - 0.5)
    over_time = np.concatenate(middles)[problem.spectrum.window_of_rows()]
    linear = problem.linear(x)
    slopes = {name: rows[:, own] * over_time[:, np.newaxis] for name, rows in linear.slopes.items()}
    return quadratic(problem, linear.joined(linear.errors, slopes))


def _restricted(errors: Quadratic, kept: npt.NDArray[np.int64]) -> Quadratic:
    grams = errors.grams[:, kept][:, :, kept]
    return replace(errors, products=errors.products[:, kept], grams=grams)


def _joined(parts: list[Quadratic]) -> Quadratic:
    names = ("squares", "products", "grams", "rows", "independent", "tolerated")
    return Quadratic(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def _left(errors: Quadratic, change: FloatArray) -> float:
    """Mean of ln(errors / tolerated errors) behind a change, as of `search.score.left`."""
    power = errors.power_after(change)
    excess = 0.5 * errors.independent * np.log1p(power / errors.tolerated)
    return float(excess.sum() / errors.independent.sum())
