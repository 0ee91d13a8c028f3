# SPDX-License-Identifier: MIT
"""Signals of model (16) of Ghazali et al. (2011) and ARX regressors, made with scipy and numpy."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import scipy.signal

FloatArray = npt.NDArray[np.float64]

A = np.array([-2.2390, 1.7820, -0.5427])
B = np.array([0.3850, -0.5810, 0.2954])
THETA = np.concatenate((A, B))


def output(
    u: FloatArray, e: FloatArray, b: FloatArray = B, y_past: FloatArray | None = None
) -> FloatArray:
    """A(q^-1) y(k) = q^-1 B(q^-1) u(k) + e(k), from rest or behind past outputs, newest last."""
    equation = np.convolve(u, np.concatenate(([0.0], b)))[: u.size] + e
    denominator = np.concatenate(([1.0], A))
    past = np.zeros(3) if y_past is None else y_past[:-4:-1]
    state = scipy.signal.lfiltic([1.0], denominator, past)
    return np.asarray(scipy.signal.lfilter([1.0], denominator, equation, zi=state)[0])


def signals(seed: int, n: int, noise: float = 0.1) -> tuple[FloatArray, FloatArray]:
    """Random binary input of size one, and the output with white equation noise."""
    rng = np.random.default_rng(seed)
    u = rng.choice([-1.0, 1.0], size=n)
    return u, output(u, noise * rng.normal(size=n))


def changing(seed: int, n: int, changes: dict[int, float], noise: float) -> tuple[FloatArray, ...]:
    """Input and output of model (16) whose b is multiplied at the given samples."""
    rng = np.random.default_rng(seed)
    u, gain = rng.choice([-1.0, 1.0], size=n), np.ones(n)
    for start, factor in changes.items():
        gain[start:] *= factor
    # The output equation takes gain(k) b: gain u delayed by one sample would change b piecemeal.
    past = np.lib.stride_tricks.sliding_window_view(np.pad(u, (3, 0)), 3)[:n, ::-1]
    equation = gain * (past @ B) + noise * rng.normal(size=n)
    return u, output(np.zeros(n), equation)


def regressors(
    u: FloatArray, y: FloatArray, na: int = 3, nb: int = 3, nk: int = 1, offset: bool = False
) -> tuple[FloatArray, FloatArray]:
    """phi(k) of Eq. (8), shape (N, n), and y(k), for every k with a complete past."""
    k = np.arange(max(na, nk + nb - 1), u.size)
    columns = [-y[k - i] for i in range(1, na + 1)] + [u[k - nk - i] for i in range(nb)]
    if offset:
        columns.append(np.ones(k.size))
    return np.column_stack(columns), y[k]
