# SPDX-License-Identifier: MIT
"""What a user can paste to have a column of a log read otherwise."""

from __future__ import annotations

import shlex
from collections.abc import Mapping

from ..catalogue.channels import CHANNELS
from .layout import ColumnMap
from .origin import Taken, toml_string
from .record import Record

# Begins the reason of a column that [columns] of a rig names; one that --map names is only "named".
NAMED_BY_RIG = "named in [columns]"


def map_option(channel: str, column: str, unit: str | None) -> str:
    """Returns the option --map for a column; without a unit for None and "1"."""
    value = f"{channel}={column}" if unit in (None, "1") else f"{channel}={column} [{unit}]"
    return f"--map {shlex.quote(value)}"


def columns_line(channel: str, column: str, unit: str | None) -> str:
    """Returns the line of [columns] in a rig file for a column; without a unit for None."""
    pairs = f"name = {toml_string(column)}"
    pairs += "" if unit is None else f", unit = {toml_string(unit)}"
    return f"{channel} = {{ {pairs} }}"


def units_differ(
    channel: str, column: str, said: str | None, unit: str, where: str
) -> tuple[str, ...]:
    """Returns a remark where the log says another unit than the user says; else none.

    `where` is "[columns]" or "--map", where the user says `unit`; `said` is that of the log.
    """
    from .logs.units import conversion

    if said is None or conversion(said, channel) == conversion(unit, channel):
        return ()
    if where == "--map":
        line = _map_option_of(channel, column, said)
    else:
        line = columns_line(channel, column, said)
    return (
        f"'{column}' is in {said} as the log says, and in {unit} as {where} says: {unit} is taken. "
        f"If the log is right: {line}",
    )


def taken_for(record: Record, channel: str) -> Taken | None:
    """Returns what was taken for a channel; None if the record says nothing of it."""
    taken = () if record.origin is None else record.origin.taken
    return next((one for one in taken if one.channel == channel and one.column), None)


def reading_of(
    record: Record, layout: Mapping[str, ColumnMap], channel: str
) -> tuple[str, str | None, bool]:
    """Returns the column of the log that was read as a channel, its unit, and who named it.

    That is whether `layout`, [columns] of a rig, named it. The unit is None for that of the schema.
    """
    taken, mapped = taken_for(record, channel), layout.get(channel)
    if taken is not None:
        return taken.column, taken.unit, taken.why.startswith(NAMED_BY_RIG)
    if mapped is not None:
        return mapped.name, mapped.unit, True
    return channel, None, False


def how_to_read(
    record: Record, layout: Mapping[str, ColumnMap], channel: str, unit: str | None
) -> str:
    """Returns the words with which the column of a channel is read in another unit.

    It is a line for [columns] where `layout`, that of the rig, has one already; else --map.
    """
    column, _, by_rig = reading_of(record, layout, channel)
    if by_rig:
        return f"in [columns] of the rig, {columns_line(channel, column, unit)}"
    return _map_option_of(channel, column, unit)


def how_to_exchange(
    record: Record, layout: Mapping[str, ColumnMap], first: str, second: str
) -> str:
    """Returns the words with which the columns of two channels of one unit are exchanged."""
    parts = []
    read = {name: reading_of(record, layout, name) for name in (first, second)}
    by_rig = all(named for _, _, named in read.values())
    for name, other in ((first, second), (second, first)):
        column, unit, _ = read[other]
        say = columns_line if by_rig else _map_option_of
        parts.append(say(name, column, unit or CHANNELS[other].unit))
    return f"in [columns] of the rig, {' and '.join(parts)}" if by_rig else " ".join(parts)


def _map_option_of(channel: str, column: str, unit: str | None) -> str:
    from .logs.units import without_unit

    return map_option(channel, without_unit(column, channel), unit)
