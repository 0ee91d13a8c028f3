# SPDX-License-Identifier: MIT
"""Chirp: a sine whose frequency increases.

Random steps: random levels, each held for a random time.

Slow triangular signals.

Pseudo-random binary sequence.

L. Ljung, System Identification: Theory for the User, 2nd ed., 1999, sec. 13.3.

Test signals by their names, for those who choose one from a list.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import scipy.signal
from scipy.signal import max_len_seq, sawtooth

from ...base.numbers import FloatArray
from .excitation import odd_multisine


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


def random_steps(
    n: int,
    *,
    amplitude: float,
    hold: tuple[int, int],
    rng: np.random.Generator,
    levels: int | None = None,
) -> npt.NDArray[np.float64]:
    """Returns random levels from -amplitude to amplitude, each held for a random time, shape (n,).

    Parameters
    ----------
    n
        number of samples, at least 1.
    amplitude
        largest level in the unit of the command, finite, >= 0.
    hold
        smallest and largest number of samples for which a level is held, 1 <= fewest <= most. The
        end of the signal may cut the last level.
    rng
        generator that draws levels and times.
    levels
        number of evenly spaced levels, >= 2; the next level then always differs. By default, any
        level of the interval is possible.
    """
    fewest, most = hold
    if not (n >= 1 and 0.0 <= amplitude < np.inf and 1 <= fewest <= most):
        raise ValueError(
            f"random_steps: n = {n}, amplitude = {amplitude:g}, hold = {hold}: expected n >= 1, "
            "finite amplitude >= 0, 1 <= fewest <= most"
        )
    if levels is not None and levels < 2:
        raise ValueError(f"random_steps: levels = {levels}: expected levels >= 2")
    lengths = rng.integers(fewest, most, size=-(-n // fewest), endpoint=True)
    if levels is None:
        values = rng.uniform(-amplitude, amplitude, size=lengths.size)
    else:
        # A cyclic move by 1 to levels - 1 places never returns to the same level.
        places = rng.integers(1, levels, size=lengths.size)
        places[0] = rng.integers(0, levels)
        values = np.linspace(-amplitude, amplitude, levels)[np.cumsum(places) % levels]
    return np.repeat(values, lengths)[:n]


def triangle(n: int, dt_s: float, *, amplitude: float, period_s: float) -> npt.NDArray[np.float64]:
    """Returns a triangular signal, shape (n,), that starts at zero and rises to amplitude first.

    Parameters
    ----------
    n
        number of samples, at least 1.
    dt_s
        sampling time in seconds, > 0.
    amplitude
        amplitude in the unit of the command, finite, >= 0.
    period_s
        period in seconds, finite, at least 4 dt_s.
    """
    if not (dt_s > 0.0 and 4.0 * dt_s <= period_s < np.inf):
        raise ValueError(
            f"triangle: dt_s = {dt_s:g}, period_s = {period_s:g}: expected dt_s > 0, finite "
            f"period_s >= {4.0 * dt_s:g}"
        )
    if not (n >= 1 and 0.0 <= amplitude < np.inf):
        raise ValueError(
            f"triangle: n = {n}, amplitude = {amplitude:g}: expected n >= 1, finite amplitude >= 0"
        )
    phase = 2.0 * np.pi * np.arange(n) * dt_s / period_s
    # A sawtooth of width 0.5 starts at -1. A quarter of a period later it passes zero upwards.
    signal = amplitude * sawtooth(phase + 0.5 * np.pi, 0.5)
    # Rounding errors at a corner must not exceed the amplitude.
    return np.asarray(np.clip(signal, -amplitude, amplitude), dtype=np.float64)


def prbs(n: int, *, amplitude: float, hold: int, bits: int = 10) -> npt.NDArray[np.float64]:
    """Returns a pseudo-random binary sequence of +-amplitude, shape (n,).

    A period is a maximum-length sequence of 2^bits - 1 values, each held for `hold` samples. It is
    repeated or cut to n samples.

    Parameters
    ----------
    n
        number of samples, at least 1.
    amplitude
        amplitude in the unit of the command, finite, >= 0. The mean of a whole period is
        amplitude / (2^bits - 1).
    hold
        number of samples for which a value is held, >= 1. The spectrum is flat up to about
        0.4 / (hold dt_s).
    bits
        length of the shift register, 2 to 20.
    """
    if not (n >= 1 and 0.0 <= amplitude < np.inf and hold >= 1 and 2 <= bits <= 20):
        raise ValueError(
            f"prbs: n = {n}, amplitude = {amplitude:g}, hold = {hold}, bits = {bits}: expected "
            "n >= 1, finite amplitude >= 0, hold >= 1, bits 2 to 20"
        )
    sequence, _ = max_len_seq(bits)
    period = np.repeat(amplitude * (2.0 * sequence - 1.0), hold)
    return np.resize(period, n)


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
