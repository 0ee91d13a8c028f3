# SPDX-License-Identifier: MIT
"""What a user says of the columns of a file: which are wanted, and what each of them is.

It is said by the option --map and by lines of [columns] in a rig file, which are a `Layout`.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from ..catalogue.channels import CHANNELS, POSITION, TIME
from .errors import RecordError, misnamed_column, nearest_name
from .names import unit_in_name, unknown_unit, without_unit
from .record import Record, columns_line
from .units import conversion, is_convertible, pint_unit, usual_units

# Begins the reason of a column that [columns] of a rig names; one that --map names is only "named".
NAMED_BY_RIG = "named in [columns]"
PRESSURE_UNIT = "Pa"
FORM = "CHANNEL=COLUMN or CHANNEL=COLUMN [UNIT], such as 'position_m=Stroke [mm]'"


@dataclass(frozen=True)
class ColumnMap:
    """Name and unit that a column of the schema has in a file."""

    name: str
    """Name of the column as written in the file."""
    unit: str | None = None
    """Unit in the notation of pint, e.g. "mm", "bar", "percent", with a factor before it where the
    numbers are multiples, e.g. "0.1 mm"; None is the unit that the log states, or else, in a
    layout, that of the schema."""


Layout = Mapping[str, ColumnMap]
"""Maps a column name of the schema to name and unit in the file."""


@dataclass(frozen=True)
class Hints:
    """What the user says about a log; it goes before all that is guessed."""

    maps: Mapping[str, ColumnMap] = field(default_factory=lambda: MappingProxyType({}))
    """For a column of the schema: name and unit of the column in the log; without a unit, the unit
    is that of the log, or else guessed."""
    dt_s: float | None = None
    """Sampling time in seconds: of the rows where the log has no time, else the one to which the
    log is resampled. None: as in the log."""

    def __bool__(self) -> bool:
        """Whether anything is said."""
        return bool(self.maps) or self.dt_s is not None


NO_HINTS = Hints()


@dataclass(frozen=True)
class Request:
    """What the caller of `read_record` asks for."""

    columns: Sequence[str] | None
    required: tuple[str, ...]
    layout: Layout
    hints: Hints

    def is_met_by(self, names: Mapping[str, str], layout: Layout) -> bool:
        """Whether a file has all required columns, and the mapped ones, under the names asked for.

        `names` and `layout` are those that `names_in_file` and `layout_of` return for the file.
        """
        requested = self.requested(names)
        needed = (*self.required, *(name for name in layout if name in requested))
        if any(self._log_has_unit(names, layout, name) for name in layout):
            return False
        return all(
            names.get(name) == (layout[name].name if name in layout else name) for name in needed
        )

    def _log_has_unit(self, names: Mapping[str, str], layout: Layout, channel: str) -> bool:
        """Whether a column without a unit in the layout has one in its name, not the schema's."""
        if layout[channel].unit is not None or channel not in self.requested(names):
            return False
        name = layout[channel].name
        unit = unit_in_name(name, channel) or unknown_unit(name, channel)
        return unit is not None and unit != CHANNELS[channel].unit

    def requested(self, names: Mapping[str, str]) -> set[str]:
        """Returns the columns to read of a file with the columns `names`."""
        if self.columns is None:
            return {*names, *self.layout}
        return {*self.columns, *self.required, TIME}

    @property
    def time_name(self) -> str:
        """Name of the column of time in the file, as the layout has it."""
        return self.layout[TIME].name if TIME in self.layout else TIME

    def stated(self, names: Sequence[str]) -> tuple[dict[str, ColumnMap], frozenset[str]]:
        """Returns the columns that are named for channels, and the channels of those by the rig.

        `names` are those of the log. What the user says goes before the rig.
        """
        maps = self.hints.maps
        layout = layout_of(names, self.layout)
        by_rig = {channel: one for channel, one in layout.items() if channel not in maps}
        return {**maps, **by_rig}, frozenset(by_rig)


def parse_maps(texts: Iterable[str], option: str = "--map") -> dict[str, ColumnMap]:
    """Returns the columns of a log by channel, from texts such as "position_m=Stroke [mm]".

    Units are those that engineers write: bar, psi, kN, t, °C, and all of pint.

    Raises
    ------
    ValueError
        a text has another form, an unknown channel or a unit of another kind, or a channel comes
        twice; the message begins with `option`.
    """
    maps: dict[str, ColumnMap] = {}
    for text in texts:
        channel, equals, column = (part.strip() for part in text.partition("="))
        if not equals or not column:
            raise ValueError(f"{option} {text!r}: expected {FORM}")
        if channel not in CHANNELS:
            near = nearest_name(channel, CHANNELS)
            hint = f"; did you mean '{near}'?" if near else ""
            raise ValueError(
                f"{option} {text!r}: there is no channel '{channel}'{hint} There are: "
                f"{', '.join(CHANNELS)}"
            )
        if channel in maps:
            raise ValueError(f"{option} {text!r}: '{channel}' is named twice; give it once")
        match = re.fullmatch(r"(?P<name>.*\S)\s*\[(?P<unit>[^\[\]]*)\]", column)
        if match is None:
            maps[channel] = ColumnMap(column)
            continue
        said = match["unit"].strip()
        unit = pint_unit(said, channel)
        if unit is None and is_convertible(said, CHANNELS[channel].unit):
            unit = said
        if unit is None:
            raise ValueError(
                f"{option} {text!r}: '{match['unit']}' is not a unit of '{channel}'; expected one "
                f"that converts into {CHANNELS[channel].unit}, "
                + usual_units(match["unit"], CHANNELS[channel].unit)
            )
        maps[channel] = ColumnMap(match["name"], unit)
    return maps


