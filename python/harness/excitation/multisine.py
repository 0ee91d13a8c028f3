# SPDX-License-Identifier: MIT
"""Random-phase multisine.

R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012,
sec. 2.3.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def multisine(
    n: int, dt_s: float, *, band_hz: tuple[float, float], rms: float, rng: np.random.Generator
) -> npt.NDArray[np.float64]:
    """All lines of the band with equal amplitude and random phase; the n samples are one period.

    Parameters
    ----------
    n
        samples.
    dt_s
        sampling time in seconds.
    band_hz
        lowest and highest frequency, 0 < low <= high < 1 / (2 dt_s). The lines are the multiples
        of 1 / (n dt_s) inside.
    rms
        of the signal, in its own unit.
    rng
        draws the phases.

    Returns
    -------
    shape (n,), mean zero.

    Raises
    ------
    ValueError
        a band outside the limits, or one without a line.
    """
    low, high = band_hz
    if not 0.0 < low <= high < 0.5 / dt_s:
        raise ValueError(
            f"band_hz = ({low:g}, {high:g}): expected 0 < low <= high < {0.5 / dt_s:g}, "
            "half the sampling rate"
        )
    # A line that falls on the edge of the band but for rounding counts as inside.
    first = int(np.ceil(low * n * dt_s * (1.0 - 1e-12)))
    last = int(np.floor(high * n * dt_s * (1.0 + 1e-12)))
    if last < first:
        raise ValueError(
            f"band_hz = ({low:g}, {high:g}) holds no multiple of 1 / (n dt_s) = "
            f"{1.0 / (n * dt_s):g} Hz: widen it or take more samples"
        )
    spectrum = np.zeros(n // 2 + 1, dtype=np.complex128)
    spectrum[first : last + 1] = np.exp(2j * np.pi * rng.random(last - first + 1))
    signal = np.fft.irfft(spectrum, n)
    return np.asarray(signal * (rms / np.sqrt(np.mean(signal**2))), dtype=np.float64)
