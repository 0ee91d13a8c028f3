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

from ...base.numbers import FloatArray

ROUNDS = 8
# Largest change of the size q in all rounds, and the share of its variance that every node has for
# itself, so that the covariance of close nodes is regular.
SIZE_RANGE = 1e4
OWN_SHARE = 1e-6


@dataclass(frozen=True, eq=False)
class Part:
    """Windows of one record: W windows of R errors, n nodes and p shared parameters."""

    errors: FloatArray
    """Shape (W, R)."""
    responses: FloatArray
    """Derivatives by the values at the nodes, shape (W, R, n)."""
    slopes: FloatArray
    """Derivatives by the shared parameters, shape (W, R, p)."""
    known: FloatArray
    """What the shared parameters add to the input at the nodes, shape (W, n, p)."""
    correlation: FloatArray
    """K, shape (n, n)."""


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Posterior: by part the mean, (W, n), and deviation, (W, n), of the whole unknown input."""

    means: tuple[FloatArray, ...]
    deviations: tuple[FloatArray, ...]
    size: float
    """Standard deviation q of the input by the prior."""
    changes: FloatArray
    """Mean of the shared parameters, shape (p,)."""
    evidence: float
    """Logarithm of the probability of the errors, nats."""
    rest: tuple[FloatArray, ...]
    spread: tuple[FloatArray, ...]
    """Errors that remain at the mean, by part, shape (W, R), and the variances of what the
    posterior makes of them, without the noise."""
    next_size: float
    """Size q that this posterior asks for."""


def ornstein_uhlenbeck(count: int, spacing_s: float, corner_hz: float) -> FloatArray:
    """Correlation of the process with that corner frequency at nodes, shape (count, count)."""
    apart = spacing_s * np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    return np.asarray(np.exp(-2.0 * np.pi * corner_hz * apart) + OWN_SHARE * np.eye(count))


def posterior(
    parts: Sequence[Part], variance: FloatArray, size: float, information: FloatArray
) -> Smoothed:
    """Posterior for given variances of the errors, shape (R,), and size q of the input.

    All unknowns are eliminated by orthogonal triangles (G. J. Bierman, Factorization Methods for
    Discrete Sequential Estimation, Academic Press 1977, ch. IV-V): no matrix of squares is built,
    inverted or subtracted from another one, so that rounding cannot make one indefinite. In each
    window, with d = q L z, L L' = K, and errors of deviation 1, that is

        [ G q L   S   c ]         [ R   U   v ]
        [   I     0   0 ]  =  Q * [ 0   T   r ]
    """
    scale = 1.0 / np.sqrt(variance)
    rows = [np.column_stack([np.diag(np.sqrt(information)), np.zeros(information.size)])]
    evidence = 0.5 * float(np.sum(np.log(information)))
    inner: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    for part in parts:
        windows, nodes = part.responses.shape[0], part.responses.shape[2]
        root = np.asarray(size * np.linalg.cholesky(part.correlation), dtype=np.float64)
        whole = np.concatenate(
            [part.responses @ root, part.slopes, part.errors[:, :, np.newaxis]], axis=2
        )
        of_prior = np.tile(np.eye(nodes, whole.shape[2]), (windows, 1, 1))
        triangles = _triangles(np.concatenate([scale[:, np.newaxis] * whole, of_prior], axis=1))
        rows.append(triangles[:, nodes:, nodes:].reshape(-1, information.size + 1))
        own = triangles[:, :nodes, :nodes]
        evidence -= float(np.sum(np.log(np.abs(np.einsum("wnn->wn", own)))))
        evidence -= 0.5 * windows * float(np.sum(np.log(2.0 * np.pi * variance)))
        inverse = np.asarray(np.linalg.inv(own), dtype=np.float64)
        inner.append((root, inverse, triangles[:, :nodes, nodes:]))
    shared = _triangles(np.concatenate(rows))
    evidence -= float(np.sum(np.log(np.abs(np.diag(shared)[:-1]))) + 0.5 * shared[-1, -1] ** 2)
    of_shared = np.asarray(np.linalg.inv(shared[:-1, :-1]), dtype=np.float64)
    return _collected(parts, inner, of_shared, shared[:-1, -1], size, evidence)


def _triangles(matrices: FloatArray) -> FloatArray:
    """The upper triangles R of the factors Q R of the matrices."""
    return np.asarray(np.linalg.qr(matrices, mode="r"), dtype=np.float64)


def _collected(
    parts: Sequence[Part],
    inner: Sequence[tuple[FloatArray, FloatArray, FloatArray]],
    of_shared: FloatArray,
    right: FloatArray,
    size: float,
    evidence: float,
) -> Smoothed:
    """The posterior of all parts from the triangles.

    Parameters
    ----------
    parts
        windows.
    inner
        by part q L, the inverse of R, and [U v].
    of_shared, right
        root of the covariance of the shared parameters, and what it is multiplied by.
    size, evidence
        as of `Smoothed`.
    """
    # The errors are simulated less measured: an input that explains them has the other sign.
    changes = -of_shared @ right
    means, deviations, rests, spreads = [], [], [], []
    squares, free = 0.0, 0.0
    for part, (root, inverse, beside) in zip(parts, inner, strict=True):
        solved = inverse @ beside
        z = -(solved @ np.append(changes, 1.0))
        squares += float(np.sum(z**2))
        marginal = solved[:, :, :-1] @ of_shared
        free += z.size - float(np.sum(inverse**2) + np.sum(marginal**2))
        own, gain, of_nodes = z @ root.T, root @ solved[:, :, :-1], root @ inverse
        whole = (part.known - gain) @ of_shared
        variances = np.sum(of_nodes**2, axis=2) + np.sum(whole**2, axis=2)
        means.append(own + part.known @ changes)
        deviations.append(np.sqrt(variances))
        rest = part.errors + part.slopes @ changes
        rest = rest + np.einsum("wrn,wn->wr", part.responses, own, optimize=True)
        spread = np.sum((part.responses @ of_nodes) ** 2, axis=2)
        spread += np.sum(((part.slopes - part.responses @ gain) @ of_shared) ** 2, axis=2)
        rests.append(rest)
        spreads.append(spread)
    return Smoothed(
        tuple(means),
        tuple(deviations),
        size,
        changes,
        evidence,
        tuple(rests),
        tuple(spreads),
        size * float(np.sqrt(squares / max(free, 1e-3))),
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
