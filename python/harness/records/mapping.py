# SPDX-License-Identifier: MIT
"""What a user says of the columns of a file: which are wanted, and what each of them is.

It is said by the option --map and by lines of [columns] in a rig file.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from ..catalogue.channels import CHANNELS, TIME
from .errors import nearest_name
from .layout import ColumnMap, Layout, is_convertible, layout_of, names_in_file, usual_units
from .record import Record, toml_string

# Begins the reason of a column that [columns] of a rig names; one that --map names is only "named".
NAMED_BY_RIG = "named in [columns]"
FORM = "CHANNEL=COLUMN or CHANNEL=COLUMN [UNIT], such as 'position_m=Stroke [mm]'"


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

    def is_met_by(self, file_names: Sequence[str], path: Path) -> bool:
        """Whether a file has all required columns, and the mapped ones, under the names asked for.

        Raises
        ------
        RecordError
            two columns of the file would get the same name.
        """
        layout = layout_of(file_names, self.layout)
        names = names_in_file(file_names, layout, path)
        requested = self.requested(names)
        needed = (*self.required, *(name for name in layout if name in requested))
        if any(self._log_has_unit(names, layout, name) for name in layout):
            return False
        return all(
            names.get(name) == (layout[name].name if name in layout else name) for name in needed
        )

    def _log_has_unit(self, names: Mapping[str, str], layout: Layout, channel: str) -> bool:
        """Whether a column without a unit in the layout has one in its name, not the schema's."""
        from .logs.names import unit_in_name, unknown_unit

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
    from .logs.units import pint_unit

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
    value = f"{channel}={column}" if unit in (None, "1") else f"{channel}={column} [{unit}]"
    return f"--map {shlex.quote(value)}"


def columns_line(channel: str, column: str, unit: str | None) -> str:
    """Returns the line of [columns] in a rig file for a column; without a unit for None."""
    pairs = f"name = {toml_string(column)}"
    pairs += "" if unit is None else f", unit = {toml_string(unit)}"
    return f"{channel} = {{ {pairs} }}"


def how_to_name(channel: str, column: str, unit: str | None, *, by_rig: bool) -> str:
    """Returns the line of [columns] for a column that the rig names, else the option --map."""
    if by_rig:
        return f"in [columns] of the rig, {columns_line(channel, column, unit)}"
    return _map_option_of(channel, column, unit)


def units_differ(
    channel: str, column: str, stated: str | None, unit: str | None, *, by_rig: bool
) -> tuple[str, ...]:
    """Returns a remark where the log says another unit than the rig or the user says; else none.

    `stated` is the unit that the log has outside of the name of the column.
    """
    from .logs.names import unit_in_name
    from .logs.units import conversion, pint_unit

    said = pint_unit(stated, channel) if stated and stated.strip() else None
    said = said or unit_in_name(column, channel)
    if unit is None or said is None or conversion(said, channel) == conversion(unit, channel):
        return ()
    where, say = ("[columns]", columns_line) if by_rig else ("--map", _map_option_of)
    line = say(channel, column, said)
    return (
        f"'{column}' is in {said} as the log says, and in {unit} as {where} says: {unit} is taken. "
        f"If the log is right: {line}",
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
