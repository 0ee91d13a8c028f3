# SPDX-License-Identifier: MIT
"""Gate for channels: constant ones, frozen stretches, saturated sensors, spikes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
from scipy.ndimage import correlate1d, maximum_filter1d, median_filter

from ...base.arrays import FloatArray
from ...catalogue.channels import CHANNELS, COMMAND, POSITION
from ...records import Record
from ...rigs import Rig
from ..schema import Remark
from .sensor_floor import sensor_floor

# Motion is compared in windows. If the rms of the position is below this many times its noise,
# there is no motion to compare.
MOVES = 10.0
# A sensor froze if it shows one value for longer than any window of a filter and then jumps by ten
# times the usual step.
FROZEN_S = 0.05
FROZEN_STEP = 10.0
# A sensor is saturated if it shows five equal extremes in a row, reached in motion, three times.
CLIPPED_SAMPLES = 5
CLIPPED_RUNS = 3
# A spike is farther from the cubic through its neighbours than six times the distance within which
# 95 % of the samples are (for white noise this is 16 deviations). A swing of the oil would have
# others of a third of its size nearby; a spike has none. Below a thousandth of the standard
# deviation of the channel, a spike changes no result.
SPIKE_SIZE = 6.0
SPIKE_MATTERS = 1e-3
SPIKE_ALONE = 0.3

NEEDED = (COMMAND, POSITION)


def _runs(column: FloatArray) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Indices of the first and the last sample of each run of equal values."""
    changes = np.flatnonzero(np.diff(column) != 0.0)
    return np.append(0, changes + 1), np.append(changes, column.size - 1)


def check_constant(record: Record, rig: Rig) -> Iterator[Remark]:
    """Finds constant channels, motion that is below the noise, and stretches of a frozen sensor."""
    for name in (channel for channel in CHANNELS if channel in record.columns):
        column = record.column(name)
        if np.ptp(column) == 0.0:
            meaning = {
                "command_v": "nothing is asked of the machine, so nothing can be learned; record "
                "with an excitation",
                "position_m": "the rod does not move; check the sensor, or record with motion",
            }.get(name, "the channel is dead, or was not connected; it is left out")
            yield Remark(record.name, f"{name} is constant: {meaning}", serious=name in NEEDED)
        elif CHANNELS[name].moves:
            yield from _frozen(record, name)
    position = record.column("position_m")
    if np.ptp(position) > 0.0:
        floor = sensor_floor(record, "position_m", rig).value
        if np.std(position) < MOVES * floor:
            yield Remark(
                record.name,
                f"the rod moves by {np.std(position):.2g} m rms, its noise is {floor:.2g} m: "
                "there is no motion to compare; record with a larger excitation",
                serious=True,
            )


def _frozen(record: Record, name: str) -> Iterator[Remark]:
    """Finds stretches where a sensor shows one value for a long time and then jumps."""
    assert record.dt_s is not None
    column = record.column(name)
    starts, ends = _runs(column)
    long = (ends - starts + 1) >= max(10, round(FROZEN_S / record.dt_s))
    steps = np.abs(np.diff(column))
    typical_step = float(np.quantile(steps[steps > 0.0], 0.99)) if steps.any() else 0.0
    step_after = np.append(steps[ends[:-1]], 0.0)
    frozen = long & (step_after > FROZEN_STEP * typical_step)
    if not frozen.any():
        return
    seconds = float(np.sum((ends - starts + 1)[frozen])) * record.dt_s
    first = float(starts[frozen][0]) * record.dt_s
    yield Remark(
        record.name,
        f"{name} froze {np.count_nonzero(frozen)} times, for {seconds:.2g} s together, first "
        f"after {first:.3g} s: it stands still and then jumps; check cable and logger",
        serious=False,
    )


def check_saturated(record: Record, rig: Rig) -> Iterator[Remark]:
    """Finds sensors at the end of their range, which stay at their largest or smallest value."""
    for name in (channel for channel in CHANNELS if channel in record.columns):
        if not CHANNELS[name].moves:
            continue
        column = record.column(name)
        if np.ptp(column) == 0.0:
            continue
        starts, ends = _runs(column)
        long = ends - starts + 1 >= CLIPPED_SAMPLES
        steps = np.abs(np.diff(column))
        typical_step = float(np.quantile(steps, 0.95))
        for which, extreme in (("largest", column.max()), ("least", column.min())):
            at = long & (column[starts] == extreme) & (starts >= 2)
            # The signal must have reached the extreme in motion: the last step that the saturation
            # did not cut is not small.
            last_step = steps[np.maximum(starts[at] - 2, 0)]
            moving = last_step > 0.1 * typical_step
            if typical_step > 0.0 and np.count_nonzero(moving) >= CLIPPED_RUNS:
                share = float(np.mean(column == extreme))
                yield Remark(
                    record.name,
                    f"{name} stays at its {which} value of {extreme:.4g} for "
                    f"{100.0 * share:.2g} % of the time, {np.count_nonzero(moving)} times: the "
                    "sensor is at the end of its range; what is beyond is not compared fairly",
                )


def check_spikes(record: Record, rig: Rig) -> Iterator[Remark]:
    """Finds single samples that differ from both neighbours by more than any motion causes.

    The distances to the median of five samples (F. Hampel, J. Amer. Statist. Assoc. 69(346), 1974)
    and to the cubic through the neighbours are compared with the usual distance in the channel and
    with those nearby.
    """
    for name in (channel for channel in CHANNELS if channel in record.columns):
        if not CHANNELS[name].moves:
            continue
        count = int(np.count_nonzero(spikes(record.column(name))))
        if count:
            yield Remark(
                record.name,
                f"{name} has {count} spikes ({100.0 * count / len(record):.2g} % of the "
                "samples): they count as gap that nothing explains; check cable and ground, or "
                "take them out",
            )


def spikes(column: FloatArray) -> npt.NDArray[np.bool_]:
    """Marks the samples that are spikes, shape (N,)."""
    # Distance from the cubic through the four neighbours: it is small at reversals of a motion.
    weights = np.array([1.0, -4.0, 6.0, -4.0, 1.0]) / 6.0
    cubic = np.abs(correlate1d(column, weights, mode="nearest"))
    typical = float(np.quantile(cubic, 0.95))
    distance = np.abs(column - median_filter(column, size=5, mode="nearest"))
    distance = np.minimum(distance, cubic)
    # A spike differs from the sample before and the sample after, in the same direction.
    before = np.diff(column, prepend=column[0])
    after = np.diff(column, append=column[-1])
    is_isolated = np.minimum(np.abs(before), np.abs(after)) > 0.7 * distance
    # Largest distance in the eleven samples before and the eleven after, without the two nearest on
    # either side.
    largest_near = maximum_filter1d(distance, 11, mode="nearest")
    largest_around = np.maximum(np.roll(largest_near, 8), np.roll(largest_near, -8))
    # A spike also changes the medians of its neighbours, but by less than its own distance.
    is_highest = distance >= maximum_filter1d(distance, 5, mode="nearest")
    is_large = distance > max(SPIKE_SIZE * typical, SPIKE_MATTERS * float(np.std(column)))
    is_isolated &= is_highest & (before * after < 0.0) & (largest_around < SPIKE_ALONE * distance)
    return np.asarray(is_large & is_isolated)
