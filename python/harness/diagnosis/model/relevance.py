# SPDX-License-Identifier: MIT
"""Evidence of a linearised fit whose terms get the sizes that the records ask for.

The errors are linear in the changes t of the parameters about a point. Blocks of parameters, each
the values of one term, have a prior of unknown size; that of the largest evidence switches needless
terms off (automatic relevance determination: D. J. C. MacKay, Neural Computation 4(3), 1992). The
likelihood is that of `likelihood`, with the expected squares of the errors in place of the squares:

    ln Z >= -sum_b (n_b / 2) ln(E[P_b] + t_b) - KL(posterior of t | prior of t)

the variational bound, whose maximum over the posterior is reached in a few rounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...base.arrays import FloatArray
from .linear import Linear
from .problem import Problem

ROUNDS = 15
# Range of the factor of the prior variance of a block.
FACTORS = (1e-8, 1e4)


@dataclass(frozen=True, eq=False)
class Relevance:
    """Evidence, nats, and the factor by which each block's prior variance became larger."""

    evidence: float
    factors: FloatArray


@dataclass(frozen=True, eq=False)
class Quadratic:
    """Squares of the errors of B bands of outputs as a function of n parameters.

    Attributes
    ----------
    squares, products, grams
        sum of squares, (B,), its half gradient, (B, n), and half Hessian, (B, n, n).
    rows, independent, tolerated
        number of coefficients, of independent ones, and tolerated power, shape (B,) each.
    """

    squares: FloatArray
    products: FloatArray
    grams: FloatArray
    rows: FloatArray
    independent: FloatArray
    tolerated: FloatArray


def quadratic(problem: Problem, linear: Linear) -> Quadratic:
    """The squares of the errors of a problem, linearised; `linear` may have parameters more."""
    columns: list[tuple[float, FloatArray, FloatArray, float, float, float]] = []
    for name in problem.outputs:
        likelihood, errors = problem.likelihoods[name], linear.errors[name]
        slopes, grams = linear.slopes[name], linear.gram(name)
        for band, slices in enumerate(problem.spectrum.bands):
            if likelihood.counts[band] > 0.0:
                columns.append(
                    (
                        sum(float(errors[rows] @ errors[rows]) for rows in slices),
                        np.sum([slopes[rows].T @ errors[rows] for rows in slices], axis=0),
                        grams[band],
                        float(problem.spectrum.sizes[band]),
                        float(likelihood.counts[band]),
                        float(likelihood.tolerated[band]),
                    )
                )
    return Quadratic(*(np.array(column) for column in zip(*columns, strict=True)))


def relevance(
    errors: Quadratic,
    offset: FloatArray,
    information: FloatArray,
    blocks: Sequence[npt.NDArray[np.int64]],
) -> Relevance:
    """Evidence with the best sizes of the blocks.

    Parameters
    ----------
    errors
        squares of the errors as a function of the changes of the parameters.
    offset, information
        mean and inverse variance of the prior of these changes, shape (n,) each.
    blocks
        indices of the parameters of each block.
    """
    factors = np.ones(len(blocks))
    power = errors.squares / errors.rows
    best = Relevance(-np.inf, factors)
    for _ in range(ROUNDS):
        weights = errors.independent / (errors.rows * (power + errors.tolerated))
        prior = information.copy()
        for block, factor in zip(blocks, factors, strict=True):
            prior[block] /= factor
        precision = np.tensordot(weights, errors.grams, axes=1) + np.diag(prior)
        covariance = np.asarray(np.linalg.inv(precision), dtype=np.float64)
        change = covariance @ (prior * offset - weights @ errors.products)
        moved = change - offset
        divergence = 0.5 * float(
            moved @ (prior * moved)
            + prior @ np.diag(covariance)
            + np.linalg.slogdet(precision)[1]
            - np.sum(np.log(prior))
            - change.size
        )
        power = (
            errors.squares
            + 2.0 * errors.products @ change
            + np.einsum("i,bij,j->b", change, errors.grams, change, optimize=True)
            + np.einsum("bij,ij->b", errors.grams, covariance)
        ) / errors.rows
        power = np.maximum(power, 0.0)
        cost = 0.5 * float(np.sum(errors.independent * np.log(power + errors.tolerated)))
        if -cost - divergence > best.evidence:
            best = Relevance(-cost - divergence, factors)
        factors = np.array(
            [
                _factor(information[block], moved[block], covariance[block, block], factor)
                for block, factor in zip(blocks, factors, strict=True)
            ]
        )
    return best


def _factor(
    information: FloatArray, moved: FloatArray, variance: FloatArray, factor: float
) -> float:
    """Next factor of a block: squares of its changes over the number that the records determine."""
    determined = moved.size - float(information @ variance) / factor
    squares = float(information @ moved**2)
    return float(np.clip(squares / max(determined, 1e-3), *FACTORS))
