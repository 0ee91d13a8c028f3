# SPDX-License-Identifier: MIT
"""Minimisation of the cost of a problem by the Levenberg-Marquardt method inside bounds.

J. Nocedal, S. Wright, Numerical Optimization, 2nd ed., Springer 2006, ch. 10 and 16.7. A step
changes the parameters that are not held at a bound. It is then projected into the bounds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.model.problem import Linear, Problem, Step

DAMPING = 1e-2
LESS, MORE = 1.0 / 6.0, 8.0
# Successful steps reduce the damping, down to 1e-9. From there it takes this many tries until the
# damping makes a step short.
TRIES = 10
TRIES_STALE = 2
# A smaller decrease in cost counts as none. Costs are log-likelihoods, in which a difference of
# the order of one is a standard error.
GAIN = 1e-2
# Steps from one evaluation of exact sensitivities to the next, and the smallest share of the
# predicted decrease with which a fit continues without them.
FRESH = 4
HONEST = 0.25


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of a fit.

    Attributes
    ----------
    x
        shape (n,), final parameters, inside the bounds.
    cost
        cost at x, nats.
    iterations
        number of steps taken.
    converged
        true if the last step decreased the cost by less than GAIN, or no step decreased it.
    """

    x: FloatArray
    cost: float
    iterations: int
    converged: bool


def fit(
    problem: Problem, start: FloatArray, *, iterations: int = 15, first: Linear | None = None
) -> Fit:
    """Minimises the cost of a problem from a start, which is first moved inside the bounds.

    Exact sensitivities cost ten simulations. They are computed at the start, after FRESH steps, or
    if the cost does not decrease as predicted. In between they are updated from the errors at each
    new point. `first` replaces those of the first parameters at the start.
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
    """A point of lower cost, its errors, the damping that led there, and the predicted decrease."""

    x: FloatArray
    cost: float
    errors: Mapping[str, FloatArray]
    damping: float
    foretold: float


def _try(problem: Problem, x: FloatArray, here: Step, damping: float, tries: int) -> _Better | None:
    """Tries damped steps, each shorter than the last, until the cost decreases.

    The result is None if no step decreases the cost.
    """
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
