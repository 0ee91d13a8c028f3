# SPDX-License-Identifier: MIT
"""Noise floor of a measured signal: what no simulator can explain."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.data.repeats import repeat_errors
from ehsid.harness.gap.data.rest import rest_errors
from ehsid.harness.gap.thresholds import (
    LEAST_FLOOR,
    MOTION_SEEN,
    REST_WINDOWS,
)
from ehsid.harness.records import Record

# Order of the differences. A motion of w rad/s is left with (2 sin(w dt / 2))^7 / sqrt(C(14, 7)) of
# its amplitude: 6e-5 for an oil spring of 70 Hz at 1 kHz, where third differences leave 2 %.
ORDER = 7
BLOCKS = 20
LEAST_SAMPLES = 100
# Levels of a quantised signal that moves are fewer steps apart than this, mostly.
NEAR_LEVELS = 50
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
    frequency is not seen: the floor is then too low. Samples so far apart that the motion itself is
    fast make it too high: see `sees_motion`.

    Parameters
    ----------
    signal
        shape (N,), N >= 100, sampled evenly.

    Raises
    ------
    ValueError
        fewer samples.
    """
    samples = np.asarray(signal, dtype=np.float64)
    by_block = np.maximum(_by_block(samples, ORDER), sensor_step(samples) / math.sqrt(12.0))
    low, value, high = np.quantile(by_block, [0.05, 0.5, 0.95])
    return NoiseFloor(float(value), float(low), float(high))


def sees_motion(signal: npt.ArrayLike) -> bool:
    """Are the differences of `noise_floor` of motion rather than noise? Then it is a bound above.

    White noise is the same in differences of any order; motion of w is amplified from order k to
    k + 2 by (2 sin(w dt / 2))^2 sqrt(C(2k, k) / C(2k + 4, k + 2)), which is 1 for a single w only.
    """
    samples = np.asarray(signal, dtype=np.float64)
    seventh, ninth = (float(np.median(_by_block(samples, k))) for k in (ORDER, ORDER + 2))
    if min(seventh, ninth) <= max(sensor_step(samples), LEAST_FLOOR * float(np.std(samples))):
        # Steps of the sensor, or nothing that matters.
        return False
    return abs(math.log(ninth / seventh)) > MOTION_SEEN


def floor_of(record: Record, name: str) -> NoiseFloor:
    """The noise floor of a column, by the best way the record offers.

    Repeats of the command, where there are any, show noise of all frequencies and all that does not
    come again, in motion. Else windows at rest show noise of low frequency, too; the floor is then
    the larger of that and of the seventh differences, unless these see the motion. Without repeats
    and rest it is the differences alone.

    Parameters
    ----------
    record
        without gaps, with `command_v` and `position_m`, of at least 100 samples.
    name
        of the column.

    Raises
    ------
    ValueError
        fewer samples, or gaps.
    """
    if record.dt_s is None or len(record.segments) > 1:
        raise ValueError(f"{record.name}: a noise floor needs one stretch with a sampling time")
    samples = record.column(name)
    white = noise_floor(samples)
    # Below this nothing is resolved; a record without any noise is not measured.
    least = max(sensor_step(samples) / math.sqrt(12.0), LEAST_FLOOR * float(np.std(samples)))
    if sees_motion(samples):
        white = NoiseFloor(white.value, min(least, white.low), white.high)
        blurred = True
    else:
        blurred = False
    repeated = _of_windows(repeat_errors(record, name))
    rest = _of_windows(rest_errors(record, name))
    if repeated is not None:
        found = repeated if blurred else _hull(repeated.value, repeated, white)
    elif rest is not None:
        found = rest if blurred else _hull(max(rest.value, white.value), rest, white)
    else:
        found = white
    return NoiseFloor(*(max(end, least) for end in (found.value, found.low, found.high)))


def _hull(value: float, one: NoiseFloor, other: NoiseFloor) -> NoiseFloor:
    return NoiseFloor(value, min(one.low, other.low, value), max(one.high, other.high, value))


def _of_windows(errors: Sequence[FloatArray]) -> NoiseFloor | None:
    """Rms over windows; what is beyond the 95 % quantile of them counts as that much: spikes."""
    if len(errors) < REST_WINDOWS:
        return None
    squares = np.array([float(np.mean(window**2)) for window in errors])
    low, high = np.quantile(squares, [0.05, 0.95])
    value = float(np.mean(np.minimum(squares, high)))
    return NoiseFloor(math.sqrt(value), math.sqrt(min(low, value)), math.sqrt(high))


def _by_block(samples: FloatArray, order: int) -> FloatArray:
    """Deviation of white noise with these differences, for each block of the record."""
    if samples.ndim != 1 or samples.size < LEAST_SAMPLES:
        raise ValueError(f"a noise floor needs {LEAST_SAMPLES} samples, there are {samples.size}")
    differences = np.diff(samples, order) / math.sqrt(math.comb(2 * order, order))
    blocks = np.array_split(np.abs(differences), min(BLOCKS, samples.size // 20))
    return np.array([float(np.median(block)) for block in blocks]) / NORMAL_MEDIAN


def sensor_step(samples: FloatArray) -> float:
    """Least step of a quantised signal, shape (N,); zero where values are not on a grid."""
    levels = np.unique(samples)
    if levels.size < 2:
        return 0.0
    steps = np.diff(levels)
    # Rounding in a text file splits equal levels by some 1e-12 of them.
    resolution = 1e-9 * float(np.abs(levels).max())
    real = steps[steps > resolution]
    if real.size == 0:
        return 0.0
    # Neighbouring levels are a few steps apart, all of them whole ones; without a grid the nearest
    # two of many are far nearer than the others.
    places = real / float(real.min())
    near = places[places < NEAR_LEVELS]
    on_grid = np.abs(near - np.round(near)) < 0.1
    quantised = near.size > 0.5 * places.size and bool(on_grid.all())
    return float(real.min()) if quantised else 0.0
