# SPDX-License-Identifier: MIT
"""Random-phase multisines.

R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012,
ch. 4 and 5.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .excitation import Excitation


def multisine(
    n: int,
    dt_s: float,
    *,
    band_hz: tuple[float, float],
    rms: float | None = None,
    peak: float | None = None,
    rng: np.random.Generator,
) -> npt.NDArray[np.float64]:
    """Returns a multisine with equal amplitudes and random phases at all lines of the band.

    Parameters
    ----------
    n
        number of samples in the one period returned, at least 1.
    dt_s
        sampling time in seconds, > 0.
    band_hz
        lowest and highest frequency, 0 < low <= high < 1 / (2 dt_s). The spectral lines are the
        multiples of 1 / (n dt_s) inside the band.
    rms, peak
        root mean square and largest magnitude of the signal, in its own unit, finite, > 0. If one
        is given, the signal is scaled to it. If both are given, the signal has this rms and no
        sample larger than peak.
    rng
        generator that draws the phases.

    Returns
    -------
    One period of the signal, shape (n,), mean zero.

    Raises
    ------
    ValueError
        an argument is outside its range, the band contains no line, or the signal of this rms
        exceeds the peak; in the last case the message gives an rms and a peak that fit.
    """
    first, last = _lines(n, dt_s, band_hz)
    return _sum_of_lines(n, np.arange(first, last + 1), rms, peak, rng)


def odd_multisine(
    n: int,
    dt_s: float,
    *,
    band_hz: tuple[float, float],
    rms: float | None = None,
    peak: float | None = None,
    rng: np.random.Generator,
    group: int = 4,
) -> Excitation:
    """Returns a multisine with the odd lines of the band, without one random line of each group.

    A group has `group` consecutive odd lines, group >= 2. Lines at the upper end of the band that
    do not fill a group are all kept. The other arguments and the errors are those of `multisine`.
    Source: Pintelon, Schoukens 2012, ch. 4.
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
    return Excitation(
        _sum_of_lines(n, excited, rms, peak, rng),
        dt_s,
        "multisine",
        f"odd random-phase multisine, {band_hz[0]:g} to {band_hz[1]:g} Hz, {excited.size} lines, "
        f"{left_out.size} odd lines left out",
        excited=excited,
        detection=odd[left_out],
    )


def _lines(n: int, dt_s: float, band_hz: tuple[float, float]) -> tuple[int, int]:
    """Returns the numbers of the first and last multiple of 1 / (n dt_s) inside the band."""
    if not (n >= 1 and 0.0 < dt_s < np.inf):
        raise ValueError(f"multisine: n = {n}, dt_s = {dt_s:g}: expected n >= 1, a finite dt_s > 0")
    low, high = band_hz
    if not 0.0 < low <= high < 0.5 / dt_s:
        raise ValueError(
            f"band_hz = ({low:g}, {high:g}): expected 0 < low <= high < {0.5 / dt_s:g}, "
            "half the sampling rate"
        )
    # A line that misses the edge of the band only by a rounding error counts as inside. The line at
    # half the sampling rate never does, because it has no phase.
    first = int(np.ceil(low * n * dt_s * (1.0 - 1e-12)))
    last = min(int(np.floor(high * n * dt_s * (1.0 + 1e-12))), (n - 1) // 2)
    if last < first:
        raise ValueError(
            f"band_hz = ({low:g}, {high:g}) holds no multiple of 1 / (n dt_s) = "
            f"{1.0 / (n * dt_s):g} Hz: widen it or take more samples"
        )
    return first, last


def _sum_of_lines(
    n: int,
    lines: npt.NDArray[np.int64],
    rms: float | None,
    peak: float | None,
    rng: np.random.Generator,
) -> npt.NDArray[np.float64]:
    for name, value in (("rms", rms), ("peak", peak)):
        if value is not None and not 0.0 < value < np.inf:
            raise ValueError(f"multisine: {name} = {value:g}: expected a finite {name} > 0")
    spectrum = np.zeros(n // 2 + 1, dtype=np.complex128)
    spectrum[lines] = np.exp(2j * np.pi * rng.random(lines.size))
    signal = np.fft.irfft(spectrum, n)
    if rms is not None:
        signal = signal * (rms / np.sqrt(np.mean(signal**2)))
        reached = float(np.abs(signal).max())
        if peak is not None and reached > peak:
            raise ValueError(
                f"multisine: rms = {rms:g} with these phases has peaks of {reached:.4g}, beyond "
                f"peak = {peak:g}: this peak allows an rms of {0.999 * rms * peak / reached:.4g}, "
                f"this rms needs a peak of {1.001 * reached:.4g}; another seed has other peaks"
            )
    elif peak is not None:
        # Rounding errors must not exceed the peak.
        signal = np.clip(signal * (peak / np.abs(signal).max()), -peak, peak)
    else:
        raise ValueError("multisine: neither rms nor peak is given: expected one of them, or both")
    return np.asarray(signal, dtype=np.float64)
