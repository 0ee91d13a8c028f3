# SPDX-License-Identifier: MIT
"""Noise floor of a measured signal: what no simulator can explain."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

# Order of the differences. A motion of w rad/s is left with (2 sin(w dt / 2))^7 / sqrt(C(14, 7)) of
# its amplitude: 6e-5 for an oil spring of 70 Hz at 1 kHz, where third differences leave 2 %.
ORDER = 7
BLOCKS = 20
# Median of |x| of a normal deviate.
NORMAL_MEDIAN = 0.6744897501960817


@dataclass(frozen=True)
class NoiseFloor:
    """Standard deviation of the noise, and the interval of 90 % over blocks of the record."""

    value: float
    low: float
    high: float


def noise_floor(signal: npt.ArrayLike) -> NoiseFloor:
    """From what is too fast for a servo: seventh differences, median over blocks.

    White noise of deviation s has k-th differences of deviation s sqrt(C(2k, k)). Where the sensor
    shows whole steps q and stands still in most of them, q / sqrt(12) is the floor. Noise of low
    frequency is not seen: the floor is then too low.

    Parameters
    ----------
    signal
        shape (N,), N >= 200, sampled evenly.

    Raises
    ------
    ValueError
        fewer samples.
    """
    samples = np.asarray(signal, dtype=np.float64)
    if samples.ndim != 1 or samples.size < BLOCKS * 10:
        raise ValueError(f"a noise floor needs {BLOCKS * 10} samples, there are {samples.size}")
    differences = np.diff(samples, ORDER) / math.sqrt(math.comb(2 * ORDER, ORDER))
    quantisation = _step(samples) / math.sqrt(12.0)
    by_block = [
        max(float(np.median(np.abs(block))) / NORMAL_MEDIAN, quantisation)
        for block in np.array_split(differences, BLOCKS)
    ]
    low, value, high = np.quantile(by_block, [0.05, 0.5, 0.95])
    return NoiseFloor(float(value), float(low), float(high))


def _step(samples: FloatArray) -> float:
    """Least step of a quantised signal; zero where values are all different."""
    levels = np.unique(samples)
    if levels.size < 2 or levels.size > samples.size // 2:
        return 0.0
    steps = np.diff(levels)
    # Rounding in a text file splits equal levels by some 1e-12 of them.
    real = steps[steps > 1e-9 * np.abs(levels).max()]
    return float(real.min()) if real.size else 0.0
