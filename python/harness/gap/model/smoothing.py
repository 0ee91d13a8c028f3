# SPDX-License-Identifier: MIT
"""Posterior of unknown inputs of a linear model, window by window.

    c_w = G_w d_w + S_w t + e_w,   d_w ~ N(0, q^2 K),   t ~ N(0, diag(1 / information)),
    e_w ~ N(0, diag(variance))

with the errors c_w of window w, the values d_w of the unknown input at the nodes, and the changes t
of the parameters of the fit, which all windows share. A wrong parameter therefore is no unknown
input where its prior allows the change. K is that of an Ornstein-Uhlenbeck process. Linear in all
unknowns, the posterior is normal: it is that of a smoother for unknown inputs (S. Gillijns, B. De
Moor, Automatica 43(1), 2007, have the filter for unknown inputs without a prior). The size q and
the variances are those of the largest evidence, by the fixed point of D. J. C. MacKay, Bayesian
Interpolation, Neural Computation 4(3), 1992.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ehsid.harness.arrays import FloatArray

ROUNDS = 8
# Largest change of the size q in all rounds, and the share of its variance that every node has for
# itself, so that the covariance of close nodes is regular.
SIZE_RANGE = 1e4
OWN_SHARE = 1e-6


@dataclass(frozen=True, eq=False)
class Part:
    """Windows of one record: W windows of R errors, n nodes and p shared parameters.

    Attributes
    ----------
    errors
        shape (W, R).
    responses
        derivatives by the values at the nodes, shape (W, R, n).
    slopes
        derivatives by the shared parameters, shape (W, R, p).
    known
        what the shared parameters add to the input at the nodes, shape (W, n, p).
    correlation
        K, shape (n, n).
    """

    errors: FloatArray
    responses: FloatArray
    slopes: FloatArray
    known: FloatArray
    correlation: FloatArray


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Posterior: by part the mean, (W, n), and deviation, (W, n), of the whole unknown input.

    Attributes
    ----------
    size
        standard deviation q of the input by the prior.
    changes
        mean of the shared parameters, shape (p,).
    evidence
        logarithm of the probability of the errors, nats.
    rest, spread
        errors that remain at the mean, by part, shape (W, R), and the variances of what the
        posterior makes of them, without the noise.
    next_size
        size q that this posterior asks for.
    """

    means: tuple[FloatArray, ...]
    deviations: tuple[FloatArray, ...]
    size: float
    changes: FloatArray
    evidence: float
    rest: tuple[FloatArray, ...]
    spread: tuple[FloatArray, ...]
    next_size: float


def ornstein_uhlenbeck(count: int, spacing_s: float, corner_hz: float) -> FloatArray:
    """Correlation of the process with that corner frequency at nodes, shape (count, count)."""
    apart = spacing_s * np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    return np.asarray(np.exp(-2.0 * np.pi * corner_hz * apart) + OWN_SHARE * np.eye(count))


def posterior(
    parts: Sequence[Part], variance: FloatArray, size: float, information: FloatArray
) -> Smoothed:
    """Posterior for given variances of the errors, shape (R,), and size q of the input."""
    weights = 1.0 / variance
    shared = np.diag(information)
    right = np.zeros(information.size)
    evidence = 0.5 * float(np.sum(np.log(information)))
    inner: list[tuple[FloatArray, FloatArray, FloatArray, FloatArray]] = []
    for part in parts:
        weighted = part.responses * weights[:, np.newaxis]
        turned = np.swapaxes(weighted, 1, 2)
        prior = np.asarray(np.linalg.inv(size**2 * part.correlation), dtype=np.float64)
        precision = turned @ part.responses + prior
        covariance = np.asarray(np.linalg.inv(precision), dtype=np.float64)
        mixed = turned @ part.slopes
        by_errors: FloatArray = np.einsum("wnr,wr->wn", turned, part.errors, optimize=True)
        gain = covariance @ mixed
        slopes = part.slopes * weights[:, np.newaxis]
        shared = shared + np.tensordot(slopes, part.slopes, axes=((0, 1), (0, 1)))
        shared = shared - np.tensordot(mixed, gain, axes=((0, 1), (0, 1)))
        right = right - np.tensordot(slopes, part.errors, axes=((0, 1), (0, 1)))
        right = right + np.tensordot(gain, by_errors, axes=((0, 1), (0, 1)))
        explained = np.einsum("wn,wnm,wm->", by_errors, covariance, by_errors, optimize=True)
        windows = part.errors.shape[0]
        evidence += 0.5 * float(
            explained
            - np.sum(weights * part.errors**2)
            - windows * np.sum(np.log(2.0 * np.pi * variance))
            - np.linalg.slogdet(precision)[1].sum()
            + windows * np.linalg.slogdet(prior)[1]
        )
        inner.append((prior, covariance, gain, by_errors))
    of_shared = np.asarray(np.linalg.inv(shared), dtype=np.float64)
    changes = of_shared @ right
    evidence += 0.5 * float(right @ changes - np.linalg.slogdet(shared)[1])
    return _collected(parts, inner, changes, of_shared, size, evidence)


