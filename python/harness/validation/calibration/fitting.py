# SPDX-License-Identifier: MIT
"""Maximum likelihood of the constants of the probabilities, with their standard errors.

The probabilities are a conditional logit, p = exp(u) / sum exp(u), whose scores u depend on the
constants x. With the derivatives d = du/dx of all scores of a machine, the gradient and the
expected curvature of its -ln p(truth) are

    g = E[d] - E[d | truth],    F = Cov(d)

under p (D. McFadden, in Frontiers in Econometrics, 1974). A weak ridge keeps constants of which the
machines say nothing where they are. Where the best set of a machine changes with x, the score of
outside jumps. So the fit is done in rounds, each beside the best sets of the one before. The
standard errors are those of the sandwich, (F + R)^-1 (sum g g' + R) (F + R)^-1 with the ridge R,
which stays right where the logit is only nearly true (H. White, Econometrica 50(1), 1982).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np
from scipy.optimize import minimize

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.inference.constants import IN_USE, Constants
from ehsid.harness.validation.calibration.choices import (
    Choices,
    IntArray,
    best_sets,
    log_loss,
    of_truth,
    scores,
    shares,
)

NAMES = tuple(each.name for each in fields(Constants))
# These are larger than zero; their logarithms are fitted.
POSITIVE = np.array([name in ("evidence", "least_left") for name in NAMES])
# Standard deviations of the ridge around the constants in use: a factor of e for the positive ones;
# odds of 20 to 1, 3 nats, for the others. So a constant that is off by that much costs half a nat,
# which a few machines outweigh.
RIDGE = np.where(POSITIVE, 1.0, 3.0)
# Step of the derivatives of the scores. Scores are smooth and of order 10, so the error of central
# differences, about step^2, and that of rounding, 1e-15 / step, are both far below 1e-6.
STEP = 1e-4
# The fit ends where the gradient is below this, nats: then x is within 1e-2 of a standard error of
# the ridge, which is the largest there is.
GRADIENT = 1e-2
# The best sets mostly stay as they are after one to four rounds. Where those of a machine go to and
# fro without end, either round is right to a small part of a standard error.
ROUNDS = 10


@dataclass(frozen=True, eq=False)
class Fit:
    """Fitted constants, and their standard errors, (9,), in the order of `NAMES`."""

    constants: Constants
    errors: FloatArray


def coordinates(constants: Constants) -> FloatArray:
    """Returns the coordinates x of the fit, (9,): logarithms of the positive constants."""
    values = np.array([getattr(constants, name) for name in NAMES])
    return np.where(POSITIVE, np.log(np.where(POSITIVE, values, 1.0)), values)


def constants_at(x: FloatArray) -> Constants:
    """Returns the constants with the coordinates x."""
    values = np.where(POSITIVE, np.exp(np.where(POSITIVE, x, 0.0)), x)
    return Constants(**dict(zip(NAMES, values.tolist(), strict=True)))


def fit(choices: Choices, start: Constants = IN_USE) -> Fit:
    """Fits the constants to the machines.

    Parameters
    ----------
    choices
        sets of at least one machine.
    start
        constants from which the search starts; the ridge is around `IN_USE` in any case.
    """
    x = coordinates(start)
    best = best_sets(choices, start)
    for _ in range(ROUNDS):
        x = _fitted_beside(choices, x, best)
        before, best = best, best_sets(choices, constants_at(x))
        if np.array_equal(best, before):
            break
    constants = constants_at(x)
    gradients, curvature = _derivatives(choices, x, best, curvature=True)
    ridge = np.diag(RIDGE**-2.0)
    bread = np.linalg.inv(curvature + ridge)
    covariance = bread @ (gradients.T @ gradients + ridge) @ bread
    errors = np.sqrt(np.diag(covariance))
    # The error of c = exp(x) is c times that of x.
    values = np.array([getattr(constants, name) for name in NAMES])
    return Fit(constants, np.where(POSITIVE, values, 1.0) * errors)


def _fitted_beside(choices: Choices, start: FloatArray, best: IntArray) -> FloatArray:
    """Returns the x of least cost, (9,), where outside stands beside these sets whatever x is."""
    centre = coordinates(IN_USE)

    def cost(x: FloatArray) -> tuple[float, FloatArray]:
        away = (x - centre) / RIDGE
        losses = log_loss(scores(choices, constants_at(x), best), choices.true)
        # -sum ln p(truth) + 1/2 sum ((x - x_in_use) / RIDGE)^2
        value = float(losses.sum() + 0.5 * away @ away)
        gradients, _ = _derivatives(choices, x, best, curvature=False)
        return value, gradients.sum(axis=0) + away / RIDGE

    found = minimize(cost, start, jac=True, method="L-BFGS-B", options={"gtol": GRADIENT})
    return np.asarray(found.x)


def _derivatives(
    choices: Choices, x: FloatArray, best: IntArray, *, curvature: bool
) -> tuple[FloatArray, FloatArray]:
    """Gradients of -ln p(truth), (N, 9), and, if wanted, their summed curvature F, (9, 9)."""
    of = scores(choices, constants_at(x), best)
    chances, chances_of_truth = shares(of), shares(of_truth(of, choices.true))
    slopes = np.stack(list(_slopes(choices, x, best)), axis=-1)
    mean = np.einsum("nm,nmk->nk", chances, slopes)
    # g = E[d] - E[d | truth]
    gradients = mean - np.einsum("nm,nmk->nk", chances_of_truth, slopes)
    if not curvature:
        return gradients, np.zeros((x.size, x.size))
    # F = E[d d'] - E[d] E[d]'
    squares = np.einsum("nm,nmk,nml->kl", chances, slopes, slopes, optimize=True)
    return gradients, squares - mean.T @ mean


def _slopes(choices: Choices, x: FloatArray, best: IntArray) -> Iterator[FloatArray]:
    """Yields du/dx, (N, M + 1), for each coordinate; zero where a machine has no such set."""
    absent = np.column_stack([~choices.present, np.zeros(len(choices.present), dtype=np.bool_)])
    for step in STEP * np.eye(x.size):
        ahead, behind = (
            np.where(absent, 0.0, scores(choices, constants_at(at), best))
            for at in (x + step, x - step)
        )
        yield (ahead - behind) / (2.0 * STEP)


def folds(count: int, number: int, rng: np.random.Generator) -> list[IntArray]:
    """Returns the indices of the machines of each fold; sizes differ by one at most."""
    return np.array_split(rng.permutation(count), number)
