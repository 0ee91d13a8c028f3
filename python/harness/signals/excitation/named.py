# SPDX-License-Identifier: MIT
"""Test signals by their names, for those who choose one from a list."""

from __future__ import annotations

import numpy as np

from ...base.arrays import FloatArray
from .chirp import chirp
from .multisine import odd_multisine
from .prbs import prbs
from .steps import random_steps
from .triangle import triangle

SIGNALS = ("multisine", "prbs", "steps", "chirp", "triangle")


def named_signal(
    name: str, n: int, dt_s: float, *, peak: float, top_hz: float, seed: int
) -> FloatArray:
    """Returns a signal with this peak that excites up to about `top_hz`, shape (n,).

    Parameters
    ----------
    name
        one of `SIGNALS`.
    n, dt_s
        number of samples, and sampling time in seconds.
    peak
        largest size, in the unit of the signal.
    top_hz
        highest frequency, Hz.
    seed
        of the random numbers.

    Raises
    ------
    ValueError
        there is no signal of this name.
    """
    rng = np.random.default_rng(seed)
    duration = n * dt_s
    low = max(top_hz / 200.0, 2.0 / duration)
    match name:
        case "multisine":
            return odd_multisine(n, dt_s, band_hz=(low, top_hz), peak=peak, rng=rng).samples
        case "prbs":
            return prbs(n, amplitude=peak, hold=max(1, round(0.4 / (top_hz * dt_s))))
        case "steps":
            hold = (max(1, round(1.0 / (top_hz * dt_s))), max(1, round(10.0 / (top_hz * dt_s))))
            return random_steps(n, amplitude=peak, hold=hold, rng=rng)
        case "chirp":
            return chirp(n, dt_s, amplitude=peak, band_hz=(low, top_hz))
        case "triangle":
            return triangle(n, dt_s, amplitude=peak, period_s=duration / 4.0)
    raise ValueError(f"{name!r}: expected one of {', '.join(SIGNALS)}")