def _collected(
    parts: Sequence[Part],
    inner: Sequence[tuple[FloatArray, FloatArray, FloatArray, FloatArray]],
    changes: FloatArray,
    of_shared: FloatArray,
    size: float,
    evidence: float,
) -> Smoothed:
    """The posterior of all parts from those of the nodes for given shared parameters."""
    root = np.linalg.cholesky(of_shared)
    means, deviations, rests, spreads = [], [], [], []
    squares, free = 0.0, 0.0
    for part, (prior, covariance, gain, by_errors) in zip(parts, inner, strict=True):
        # The errors are simulated less measured: an input that explains them has the other sign.
        own = -np.einsum("wnm,wm->wn", covariance, by_errors) - gain @ changes
        marginal = gain @ root
        squares += float(np.einsum("wn,nm,wm->", own, prior, own, optimize=True))
        taken = np.einsum("nm,wmn->", prior, covariance)
        taken += np.einsum("nm,wmk,wnk->", prior, marginal, marginal, optimize=True)
        free += own.size - float(taken)
        whole = (part.known - gain) @ root
        variances = np.einsum("wnn->wn", covariance) + np.sum(whole**2, axis=2)
        means.append(own + part.known @ changes)
        deviations.append(np.sqrt(variances))
        rest = part.errors + part.slopes @ changes
        rest = rest + np.einsum("wrn,wn->wr", part.responses, own, optimize=True)
        spread = np.sum((part.responses @ np.linalg.cholesky(covariance)) ** 2, axis=2)
        spread += np.sum(((part.slopes - part.responses @ gain) @ root) ** 2, axis=2)
        rests.append(rest)
        spreads.append(spread)
    next_size = size * float(np.sqrt(squares / max(free, 1e-3)))
    return Smoothed(
        tuple(means),
        tuple(deviations),
        size,
        changes,
        evidence,
        tuple(rests),
        tuple(spreads),
        next_size,
    )


def smooth(
    parts: Sequence[Part],
    least: FloatArray,
    group: npt.NDArray[np.int64],
    size: float,
    information: FloatArray,
) -> Smoothed:
    """Posterior with the size q and the variances of the errors of the largest evidence.

    Parameters
    ----------
    parts
        windows.
    least
        variance of the errors of an exact model, shape (R,).
    group
        number of the group of errors with the same variance, shape (R,).
    size
        size q where the search begins.
    information
        of the prior of the shared parameters, shape (p,).
    """
    windows = sum(part.errors.shape[0] for part in parts)

    def by_group(squares: Sequence[FloatArray]) -> FloatArray:
        total = np.sum([each.sum(axis=0) for each in squares], axis=0)
        return np.asarray(np.bincount(group, total), dtype=np.float64)

    def variances(squares: FloatArray, free: FloatArray) -> FloatArray:
        return np.asarray(np.maximum(least, (squares / np.maximum(free, 1.0))[group]))

    best, start = None, size
    rows = windows * np.bincount(group).astype(np.float64)
    variance = variances(by_group([part.errors**2 for part in parts]), rows)
    for _ in range(ROUNDS):
        found = posterior(parts, variance, size, information)
        if best is None or found.evidence > best.evidence:
            best = found
        size = min(max(found.next_size, start / SIZE_RANGE), start * SIZE_RANGE)
        # Errors that the input takes up are not free any more.
        taken = by_group([each / variance for each in found.spread])
        variance = variances(by_group([each**2 for each in found.rest]), rows - taken)
    assert best is not None
    return best
