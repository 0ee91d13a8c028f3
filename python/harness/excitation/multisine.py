# SPDX-License-Identifier: MIT
"""Random-phase multisines.

R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012,
sec. 2.3.
"""

from __future__ import annotations

from dataclasses import dataclass

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
    first, last = _lines(n, dt_s, band_hz)
    return _sum_of_lines(n, np.arange(first, last + 1), rms, rng)


@dataclass(frozen=True, eq=False)
class OddMultisine:
    """A multisine of odd lines, some of them left out.

    Attributes
    ----------
    samples
        shape (n,), mean zero; one period.
    excited, detection
        lines, as multiples of 1 / (n dt_s), that are there, and odd ones left out: at those, and
        at even lines, a linear plant answers nothing.
    """

    samples: npt.NDArray[np.float64]
    excited: npt.NDArray[np.int64]
    detection: npt.NDArray[np.int64]


def odd_multisine(
    n: int,
    dt_s: float,
    *,
    band_hz: tuple[float, float],
    rms: float,
    rng: np.random.Generator,
    group: int = 4,
) -> OddMultisine:
    """Odd lines of the band; of each `group` in a row one, drawn by chance, is left out.

    Pintelon, Schoukens 2012, sec. 4.3. Arguments and errors as in `multisine`; group >= 2.
    """
    first, last = _lines(n, dt_s, band_hz)
    odd = np.arange(first + 1 - first % 2, last + 1, 2)
    if group < 2 or odd.size < group:
        raise ValueError(
            f"odd_multisine: {odd.size} odd lines in the band, group = {group}: expected "
            "group >= 2 and at least one whole group"
        )
    starts = np.arange(0, odd.size - group + 1, group)
    left_out = starts + rng.integers(0, group, size=starts.size)
    excited = np.delete(odd, left_out)
    return OddMultisine(_sum_of_lines(n, excited, rms, rng), excited, odd[left_out])


def _lines(n: int, dt_s: float, band_hz: tuple[float, float]) -> tuple[int, int]:
    """First and last multiple of 1 / (n dt_s) inside the band."""
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
    return first, last


def _sum_of_lines(
    n: int, lines: npt.NDArray[np.int64], rms: float, rng: np.random.Generator
) -> npt.NDArray[np.float64]:
    spectrum = np.zeros(n // 2 + 1, dtype=np.complex128)
    spectrum[lines] = np.exp(2j * np.pi * rng.random(lines.size))
    signal = np.fft.irfft(spectrum, n)
    return np.asarray(signal * (rms / np.sqrt(np.mean(signal**2))), dtype=np.float64)
