# SPDX-License-Identifier: MIT
"""Slow triangles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.signal import sawtooth


def triangle(n: int, dt_s: float, *, amplitude: float, period_s: float) -> npt.NDArray[np.float64]:
    """From zero to amplitude, to -amplitude and back, in straight lines.

    Parameters
    ----------
    n
        samples, at least 1.
    dt_s
        sampling time in seconds.
    amplitude
        >= 0.
    period_s
        in seconds, at least four samples.
    """
    if not (n >= 1 and amplitude >= 0.0 and period_s >= 4.0 * dt_s > 0.0):
        raise ValueError(
            f"triangle: n = {n}, amplitude = {amplitude:g}, period_s = {period_s:g}: expected "
            f"n >= 1, amplitude >= 0, period_s >= {4.0 * dt_s:g}"
        )
    phase = 2.0 * np.pi * np.arange(n) * dt_s / period_s
    # sawtooth of width 0.5 starts at -1; a quarter of a period later it passes zero, upwards.
    return np.asarray(amplitude * sawtooth(phase + 0.5 * np.pi, 0.5), dtype=np.float64)
