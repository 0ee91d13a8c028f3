# SPDX-License-Identifier: MIT
"""Checks of the data that must be made before a gap is attributed to the machine.

Gate for channels: constant ones, frozen stretches, saturated sensors, spikes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np
import numpy.typing as npt
from scipy.ndimage import correlate1d, maximum_filter1d, median_filter

from ...base.numbers import FloatArray
from ...catalogue.channels import CHANNELS, COMMAND, POSITION, shown_channel
from ...records import Record
from ...rigs import Rig
from ..schema import WINDOW_S, Remark
from .floor import FLOORS_DIFFER, sensor_floor
from .gate_ranges import (
    check_clock,
    check_command,
    check_length,
    check_position,
    check_pressures,
    check_sampling,
    check_supply,
)
from .gate_signs import check_directions, check_ports, powered_part

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


# The remarks are read in this order: a constant channel, for example, does not show any signs.
_CHECKS: tuple[Callable[[Record, Rig], Iterable[Remark]], ...] = (
    check_sampling,
    check_constant,
    check_command,
    check_position,
    check_pressures,
    check_supply,
    check_saturated,
    check_spikes,
    check_directions,
    check_ports,
)


def gate(records: Sequence[Record], rig: Rig) -> tuple[Remark, ...]:
    """Checks the records for faults; it changes nothing and raises nothing.

    Parameters
    ----------
    records
        records as read, with or without gaps.
    rig
        configuration of the simulator with which they are compared.

    Returns
    -------
    Remarks in the order of the records, the serious ones of each record first, then those on the
    differences between records. The diagnosis cannot rest on a record with a serious remark.
    """
    all_remarks: list[Remark] = []
    usable = []
    for record in records:
        remarks = _of_record(record, rig)
        all_remarks += sorted(remarks, key=lambda remark: not remark.serious)
        if not any(remark.serious for remark in remarks):
            usable.append(usable_part(record, rig)[0])
    return (*all_remarks, *_noise_differs(usable, rig), *_sampling_differs(usable))


def usable_part(record: Record, rig: Rig) -> tuple[Record, list[Remark]]:
    """Returns the part of a record that is compared, and a remark on what the supply excludes.

    The part is the longest one without a gap, and of this the longest one with the supply up.
    """
    part = longest_stretch(record)
    powered, remarks = powered_part(part, rig)
    return (part if powered == slice(0, len(part)) else stretch(part, powered)), remarks


def longest_stretch(record: Record) -> Record:
    """Returns the longest part of a record without a gap, or the record itself if it has none."""
    if len(record.segments) == 1:
        return record
    return stretch(record, max(record.segments, key=lambda part: part.stop - part.start))


def stretch(record: Record, part: slice) -> Record:
    """Returns a part of a record without a gap as a record."""
    assert record.time_s is not None
    return Record(
        name=record.name,
        columns={name: column[part] for name, column in record.columns.items()},
        time_s=record.time_s[part],
        dt_s=record.dt_s,
        segments=(slice(0, part.stop - part.start),),
        jitter=record.jitter,
        gaps=(),
        source=record.source,
        sha256=record.sha256,
        origin=record.origin,
    )


def _of_record(record: Record, rig: Rig) -> list[Remark]:
    missing = [name for name in (COMMAND, POSITION) if name not in record.columns]
    if missing:
        return [
            Remark(
                record.name,
                f"there is no column '{missing[0]}' ({CHANNELS[missing[0]].meaning}); name the "
                "column that holds it under [columns] in the rig file",
                serious=True,
            )
        ]
    remarks = [*how_read(record), *check_clock(record)]
    if record.dt_s is None:
        return remarks
    part, supply_remarks = usable_part(record, rig)
    remarks += supply_remarks
    if any(remark.serious for remark in supply_remarks):
        return remarks
    length_remarks = [*check_length(part, record)]
    if length_remarks:
        return remarks + length_remarks
    for check in _CHECKS:
        remarks += check(part, rig)
    return remarks


def how_read(record: Record) -> list[Remark]:
    """Says what was taken for what in a log that does not follow the schema of records."""
    origin = record.origin
    if origin is None:
        return []
    columns = "; ".join(
        f"{one.channel} from '{one.column}'" + (f" in {one.unit}" if one.unit else "")
        for one in origin.taken
        if one.column
    )
    remarks = [f"read as {origin.kind}" + (f": {columns}" if columns else ""), *origin.remarks]
    return [Remark(record.name, text) for text in remarks]


def _noise_differs(records: Sequence[Record], rig: Rig) -> Iterator[Remark]:
    """Checks that the noise of each sensor is the same in all records of the machine."""
    for name in CHANNELS:
        with_column = [record for record in records if name in record.columns and name != COMMAND]
        floors = [
            (sensor_floor(record, name, rig).value, record.name)
            for record in with_column
            if np.ptp(record.column(name)) > 0.0
        ]
        if len(floors) < 2:
            continue
        (low, quiet), (high, noisy) = min(floors), max(floors)
        if high > FLOORS_DIFFER * low:
            words, factor, unit = shown_channel(name)
            yield Remark(
                "",
                f"the noise of {words} is {factor * high:.2g} {unit} in '{noisy}' and "
                f"{factor * low:.2g} {unit} in '{quiet}'; check whether sensor, filter or setting "
                "were changed in between",
            )


def _sampling_differs(records: Sequence[Record]) -> Iterator[Remark]:
    steps = [record.dt_s for record in records if record.dt_s is not None]
    if len(steps) > 1 and max(steps) >= 1.01 * min(steps):
        yield Remark(
            "",
            f"the records are sampled every {1e3 * min(steps):.4g} to {1e3 * max(steps):.4g} ms; "
            f"the windows of {WINDOW_S:g} s are the same, but the slow ones say less",
        )
