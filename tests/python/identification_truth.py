# SPDX-License-Identifier: MIT
"""Data with a known truth for the tests of the identification, made without the code under test."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

# Ghazali et al. 2011, Eq. (16).
A16 = np.array([-2.2390, 1.7820, -0.5427])
B16 = np.array([0.3850, -0.5810, 0.2954])


def arx_output(
    a: FloatArray, b: FloatArray, nk: int, u: FloatArray, e: FloatArray, offset: float = 0.0
) -> FloatArray:
    """y(k) = -a1 y(k-1) - .. + b1 u(k-nk) + .. + offset + e(k) from rest, one sample at a time."""
    y = np.zeros_like(u)
    for k in range(u.size):
        y[k] = offset + e[k]
        for i, coefficient in enumerate(a, start=1):
            if k >= i:
                y[k] -= coefficient * y[k - i]
        for i, coefficient in enumerate(b):
            if k >= nk + i:
                y[k] += coefficient * u[k - nk - i]
    return y


def model16(
    seed: int, n: int, *, noise: float = 0.1, nk: int = 1, offset: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Input (white, unit variance) and output of model (16) with white equation noise."""
    rng = np.random.default_rng(seed)
    u, e = rng.normal(size=n), noise * rng.normal(size=n)
    return u, arx_output(A16, B16, nk, u, e, offset)
