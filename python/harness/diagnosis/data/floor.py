# SPDX-License-Identifier: MIT
"""Noise floor of a measured signal: the part that no simulator can explain.

Rounding errors of a sensor with a coarse grid, as the record itself shows them.

Noise floor of a channel, also where the sampling is too slow to tell noise from motion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ...base.numbers import FloatArray
from ...catalogue.channels import CHAMBER_PRESSURES, CHANNELS
from ...records import Record
from ...rigs import Rig
from .repeats import oil_spring_hz, repeat_errors, rest_errors

# Smallest number of windows of half a second that give a noise floor. With 20 independent errors
# per second, four windows give it two significant digits.
REST_WINDOWS = 4
# For white noise, the medians over twenty blocks of the differences of orders 7 and 9 agree within
# some 5 %. A disagreement of four times that is not white noise.
MOTION_SEEN = 0.2
# The same, times sqrt(N) for N samples: three standard errors of white noise, which are 1.15 /
# sqrt(N) each (by simulation, N from 400 to 20,000).
MOTION_LIKELY = 3.5
# No sensor resolves a millionth of the variation that it shows. What is smaller comes from the
# digits of the file.
LEAST_FLOOR = 1e-6

# Order of the differences. They leave (2 sin(w dt / 2))^7 / sqrt(C(14, 7)) of the amplitude of a
# motion of w rad/s: 6e-5 for an oil spring of 70 Hz at 1 kHz, where third differences leave 2 %.
ORDER = 7
BLOCKS = 20
LEAST_SAMPLES = 100
# Most neighbouring levels of a quantised signal in motion are fewer steps apart than this.
NEAR_LEVELS = 50
# Median of |x| of a standard normal variable.
NORMAL_MEDIAN = 0.6744897501960817


@dataclass(frozen=True)
class NoiseFloor:
    """Standard deviation of the noise, in the unit of the signal, and its interval of 90 %.

    The interval is the spread over the blocks or windows of the record.
    """

    value: float
    low: float
    high: float
    seen: bool = True
    """Whether the record shows the noise; where motion hides it, the value may be far too high."""


def noise_floor(signal: npt.ArrayLike) -> NoiseFloor:
    """Estimates the noise floor from seventh differences, which are too fast for a servo.

    The estimate is the median over blocks of the signal. White noise of standard deviation s has
    k-th differences of deviation s sqrt(C(2k, k)). If the sensor shows whole steps q and most
    samples do not change, the floor is q / sqrt(12). The differences do not show noise of low
    frequency; the floor is then too low. With a sampling time so long that the motion itself is
    fast, it is too high: see `shows_motion`.

    Parameters
    ----------
    signal
        shape (N,), N >= 100, sampled evenly.

    Raises
    ------
    ValueError
        there are fewer samples.
    """
    samples = np.asarray(signal, dtype=np.float64)
    by_block = np.maximum(_by_block(samples, ORDER), sensor_step(samples) / math.sqrt(12.0))
    low, value, high = np.quantile(by_block, [0.05, 0.5, 0.95])
    return NoiseFloor(float(value), float(low), float(high))


def shows_motion(signal: npt.ArrayLike, limit: float = MOTION_SEEN) -> bool:
    """Whether the differences in `noise_floor` show motion; the floor is then an upper bound.

    White noise gives the same estimate from differences of any order. From order k to k + 2, the
    estimate from a motion of w rad/s changes by the factor
    (2 sin(w dt / 2))^2 sqrt(C(2k, k) / C(2k + 4, k + 2)), which is 1 for a single w only. Motion is
    a change by more than `limit`, in natural logarithms.
    """
    samples = np.asarray(signal, dtype=np.float64)
    seventh, ninth = (float(np.median(_by_block(samples, k))) for k in (ORDER, ORDER + 2))
    if min(seventh, ninth) <= max(sensor_step(samples), LEAST_FLOOR * float(np.std(samples))):
        # The differences are steps of the sensor, or too small to matter.
        return False
    return abs(math.log(ninth / seventh)) > limit


def floor_of(record: Record, name: str, fast: bool = True) -> NoiseFloor:
    """Estimates the noise floor of a column by the best method that the record allows.

    Repeats of the command, if there are any, show noise of all frequencies in motion, and
    everything else that is not repeatable. Otherwise windows at rest also show noise of low
    frequency; the floor is the larger of their estimate and that of the seventh differences, unless
    the differences show motion. Without repeats and rest, the differences alone give the floor; if
    they show motion, they are an upper bound.

    Parameters
    ----------
    record
        without gaps, with `command_v` and `position_m`, of at least 100 samples.
    name
        name of the column.
    fast
        False where the sampling is known to be so slow that the differences show the motion.

    Raises
    ------
    ValueError
        the record has fewer samples, or gaps.
    """
    if record.dt_s is None or len(record.segments) > 1:
        raise ValueError(f"{record.name}: a noise floor needs one stretch with a sampling time")
    samples = record.column(name)
    white = noise_floor(samples)
    # The floor is at least the resolution, because a measured signal always has some noise.
    least = max(sensor_step(samples) / math.sqrt(12.0), LEAST_FLOOR * float(np.std(samples)))
    is_upper_bound = not fast
    if shows_motion(samples):
        white = NoiseFloor(white.value, min(least, white.low), white.high)
        is_upper_bound = True
    repeated = _of_windows(repeat_errors(record, name))
    rest = _of_windows(rest_errors(record, name))
    if repeated is not None:
        floor = repeated if is_upper_bound else _hull(repeated.value, repeated, white)
    elif rest is not None:
        floor = rest if is_upper_bound else _hull(max(rest.value, white.value), rest, white)
    else:
        floor = replace(white, seen=not is_upper_bound)
    value, low, high = (max(end, least) for end in (floor.value, floor.low, floor.high))
    return NoiseFloor(value, low, high, floor.seen)


def _hull(value: float, first: NoiseFloor, second: NoiseFloor) -> NoiseFloor:
    return NoiseFloor(value, min(first.low, second.low, value), max(first.high, second.high, value))


def _of_windows(errors: Sequence[FloatArray]) -> NoiseFloor | None:
    """Rms over windows; mean squares above their 95 % quantile (spikes) count as the quantile."""
    if len(errors) < REST_WINDOWS:
        return None
    squares = np.array([float(np.mean(window**2)) for window in errors])
    low, high = np.quantile(squares, [0.05, 0.95])
    value = float(np.mean(np.minimum(squares, high)))
    return NoiseFloor(math.sqrt(value), math.sqrt(min(low, value)), math.sqrt(high))


def _by_block(samples: FloatArray, order: int) -> FloatArray:
    """Standard deviation of white noise with these differences, for each block of the signal."""
    if samples.ndim != 1 or samples.size < LEAST_SAMPLES:
        raise ValueError(f"a noise floor needs {LEAST_SAMPLES} samples, there are {samples.size}")
    differences = np.diff(samples, order) / math.sqrt(math.comb(2 * order, order))
    blocks = np.array_split(np.abs(differences), min(BLOCKS, samples.size // 20))
    return np.array([float(np.median(block)) for block in blocks]) / NORMAL_MEDIAN


def sensor_step(samples: FloatArray) -> float:
    """Smallest step of a quantised signal of shape (N,), in its unit; zero without a grid."""
    levels = np.unique(samples)
    if levels.size < 2:
        return 0.0
    steps = np.diff(levels)
    # Rounding in a text file makes equal levels differ by some 1e-12 of their value.
    resolution = 1e-9 * float(np.abs(levels).max())
    real = steps[steps > resolution]
    if real.size == 0:
        return 0.0
    # On a grid, neighbouring levels are a few whole steps apart. Without a grid, the nearest two of
    # many levels are much closer to each other than the others are.
    level_distances = real / float(real.min())
    short_distances = level_distances[level_distances < NEAR_LEVELS]
    on_grid = np.abs(short_distances - np.round(short_distances)) < 0.1
    quantised = short_distances.size > 0.5 * level_distances.size and bool(on_grid.all())
    return float(real.min()) if quantised else 0.0


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


# With fewer than four samples in a period of the oil spring, neighbouring samples differ by motion
# as much as by noise, and differences of any order show both.
SPRING_HIDES_NOISE = 0.25
# Noise of usual sensors, where motion hides it and the rig file does not tell it: of a position
# sensor, share of the stroke; of others, share of the range in the record. For pressures see
# DESIGN_PRESSURE_NOISE.
NOISE_OF_STROKE = 5e-5
NOISE_OF_RANGE = 1e-3
# Assumed noise of a pressure sensor that is not installed yet, share of the supply pressure. A
# thousandth of its range is usual.
DESIGN_PRESSURE_NOISE = 1e-3
# Standard deviation of the time by which a logger takes a sample late, share of the sampling time:
# evenly distributed up to 2 %, as in the generated records with the least even sampling.
LATE = 0.02 / math.sqrt(12.0)


def sensor_floor(record: Record, name: str, rig: Rig) -> NoiseFloor:
    """Noise floor as `floor_of` estimates it, or of a usual sensor where motion hides the noise.

    A load on its oil spring still moves at frequencies near the sampling rate of a slow record, so
    that differences of neighbouring samples show this motion. They are then an upper bound that is
    far too high: it would hide every effect. The floor is then what repeats or rests alone show,
    and what samples do that are late by a random time, LATE of the sampling time, which rests do
    not show. Without repeats and rests it is what the rig file tells of the sensor, or else the
    noise of a usual sensor. It is never more than the bound.

    Parameters
    ----------
    record
        without gaps, of at least 100 samples.
    name
        name of the column.
    rig
        configuration of the simulator, with the noise of the sensors, if known.
    """
    spring_hz = oil_spring_hz(rig)
    assert record.dt_s is not None
    if spring_hz is None or spring_hz * record.dt_s < SPRING_HIDES_NOISE:
        return floor_of(record, name)
    floor = floor_of(record, name, fast=False)
    if floor.seen:
        samples = record.column(name)
        late = LATE * math.sqrt(float(np.mean(np.diff(samples) ** 2)))
        bound = max(floor.value, noise_floor(samples).value)
        value = min(math.hypot(floor.value, late), bound)
    else:
        value = min(_expected(record, name, rig), floor.value)
    return NoiseFloor(value, min(value, floor.low), max(value, floor.high), floor.seen)


# The noise of one sensor differs by a tenth between records. A factor of three means that something
# was changed, or that it is not noise.
FLOORS_DIFFER = 3.0


def machine_floor(records: Sequence[Record], name: str, rig: Rig) -> NoiseFloor:
    """Largest noise floor of a sensor over the records of a machine.

    What is explained in one record may be noise in another. But a floor of more than FLOORS_DIFFER
    times one that is seen in another record counts only if its record shows white noise. Else it is
    motion.

    Parameters
    ----------
    records, name, rig
        as in `sensor_floor`; at least one record.
    """
    floors = [sensor_floor(record, name, rig) for record in records]
    least = min((floor.value for floor in floors if floor.seen), default=math.inf)
    noise = [
        floor
        for record, floor in zip(records, floors, strict=True)
        if floor.value <= FLOORS_DIFFER * least
        or (
            floor.seen
            and not shows_motion(record.column(name), MOTION_LIKELY / math.sqrt(len(record)))
        )
    ]
    return max(noise, key=lambda floor: floor.value)


def _expected(record: Record, name: str, rig: Rig) -> float:
    """Noise that the rig file tells, or that of a usual sensor, in the unit of the channel."""
    key = CHANNELS[name].noise
    if key is not None and rig.sensors.get(key, 0.0) > 0.0:
        return rig.sensors[key]
    if name == "position_m" and "cylinder.stroke_m" in rig.values:
        return NOISE_OF_STROKE * rig.values["cylinder.stroke_m"]
    if name in (*CHAMBER_PRESSURES, "supply_pressure_pa") and "supply.pressure_pa" in rig.values:
        return DESIGN_PRESSURE_NOISE * rig.values["supply.pressure_pa"]
    return NOISE_OF_RANGE * float(np.ptp(record.column(name)))
