# SPDX-License-Identifier: MIT
"""Slow triangular signals."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy.signal import sawtooth


def triangle(n: int, dt_s: float, *, amplitude: float, period_s: float) -> npt.NDArray[np.float64]:
    """Returns a triangular signal, shape (n,), that starts at zero and rises to amplitude first.

    Parameters
    ----------
    n
        number of samples, at least 1; see `triangle_length`.
    dt_s
        sampling time in seconds, > 0.
    amplitude
        amplitude in the unit of the command, finite, >= 0.
    period_s
        period in seconds, finite, at least 4 dt_s.
    """
    _check_period(dt_s, period_s)
    if not (n >= 1 and 0.0 <= amplitude < np.inf):
        raise ValueError(
            f"triangle: n = {n}, amplitude = {amplitude:g}: expected n >= 1, finite amplitude >= 0"
        )
    phase = 2.0 * np.pi * np.arange(n) * dt_s / period_s
    # A sawtooth of width 0.5 starts at -1. A quarter of a period later it passes zero upwards.
    signal = amplitude * sawtooth(phase + 0.5 * np.pi, 0.5)
    # Rounding errors at a corner must not exceed the amplitude.
    return np.asarray(np.clip(signal, -amplitude, amplitude), dtype=np.float64)


def triangle_length(dt_s: float, *, period_s: float, reversals: int) -> int:
    """Returns the number of samples of a triangle that has `reversals` reversals and ends at zero.

    The end is at zero to within one sample. Each half period, from zero to zero, has one reversal
    in its middle.

    Parameters
    ----------
    dt_s, period_s
        as in `triangle`.
    reversals
        number of reversals, >= 1.
    """
    _check_period(dt_s, period_s)
    if reversals < 1:
        raise ValueError(f"triangle_length: reversals = {reversals}: expected reversals >= 1")
    # The factor keeps a rounding error from raising a whole number of samples by one.
    return math.ceil(0.5 * reversals * period_s / dt_s * (1.0 - 1e-12)) + 1


def _check_period(dt_s: float, period_s: float) -> None:
    if not (dt_s > 0.0 and 4.0 * dt_s <= period_s < np.inf):
        raise ValueError(
            f"triangle: dt_s = {dt_s:g}, period_s = {period_s:g}: expected dt_s > 0, finite "
            f"period_s >= {4.0 * dt_s:g}"
        )
