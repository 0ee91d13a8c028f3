# SPDX-License-Identifier: MIT
"""Which effects are worth a fit where each run is dear: one or two runs an effect.

The errors are linear in the values of the rig, whose sensitivities are known, and in the share s of
an effect, whose errors at one size are known from one run:

    e(dx, s) = e_0 + J dx + s (e_size - e_0),   0 <= s <= MOST_SHARE

The effects whose best dx and s leave least get a fit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
import numpy.typing as npt

from ...base.numbers import FloatArray
from ...base.parallel import Progress, run_together
from ..model.case import Case
from ..model.parameters import Law
from ..model.problem import Problem
from ..model.scale import effect_starts
from ..options import Effort
from .candidates import FitStart, places_and_sizes

# A size at which a fit starts is within a factor of two or three of any that matters.
MOST_SHARE = 3.0
# The likelihood weighs errors by their own size, so that its minimum takes a few steps.
STEPS = 4
# Sets that go on: in trials the truth was among the first three of 12 to 23.
KEPT_ALONE: Mapping[Effort, int] = {"list": 3, "screened": 8}
KEPT_TOGETHER = 4


def preselected(
    case: Case,
    sets: Sequence[tuple[tuple[str, ...], Sequence[FitStart]]],
    kept: int,
    progress: Progress | None = None,
    laws: Sequence[Law] = (),
) -> list[tuple[str, ...]]:
    """Returns the sets whose last effect promises most, best first.

    sets: sets of effects, each with the starts of its fits, fitted without the last effect.
    laws: laws without a name that all of them have besides.
    """
    costs = run_together(
        [partial(_promised, case, effects, starts, laws) for effects, starts in sets], progress
    )
    order = np.argsort(costs, kind="stable")
    return [sets[place][0] for place in order[:kept].tolist()]


def _promised(
    case: Case, effects: tuple[str, ...], starts: Sequence[FitStart], laws: Sequence[Law]
) -> float:
    """Least cost of a set with its last effect as one linear term, nats."""
    problem = case.problem(effects, laws=laws)
    starts_of_effect = effect_starts(effects[-1], case.rig)
    own, sizes = places_and_sizes(case, problem, effects[-1], starts_of_effect)
    return min(
        _least(problem, start, problem.coefficients(np.insert(start.x, own[0], size)), own)
        for start in starts
        for size in sizes
    )


def _least(
    problem: Problem,
    start: FitStart,
    with_effect: dict[str, FloatArray],
    own: npt.NDArray[np.int64],
) -> float:
    """own: places of the parameters of the effect, which the linear term stands for."""
    if not all(np.isfinite(errors).all() for errors in with_effect.values()):
        return np.inf
    without = start.linear.errors
    change = {name: with_effect[name] - without[name] for name in without}
    linear = start.linear.joined(without, {name: d[:, np.newaxis] for name, d in change.items()})
    count = start.x.size
    prior = np.delete(problem.information(), own)
    away = start.x - np.delete(problem.centres(), own)
    low, high = (np.delete(end, own) - start.x for end in (problem.low, problem.high))
    step = np.append(np.zeros(count), 1.0)
    cost = np.inf
    for _ in range(STEPS):
        errors = linear.after(step)
        cost = problem.fit_cost(errors) + 0.5 * float(prior @ (away + step[:count]) ** 2)
        at = linear.at(errors)
        gradient = np.append(prior * (away + step[:count]), 0.0)
        hessian = np.diag(np.append(prior, 0.0))
        for name in problem.outputs:
            by_x, gram = at.products(name, problem.likelihoods[name].weights(errors[name]))
            gradient, hessian = gradient + by_x, hessian + gram
        hessian += 1e-9 * np.diag(np.diag(hessian) + 1e-12)
        step = step - np.linalg.solve(hessian, gradient)
        step[:count] = np.clip(step[:count], low, high)
        step[count] = min(max(float(step[count]), 0.0), MOST_SHARE)
    return cost
