# SPDX-License-Identifier: MIT
"""A test signal with the data that its evaluation needs later, and random-phase multisines.

R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012,
ch. 4 and 5.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt


def _no_lines() -> npt.NDArray[np.int64]:
    return np.empty(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Excitation:
    """A command signal, checked against its limit.

    Add an offset before: `Excitation(0.5 + prbs(...), dt_s, "prbs", limit_v=10.0)`.

    Raises
    ------
    ValueError
        a value is outside its range, or a sample is beyond the limit. The signal is not clipped,
        because a clipped signal has another spectrum than the requested one.
    """

    samples: npt.NDArray[np.float64]
    """Command in volts, shape (n,), n >= 1, finite."""
    dt_s: float
    """Sampling time in seconds, > 0."""
    name: str
    description: str = ""
    """A word and a sentence for the reader."""
    excited: npt.NDArray[np.int64] = field(default_factory=_no_lines)
    detection: npt.NDArray[np.int64] = field(default_factory=_no_lines)
    """Spectral lines of a multisine as multiples of 1 / (n dt_s): the lines in the signal, and the
    odd lines left out. At the latter, as at even lines, a linear plant gives no response. Both are
    empty for other signals."""
    limit_v: float = np.inf
    """Largest allowed magnitude of a sample in volts, >= 0; infinite if there is no limit."""

    def __post_init__(self) -> None:
        if not 0.0 < self.dt_s < np.inf:
            raise ValueError(f"{self.name}: dt_s = {self.dt_s:g}: expected a finite dt_s > 0")
        if not self.limit_v >= 0.0:
            raise ValueError(f"{self.name}: limit_v = {self.limit_v:g}: expected limit_v >= 0")
        check_samples(self.name, self.samples)
        largest = int(np.argmax(np.abs(self.samples)))
        peak = float(np.abs(self.samples[largest]))
        if peak > self.limit_v:
            raise ValueError(
                f"{self.name}: {self.samples[largest]:g} V at {largest * self.dt_s:g} s is beyond "
                f"limit_v = {self.limit_v:g}: scale the signal, its offset included, by at most "
                f"{0.999 * self.limit_v / peak:.4g}, or lower the offset"
            )


def check_samples(name: str, samples: npt.NDArray[np.float64]) -> None:
    """Raises ValueError unless the samples have shape (n,), n >= 1, and are finite.

    The message begins with the name.
    """
    if samples.ndim != 1 or samples.size == 0:
        raise ValueError(f"{name}: samples of shape {samples.shape}: expected (n,), n >= 1")
    bad = np.flatnonzero(~np.isfinite(samples))
    if bad.size:
        raise ValueError(
            f"{name}: sample {bad[0]}, counted from 0, is {samples[bad[0]]}: expected finite values"
        )


def travel(
    command: npt.NDArray[np.float64], dt_s: float, gain_m_s_v: float, start_m: float
) -> tuple[float, float]:
    """Returns lowest and highest position in metres, start and end of the last interval included.

    Parameters
    ----------
    command
        command in volts, shape (n,), n >= 1, finite.
    dt_s
        sampling time in seconds, > 0.
    gain_m_s_v
        velocity per volt in m/(s V), finite, of either sign.
    start_m
        position at the first sample in metres, finite.
    """
    if not 0.0 < dt_s < np.inf:
        raise ValueError(f"travel: dt_s = {dt_s:g}: expected a finite dt_s > 0")
    for name, value in (("gain_m_s_v", gain_m_s_v), ("start_m", start_m)):
        if not math.isfinite(value):
            raise ValueError(f"travel: {name} = {value:g}: expected a finite number")
    check_samples("travel", command)
    # y_{k+1} = y_k + gain dt u_k. The position is linear between samples, so its extremes are at
    # the samples.
    position = start_m + gain_m_s_v * dt_s * np.cumsum(command)
    return min(start_m, float(position.min())), max(start_m, float(position.max()))


def fit_to_travel(
    command: npt.NDArray[np.float64],
    dt_s: float,
    *,
    gain_m_s_v: float,
    start_m: float,
    stroke_m: float,
) -> npt.NDArray[np.float64]:
    """Returns the command if the plant stays inside its stroke, else the command minus its mean.

    Without its mean, the command ends at the start position; its peak may grow by the size of the
    mean. The command is not scaled down, because that would be a different test.

    Parameters
    ----------
    command, dt_s, gain_m_s_v
        as in `travel`.
    start_m
        position at the first sample in metres, 0 <= start_m <= stroke_m.
    stroke_m
        stroke in metres, > 0; positions from 0 to stroke_m are inside.

    Returns
    -------
    Command in volts, shape (n,), a new array.

    Raises
    ------
    ValueError
        an argument is outside its range, or the plant leaves the stroke also without the mean; the
        message then gives a scale and a start position that fit.
    """
    if not 0.0 < stroke_m < np.inf:
        raise ValueError(f"fit_to_travel: stroke_m = {stroke_m:g}: expected a finite stroke_m > 0")
    if not 0.0 <= start_m <= stroke_m:
        raise ValueError(
            f"fit_to_travel: start_m = {start_m:g}: expected 0 <= start_m <= {stroke_m:g}"
        )
    low, high = travel(command, dt_s, gain_m_s_v, start_m)
    if low >= 0.0 and high <= stroke_m:
        return np.array(command, dtype=np.float64)
    centred = np.asarray(command - np.mean(command), dtype=np.float64)
    low, high = travel(centred, dt_s, gain_m_s_v, start_m)
    if low >= 0.0 and high <= stroke_m:
        return centred
    down, up = start_m - low, high - start_m
    room = stroke_m - start_m
    # From the best start position the command can use the whole stroke. The factor 0.999 allows for
    # the rounding of the printed figures.
    there = min(1.0, 0.999 * stroke_m / (down + up))
    remedy = f"start at {0.5 * (stroke_m + there * (down - up)):.5g} m"
    if there < 1.0:
        remedy += f" and scale it by at most {there:.5g}"
    if 0.0 < start_m < stroke_m:
        here = 0.999 * min(start_m / max(down, start_m), room / max(up, room))
        remedy = f"scale it by at most {here:.5g}, or {remedy}"
    raise ValueError(
        f"fit_to_travel: less its mean, the command still moves from {low:.4g} to {high:.4g} m, "
        f"beyond 0 to {stroke_m:g} m: {remedy}"
    )


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
