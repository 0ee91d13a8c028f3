# SPDX-License-Identifier: MIT
"""Checks of the data that must be made before a gap is attributed to the machine."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from ...catalogue.channels import CHANNELS, COMMAND, POSITION
from ...records import Record
from ...rigs import Rig
from ..schema import WINDOW_S, Remark
from .gate_channels import check_constant, check_saturated, check_spikes
from .gate_clock import check_clock, check_length, check_sampling
from .gate_ranges import check_command, check_position, check_pressures, check_supply
from .gate_signs import check_directions, check_ports
from .gate_supply import powered_part
from .sensor_floor import sensor_floor

# The noise of one sensor differs by a tenth between records. A factor of three means that something
# was changed.
FLOORS_DIFFER = 3.0

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
            yield Remark(
                "",
                f"the noise of {name} is {high:.2g} in '{noisy}' and {low:.2g} in '{quiet}'; check "
                "whether sensor, filter or setting were changed in between",
            )


def _sampling_differs(records: Sequence[Record]) -> Iterator[Remark]:
    steps = [record.dt_s for record in records if record.dt_s is not None]
    if len(steps) > 1 and max(steps) >= 1.01 * min(steps):
        yield Remark(
            "",
            f"the records are sampled every {1e3 * min(steps):.4g} to {1e3 * max(steps):.4g} ms; "
            f"the windows of {WINDOW_S:g} s are the same, but the slow ones say less",
        )