def map_option(channel: str, column: str, unit: str | None) -> str:
    """Returns the option --map for a column; without a unit for None and "1"."""
    column = without_unit(column, channel) if channel in CHANNELS else column
    value = f"{channel}={column}" if unit in (None, "1") else f"{channel}={column} [{unit}]"
    return f"--map {shlex.quote(value)}"


def example_unit(channel: str) -> str | None:
    """Returns a unit in which logs often have a channel; None where it has but one."""
    if channel == POSITION:
        return "mm"
    guesses = CHANNELS[channel].guesses if channel in CHANNELS else ()
    if guesses and CHANNELS[channel].unit == PRESSURE_UNIT:
        return "bar"
    return guesses[1].unit if len(guesses) > 1 else None


def how_to_name(channel: str, column: str, unit: str | None, *, by_rig: bool) -> str:
    """Returns the line of [columns] for a column that the rig names, else the option --map."""
    if by_rig:
        return f"in [columns] of the rig, {columns_line(channel, column, unit)}"
    return map_option(channel, column, unit)


def units_differ(
    channel: str, column: str, stated: str | None, unit: str | None, *, by_rig: bool
) -> tuple[str, ...]:
    """Returns a remark where the log says another unit than the rig or the user says; else none.

    `stated` is the unit that the log has outside of the name of the column.
    """
    said = pint_unit(stated, channel) if stated and stated.strip() else None
    said = said or unit_in_name(column, channel)
    if unit is None or said is None or conversion(said, channel) == conversion(unit, channel):
        return ()
    where, say = ("[columns]", columns_line) if by_rig else ("--map", map_option)
    return (
        f"'{column}' is in {said} as the log says, and in {unit} as {where} says: {unit} is taken. "
        f"If the log is right: {say(channel, column, said)}",
    )


def reading_of(
    record: Record, layout: Mapping[str, ColumnMap], channel: str
) -> tuple[str, str | None, bool]:
    """Returns the column of the log that was read as a channel, its unit, and who named it.

    That is whether `layout`, [columns] of a rig, named it. The unit is None for that of the schema.
    """
    for taken in () if record.origin is None else record.origin.taken:
        if taken.channel == channel and taken.column:
            return taken.column, taken.unit, taken.why.startswith(NAMED_BY_RIG)
    mapped = layout.get(channel)
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
    return how_to_name(channel, column, unit, by_rig=by_rig)


def how_to_exchange(
    record: Record, layout: Mapping[str, ColumnMap], first: str, second: str
) -> str:
    """Returns the words with which the columns of two channels of one unit are exchanged."""
    read = {name: reading_of(record, layout, name) for name in (first, second)}
    by_rig = all(named for _, _, named in read.values())
    say = columns_line if by_rig else map_option
    parts = [
        say(name, read[other][0], read[other][1] or CHANNELS[other].unit)
        for name, other in ((first, second), (second, first))
    ]
    return f"in [columns] of the rig, {' and '.join(parts)}" if by_rig else " ".join(parts)


def check_layout(layout: Layout, file: Path | str) -> None:
    """Checks that every target column is in the schema and that every unit converts.

    Raises
    ------
    RecordError
        a column is not in the schema, or a unit does not convert.
    """
    for target, column in layout.items():
        if target not in CHANNELS:
            raise misnamed_column(file, target, CHANNELS, "a column of the schema")
        if column.unit is not None and not is_convertible(column.unit, CHANNELS[target].unit):
            raise RecordError(
                file,
                f"'{column.unit}' is not a unit of '{target}'",
                column=column.name,
                expected=f"a unit that converts into {CHANNELS[target].unit}, "
                + usual_units(column.unit, CHANNELS[target].unit),
                mend="correct the unit in the layout ([columns] of the rig)",
            )


def layout_of(file_names: Sequence[str], layout: Layout) -> Layout:
    """Returns the layout, or an empty one for a file that has the column names of the schema.

    The layout is empty if the file has none of the names in the layout and at least one of the
    schema names that it maps. So a rig that maps the columns of its logger can also read records
    of its simulator. Columns with schema names have the units of the schema.
    """
    mapped = {column.name for column in layout.values()}
    return (
        {} if mapped.isdisjoint(file_names) and not layout.keys().isdisjoint(file_names) else layout
    )


def names_in_file(file_names: Sequence[str], layout: Layout, file: Path | str) -> dict[str, str]:
    """Maps the column names of the record to the names in the file, in the order of the file.

    Columns that are not in the layout keep their names. Columns that are in the layout but not in
    the file are left out.

    Raises
    ------
    RecordError
        two columns of the file would get the same name.
    """
    targets: dict[str, list[str]] = {}
    for target, column in layout.items():
        targets.setdefault(column.name, []).append(target)
    names: dict[str, str] = {}
    for name in file_names:
        for target in targets.get(name, [name]):
            if target in names:
                raise RecordError(
                    file,
                    f"both '{names[target]}' and '{name}' would be read as '{target}'",
                    column=target,
                    expected="one column of the file for each column of the record",
                    mend="correct the layout ([columns] of the rig), or rename the column",
                )
            names[target] = name
    return names
