# SPDX-License-Identifier: MIT
"""Minimise a problem's cost: Levenberg-Marquardt inside bounds.

J. Nocedal, S. Wright, Numerical Optimization, 2nd ed., Springer 2006, ch. 10 and 16.7: steps in the
parameters that are not held at a bound, then projected.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ehsid.harness.gap.problem import Problem

FloatArray = npt.NDArray[np.float64]

DAMPING = 1e-2
LESS, MORE = 1.0 / 6.0, 8.0
TRIES = 6
# A gain in cost below this is none: costs are log-likelihoods, where one is a standard error.
GAIN = 1e-3


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


def fit(problem: Problem, start: FloatArray, *, iterations: int = 15) -> Fit:
    """Minimise from a start, which is moved inside the bounds."""
    x = np.clip(np.asarray(start, dtype=np.float64), problem.low, problem.high)
    damping = DAMPING
    here = problem.step(x)
    for taken in range(iterations):
        held = ((x <= problem.low) & (here.gradient > 0.0)) | (
            (x >= problem.high) & (here.gradient < 0.0)
        )
        free = np.flatnonzero(~held)
        hessian = here.hessian[np.ix_(free, free)]
        diagonal = np.diag(hessian)
        floor = 1e-12 * float(diagonal.max(initial=1e-300))
        for _ in range(TRIES):
            move = np.zeros_like(x)
            damped = hessian + damping * np.diag(diagonal + floor)
            move[free] = -np.linalg.solve(damped, here.gradient[free])
            there = np.clip(x + move, problem.low, problem.high)
            cost = problem.cost(there)
            if cost < here.cost:
                break
            damping = max(damping * MORE, 1e-4)
        else:
            return Fit(x, here.cost, taken, True)
        gain = here.cost - cost
        x, damping = there, max(damping * LESS, 1e-9)
        if gain < GAIN:
            return Fit(x, cost, taken + 1, True)
        here = problem.step(x)
    return Fit(x, here.cost, iterations, False)
