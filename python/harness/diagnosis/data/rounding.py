# SPDX-License-Identifier: MIT
"""Rounding errors of a sensor with a coarse grid, as the record itself shows them."""

from __future__ import annotations

import numpy as np

from ...base.arrays import FloatArray
from .floor import sensor_step


def rounding_errors(samples: FloatArray) -> FloatArray:
    """Estimates the error of each sample that comes from rounding to a grid; zero without a grid.

    Where a slow signal steps from one level to the next one, it passes the middle between them: a
    line through these crossings is the signal without its rounding. The errors are those of the
    samples from that line. Unlike those of W. R. Bennett (Bell Syst. Tech. J. 27(3), 1948) they
    are not white: a slow signal stays on each level for long.

    Parameters
    ----------
    samples
        shape (N,), in any unit.

    Returns
    -------
    shape (N,), within half a step of the grid.
    """
    step = sensor_step(samples)
    crossings = np.flatnonzero(np.diff(samples) != 0.0)
    if step == 0.0 or crossings.size < 2:
        return np.zeros(samples.size)
    middles = 0.5 * (samples[crossings] + samples[crossings + 1])
    line = np.interp(np.arange(samples.size), crossings + 0.5, middles)
    return np.asarray(np.clip(samples - line, -0.5 * step, 0.5 * step))
