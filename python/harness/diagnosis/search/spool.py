# SPDX-License-Identifier: MIT
"""Fits with a spool whose speed is limited, which no fit finds by itself.

A limit that the spool never reaches changes nothing, so that the cost has no slope there. And a fit
without the limit has taken its delay for a lower bandwidth: with both, the spool is too slow, and
the cost is higher. So several limits are tried, and all other values are fitted to each.
"""

from __future__ import annotations

import copy
import itertools
from functools import partial

import numpy as np

from ...base.numbers import FloatArray
from ...base.parallel import run_threads
from ..model.fit import BEHIND_NATS, Fit, descent, fit
from ..model.problem import Problem

SLEW = "nuisance.spool_slew_1_s"
# Limits that are tried, 1/s. A fit reaches a limit from a trial that is off by a fifth.
SLEWS_1_S = (60.0, 85.0, 120.0, 170.0, 240.0, 340.0, 480.0, 680.0)
# A fit whose limit is below this has found one.
UNLIMITED_1_S = 1000.0
# Number of trials that go on after their first step.
KEPT = 2
# Where the best trial is worse than no limit by more than this, nats, its limit is not fitted. The
# prior alone takes 5 nats at 60 1/s.
LIMIT_NATS = 10.0


def with_slower_spool(problem: Problem, held_out: Problem, best: Fit, iterations: int) -> Fit:
    """Returns the fit with a limited speed of the spool where it explains more, else `best`.

    All data count, because the commands of the fitted ones may be too slow to show the limit.

    Parameters
    ----------
    problem, held_out
        the two parts of the data, with the same parameters.
    best
        the minimum without a limit.
    iterations
        steps of a fit.
    """
    names = [parameter.name for parameter in problem.parameters]
    if SLEW not in names:
        return best
    linear = problem.linear(best.x)
    for name in problem.outputs:
        linear.gram(name)  # once, not in each of the trials
    # Data that do not show a limit would take it away again in the first step.
    place = names.index(SLEW)
    trials = np.tile(best.x, (len(SLEWS_1_S), 1))
    trials[:, place] = [problem.parameters[place].place(limit) for limit in SLEWS_1_S]
    fits = [descent(with_limit_of(problem, trial), trial, linear) for trial in trials]
    firsts = [next(each) for each in fits]

    def all_costs(fitted: Fit) -> float:
        return fitted.cost + held_out.fit_cost(held_out.coefficients(fitted.x))

    costs = run_threads([partial(all_costs, each) for each in (best, *firsts)])
    ends: list[tuple[float, Fit]] = []
    for i in np.argsort(costs[1:])[:KEPT]:
        *_, last = firsts[i], *itertools.islice(fits[i], iterations - 1)
        ends.append((all_costs(last), last))
    limited = min(ends, key=lambda end: end[0])
    if limited[0] > costs[0] + LIMIT_NATS:
        return best
    free = fit(problem, limited[1].x, iterations=iterations)
    ends = [(costs[0] - BEHIND_NATS, best), limited, (all_costs(free), free)]
    return min(ends, key=lambda end: end[0])[1]


def with_limit_of(problem: Problem, x: FloatArray) -> Problem:
    """Returns the problem with the limit of the speed held as in x, shape (n,)."""
    held = copy.copy(problem)
    is_limit = np.array([parameter.name == SLEW for parameter in problem.parameters])
    held.low, held.high = np.where(is_limit, x, held.low), np.where(is_limit, x, held.high)
    return held
