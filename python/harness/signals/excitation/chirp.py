# SPDX-License-Identifier: MIT
"""Chirp: a sine whose frequency increases."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import scipy.signal


def chirp(
    n: int,
    dt_s: float,
    *,
    amplitude: float,
    band_hz: tuple[float, float],
) -> npt.NDArray[np.float64]:
    """Returns a logarithmic chirp that starts at zero, shape (n,).

    The frequency increases exponentially with time from the low to the high end of the band.

    Parameters
    ----------
    n
        number of samples, at least 2.
    dt_s
        sampling time in seconds, > 0.
    amplitude
        amplitude in the unit of the command, finite, >= 0.
    band_hz
        frequencies at start and end, 0 < low < high < 1 / (2 dt_s).
    """
    if not 0.0 < dt_s < np.inf:
        raise ValueError(f"chirp: dt_s = {dt_s:g}: expected a finite dt_s > 0")
    low, high = band_hz
    if not (n >= 2 and 0.0 <= amplitude < np.inf and 0.0 < low < high < 0.5 / dt_s):
        raise ValueError(
            f"chirp: n = {n}, amplitude = {amplitude:g}, band_hz = {band_hz}: expected n >= 2, "
            f"finite amplitude >= 0, 0 < low < high < {0.5 / dt_s:g}"
        )
    time = np.arange(n) * dt_s
    phase = scipy.signal.chirp(time, low, time[-1], high, method="logarithmic", phi=-90.0)
    return np.asarray(amplitude * phase, dtype=np.float64)
