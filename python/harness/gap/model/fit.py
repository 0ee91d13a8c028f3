# SPDX-License-Identifier: MIT
"""Minimise a problem's cost: Levenberg-Marquardt inside bounds.

J. Nocedal, S. Wright, Numerical Optimization, 2nd ed., Springer 2006, ch. 10 and 16.7: steps in the
parameters that are not held at a bound, then projected.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.model.problem import Linear, Problem, Step

DAMPING = 1e-2
LESS, MORE = 1.0 / 6.0, 8.0
# Damping falls to 1e-9 where steps gain; from there a short step is as many tries away.
TRIES = 10
TRIES_STALE = 2
# A gain in cost below this is none: costs are log-likelihoods, where one is a standard error.
GAIN = 1e-2
# Steps between exact sensitivities, and the least share of the foretold gain to go on without.
FRESH = 4
HONEST = 0.25


@dataclass(frozen=True, eq=False)
class Fit:
    """Where a fit ended.

    Attributes
    ----------
    x
        shape (n,), inside the bounds.
    cost
        there.
    iterations
        steps that were taken.
    converged
        the last step gained less than GAIN, or none gained anything.
    """

    x: FloatArray
    cost: float
    iterations: int
    converged: bool


def fit(
    problem: Problem, start: FloatArray, *, iterations: int = 15, first: Linear | None = None
) -> Fit:
    """Minimise from a start, which is moved inside the bounds.

    Sensitivities cost ten simulations. They are exact at the start, then for some steps changed by
    what the errors at the next point say, and exact again after FRESH steps, or where the cost does
    not fall as they foretell. `first` stands for those of the first parameters at the start.
    """
    x = np.clip(np.asarray(start, dtype=np.float64), problem.low, problem.high)
    damping = DAMPING
    linear, age = problem.linear(x, first), 0 if first is None else 1
    here = problem.form(x, linear)
    for taken in range(iterations):
        found = _try(problem, x, here, damping, TRIES if age == 0 else TRIES_STALE)
        if found is None:
            if age == 0:
                return Fit(x, here.cost, taken, True)
            linear, age = problem.linear(x), 0
            here = problem.form(x, linear)
            continue
        gain, foretold = here.cost - found.cost, found.foretold
        move, x = found.x - x, found.x
        if gain < GAIN and age == 0:
            return Fit(x, found.cost, taken + 1, True)
        if taken + 1 == iterations:
            return Fit(x, found.cost, iterations, False)
        damping = max(found.damping * LESS, 1e-9)
        if gain < GAIN or gain < HONEST * foretold or age + 1 == FRESH:
            linear, age = problem.linear(x), 0
        else:
            linear, age = linear.moved(move, found.errors, np.diag(here.hessian)), age + 1
        here = problem.form(x, linear)
    return Fit(x, here.cost, iterations, False)


@dataclass(frozen=True, eq=False)
class _Better:
    """A point of lower cost, its errors, the damping that led there, and the gain foretold."""

    x: FloatArray
    cost: float
    errors: Mapping[str, FloatArray]
    damping: float
    foretold: float


def _try(problem: Problem, x: FloatArray, here: Step, damping: float, tries: int) -> _Better | None:
    """Damped steps, ever shorter, until one gains."""
    held = ((x <= problem.low) & (here.gradient > 0.0)) | (
        (x >= problem.high) & (here.gradient < 0.0)
    )
    free = np.flatnonzero(~held)
    hessian = here.hessian[np.ix_(free, free)]
    diagonal = np.diag(hessian)
    floor = 1e-12 * float(diagonal.max(initial=1e-300))
    for _ in range(tries):
        move = np.zeros_like(x)
        damped = hessian + damping * np.diag(diagonal + floor)
        move[free] = -np.linalg.solve(damped, here.gradient[free])
        there = np.clip(x + move, problem.low, problem.high)
        errors = problem.errors(there)
        cost = problem.cost_of(there, errors)
        if cost < here.cost:
            moved = there - x
            foretold = -float(here.gradient @ moved + 0.5 * moved @ here.hessian @ moved)
            return _Better(there, cost, errors, damping, foretold)
        damping = max(damping * MORE, 1e-4)
    return None
