# SPDX-License-Identifier: MIT
"""Reads text with headers of its own: LabVIEW measurement files (LVM), CSV of TwinCAT Scope.

LVM has segments, each with a header. The layout is that of "Specification for the LabVIEW
Measurement File (.lvm)", National Instruments. An export of TwinCAT Scope has rows of keys, then
groups of channels side by side. In the rows of keys each group begins with the key; below it are
the times of the group, in ms.
"""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import TypeVar

import numpy as np

from ...base.numbers import FloatArray
from ..errors import RecordError
from ..log import Kind, Log, Series
from .dialect import Dialect, cells_of
from .text_table import Text, TextTable

END, START_SPECIAL, END_SPECIAL = "***End_of_Header***", "***Start_Special***", "***End_Special***"
KIND_OF_LVM, FIRST_LINE = "LabVIEW measurement file (LVM)", "LabVIEW Measurement"
SEPARATORS = {"tab": "\t", "comma": ","}
# X values above are absolute: seconds since 1904, here from 1992 on.
ABSOLUTE_S = 2.8e9
T = TypeVar("T")
EXPECTED = "a LabVIEW measurement file (LVM) with complete headers"


@dataclass
class _Segment:
    """Header and rows of a segment: cells by key, names, and the numbers of its lines."""

    header: dict[str, list[str]] = field(default_factory=dict)
    names: list[str] = field(default_factory=list)
    rows: list[int] = field(default_factory=list)


def read_lvm(data: bytes, path: Path) -> Log:
    """Returns the channels of an LVM file, each with the time that its headers state.

    Raises
    ------
    RecordError
        a header or a row is damaged, the segments have other channels, or one begins before the
        end of another.
    """
    text = Text(data, path)
    if not text.content.startswith(FIRST_LINE.encode()):
        return text.log()  # LabVIEW can write the rows without headers
    text.check_size()
    lines = text.content.decode().split("\n")
    separator = _separator(lines)
    header, segments, notes = _segments(lines, separator, path)
    return _File(path, lines, separator, header, segments).log([*text.notes, *notes])


def _separator(lines: Sequence[str]) -> str:
    for line in lines[:40]:
        if match := re.match(r"Separator(.)(.*?)\1*\s*$", line):
            word = match[2].strip().casefold()
            return SEPARATORS.get(word, word if len(word) == 1 else match[1])
    return "\t"


def _segments(
    lines: Sequence[str], separator: str, path: Path
) -> tuple[dict[str, str], list[_Segment], list[str]]:
    """Returns the header of the file, its segments that have rows, and notes."""
    header: dict[str, str] = {}
    segments: list[_Segment] = []
    state, specials = "file", 0
    for row, line in enumerate(lines, start=1):
        cells = cells_of(line, separator)
        key = cells[0] if cells else ""
        if state == "special" or key == START_SPECIAL:
            specials += key == START_SPECIAL
            state = "rows" if key == END_SPECIAL else "special"
        elif state == "file":
            state = "rows" if key == END else state
            header[key] = cells[1] if len(cells) > 1 else ""
        elif not any(cells):
            continue
        elif state == "rows" and (not key or re.match(r"[-+\d.,]", key) or key.lower() == "nan"):
            if not segments or not segments[-1].names:
                raise _damaged(path, row, "there are rows without the names of the channels")
            segments[-1].rows.append(row)
        elif key == END:
            state = "names"
        elif state == "names":
            if key != "X_Value":
                raise _damaged(path, row, f"the row of names begins with '{key[:40]}'")
            segments[-1].names, state = cells, "rows"
        else:
            if state == "rows":
                segments.append(_Segment())
                state = "segment"
            segments[-1].header[key] = cells
    notes = [f"{specials} special blocks of the file are left out"] if specials else []
    return header, [one for one in segments if one.rows], notes


def _damaged(path: Path, row: int | None, problem: str) -> RecordError:
    return RecordError(
        path,
        f"in this LabVIEW measurement file (LVM) {problem}",
        row=row,
        expected=EXPECTED,
        mend="export it again, or save the signals as TDMS or as a plain table",
    )


class _File:
    """The rows of all segments as one table, and the time of each channel."""

    def __init__(
        self,
        path: Path,
        lines: Sequence[str],
        separator: str,
        header: Mapping[str, str],
        segments: Sequence[_Segment],
    ) -> None:
        if not segments:
            raise _damaged(path, None, "there are no rows")
        for number, one in enumerate(segments[1:], start=2):
            if one.names != segments[0].names:
                raise RecordError(
                    path,
                    f"segment {number} has other channels than segment 1",
                    row=one.rows[0],
                    expected="the same channels in all segments",
                    mend="save the segments in files of their own",
                )
        self._path, self._separator, self._segments = path, separator, segments
        self._columns = header.get("X_Columns", "One").casefold()
        self._rows = [row for one in segments for row in one.rows]
        self._body = "\n".join(lines[row - 1] for row in self._rows)
        if self._rows[-1] < len(lines):
            self._body += "\n"  # else the last row may be cut
        stated = header.get("Decimal_Separator", "")
        commas = separator != "," and "," in self._body.partition("\n")[0]
        self._decimal = stated if stated in (".", ",") else "," if commas else "."

    def log(self, notes: list[str]) -> Log:
        """Returns the channels with their clocks."""
        names = self._segments[0].names
        labels = tuple(f"{one} {i}" if one == "X_Value" else one for i, one in enumerate(names))
        dialect = Dialect(self._separator, self._decimal, labels, (), 0, 1, len(names), len(names))
        rows = TextTable(self._body.encode(), self._path, dialect)
        by_column = {one.column: one for one in self._placed(lambda: rows.log(notes)).series}
        last = len(names) - (names[-1].casefold() == "comment")
        channels = range(1, last, 2 if self._columns == "multi" else 1)
        notes += [
            f"'{names[i]}' is left out: it has no values" for i in channels if i not in by_column
        ]
        made = [self._channel(by_column[i], i, by_column) for i in channels if i in by_column]
        if len(self._segments) > 1:
            notes.append(f"{len(self._segments)} segments are joined, each at its date and time")
        for number, one in enumerate(self._segments, start=1):
            stated = self._cell(one, "Samples", 1)
            if self._columns == "no" and stated.isdigit() and int(stated) < len(one.rows):
                notes.append(
                    f"segment {number} has {len(one.rows)} rows, its header states {stated} "
                    "samples: the others are taken to follow without a gap"
                )
        texts = ("Comment",) if last in by_column else ()
        return Log(KIND_OF_LVM, tuple(made), self._rows[0], tuple(notes), texts=texts)

    def _placed(self, read: Callable[[], T]) -> T:
        """Returns what `read` returns; the row of its error is that of the file."""
        try:
            return read()
        except RecordError as error:
            if error.row is None:
                raise
            raise error.changed(row=self._rows[min(error.row, len(self._rows)) - 1]) from None

    def _channel(
        self, series: Series, column: int, by_column: Mapping[int | None, Series]
    ) -> Series:
        unit = self._cell(self._segments[0], "Y_Unit_Label", column) or None
        x_column = {"no": None, "multi": column - 1}.get(self._columns, 0)
        if self._columns == "one" and self._clock(column) != self._clock(1):
            x_column = None  # the one column of X is that of the first channel
        x = by_column.get(x_column)

        @cache
        def time() -> FloatArray:
            found = self._times(column, None if x is None else self._placed(x.read))
            return found[: series.size]  # a last row that is cut is left out

        return replace(
            series,
            read=lambda: self._placed(series.read),
            unit=unit,
            time=time,
            group=f"{x_column}|{[self._clock(column)]}",
        )

    def _cell(self, segment: _Segment, key: str, column: int) -> str:
        cells = segment.header.get(key, [])
        return cells[column] if column < len(cells) else ""

    def _clock(self, column: int) -> list[tuple[str, ...]]:
        keys = ("Date", "Time", "X0", "Delta_X")
        return [tuple(self._cell(one, key, column) for key in keys) for one in self._segments]

    def _times(self, column: int, x: FloatArray | None) -> FloatArray:
        """Returns the times of the rows of a channel, from the start of the first channel on."""
        origin = self._start(self._segments[0], 1)
        times: list[FloatArray] = []
        at, end = 0, -np.inf
        for number, one in enumerate(self._segments, start=1):
            count = len(one.rows)
            part = np.full(count, np.nan) if x is None else x[at : at + count]
            if not np.isfinite(part).any():
                step = self._number(one, "Delta_X", column, None)
                part = self._number(one, "X0", column, 0.0) + step * np.arange(count)
            if not np.nanmax(np.abs(part)) > ABSOLUTE_S:
                day, second = self._start(one, column)
                if (day == 0) != (origin[0] == 0):
                    raise _damaged(
                        self._path, one.rows[0], "only some of the segments have a date and time"
                    )
                part = part + (86400.0 * (day - origin[0]) + (second - origin[1]))
            if number > 1 and np.nanmin(part) <= end:
                raise RecordError(
                    self._path,
                    f"segment {number} begins {end - np.nanmin(part):.4g} s before the last sample "
                    f"of segment {number - 1}",
                    row=one.rows[0],
                    expected="segments that follow each other in time",
                    mend="save each run in a file of its own",
                )
            end = float(np.nanmax(part))
            times.append(part)
            at += count
        return np.concatenate(times)

    def _start(self, segment: _Segment, column: int) -> tuple[int, float]:
        """Returns day and seconds of the start of a channel; 0 where the header has none."""
        date, time = (self._cell(segment, key, column) for key in ("Date", "Time"))
        if not date and not time:
            return 0, 0.0
        try:
            hours, minutes, seconds = time.replace(",", ".").split(":")
            day = datetime.date(*map(int, re.split(r"[/.-]", date))).toordinal()
            return day, 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds)
        except (ValueError, TypeError):
            raise _damaged(
                self._path, None, f"'{date} {time}' is no date and time as 2020/01/31 and 9:18:17"
            ) from None

    def _number(self, segment: _Segment, key: str, column: int, usual: float | None) -> float:
        text = self._cell(segment, key, column)
        if not text and usual is not None:
            return usual
        try:
            return float(text.replace(",", "."))
        except ValueError:
            raise _damaged(
                self._path,
                segment.rows[0],
                f"the header above has no {key} of '{segment.names[column]}'",
            ) from None


LVM = Kind(read_lvm, ("lvm",), rb"(?:\xef\xbb\xbf)?LabVIEW Measurement")


# The keys with names and units, and those that tell a row of keys from a row of values.
NAME, UNIT = "Name", "Unit"
HEADER_LINES = 60
# An export begins with "Name", as many tables do; its other rows of keys are its own.
HEAD = (
    rb"(?:\xef\xbb\xbf)?Name[\t ,:;](?:[^\n]*\n){1,30}?"
    rb"(?:Starttime of export|SymbolComment|SymbolName|SampleTime\[ms\])[\t ,:;]"
)
SCALES = {"Offset": "0", "ScaleFactor": "1", "Unit ScaleFactor": "1", "Unit Offset": "0"}
MEND = "export it again in TwinCAT Scope with a full header and tabs or semicolons between columns"


def read_scope(data: bytes, path: Path) -> Log:
    """Returns the channels, each with the times of its group.

    Raises
    ------
    RecordError
        there are no names or no values, or a row has more cells than there are names.
    """
    file = Text(data, path)
    file.check_size()
    text = file.content.decode()
    delimiter = text[len(NAME)]
    keys, data_row = _keys(text, delimiter, path)
    names = keys[NAME]
    # The scope ends with a line of its own; without it the end of the file may be missing.
    body = text.rstrip()
    whole = body.endswith("\nEOF")
    body = body.removesuffix("\nEOF").rstrip("\n") + ("\n" if whole or text.endswith("\n") else "")
    sample = body.split("\n")[data_row - 1 : data_row + 400]
    width = max(len(cells_of(row, delimiter)) for row in sample)
    # Between blanks, names with blanks cannot be told apart.
    if width > len(names) + 1 or (delimiter == " " and width < len(names)):
        raise RecordError(
            path,
            f"the rows have {width} cells, the names of this export of TwinCAT Scope are "
            f"{len(names)}",
            row=data_row,
            expected="one cell for every column; a decimal comma needs another separator",
            mend=MEND,
        )
    decimal = "," if delimiter != "," and any("," in row for row in sample) else "."
    starts = _starts(keys)
    columns = tuple(f"{NAME} {i}" if i in starts else name for i, name in enumerate(names))
    width = max(width, len(names))
    dialect = Dialect(delimiter, decimal, columns, (), 0, data_row, width, len(names))
    table = TextTable(body.encode(), path, dialect).log(file.notes)
    made = _channels(table, keys, starts, file.notes)
    return Log("CSV export of TwinCAT Scope", made, data_row, tuple(file.notes))


def _keys(text: str, delimiter: str, path: Path) -> tuple[dict[str, list[str]], int]:
    """Returns the cells of the rows of keys by key, and the first row of values."""
    keys: dict[str, list[str]] = {}
    for row, line in enumerate(text.split("\n", HEADER_LINES)[:HEADER_LINES], start=1):
        cells = cells_of(line, delimiter)
        if not any(cells):
            continue
        if NAME in keys and cells[0].replace(",", ".").replace(".", "").lstrip("-").isdigit():
            return keys, row
        keys[cells[0]] = cells if cells[-1] else cells[:-1]
    raise RecordError(
        path,
        "this export of TwinCAT Scope has no rows of values below its header",
        expected="rows that begin with the time in ms",
        mend=MEND,
    )


def _starts(keys: dict[str, list[str]]) -> list[int]:
    """Returns the columns of time: all rows of keys repeat their key there."""
    names = keys[NAME]
    found = {i for i, cell in enumerate(names) if cell == NAME}
    for key, cells in keys.items():
        same = {i for i, cell in enumerate(cells) if cell == key}
        if len(cells) == len(names) and key != NAME:
            found &= same
    return sorted(found)


def _channels(
    table: Log, keys: dict[str, list[str]], starts: Sequence[int], notes: list[str]
) -> tuple[Series, ...]:
    by_column = {one.column: one for one in table.series}
    made: list[Series] = []
    scaled = []
    for number, start in enumerate(starts):
        clock = by_column.get(start)
        if clock is None:
            continue
        time_s = clock.read() * 1e-3
        there = np.flatnonzero(np.isfinite(time_s))
        time_s = time_s[: there[-1] + 1 if there.size else 0]
        end = starts[number + 1] if number + 1 < len(starts) else len(keys[NAME])
        for i in range(start + 1, end):
            cell = {key: cells[i] for key, cells in keys.items() if i < len(cells)}
            series = by_column.get(i)
            if series is None:
                notes.append(f"'{cell[NAME]}' is left out: it has no values")
                continue
            if any(cell.get(key, usual) != usual for key, usual in SCALES.items()):
                scaled.append(cell[NAME])
            # A unit is such as "mm (Length)", or "(None)".
            unit = re.sub(r"(?:^| )\(.*", "", cell.get(UNIT, "")).strip() or None
            made.append(_cut(series, unit, time_s, number))
    if scaled:
        notes.append(
            f"{', '.join(scaled)}: the values are taken as already scaled; Scope states a factor "
            "or an offset, and exports raw values only without its option 'Scale values'"
        )
    return tuple(made)


def _cut(series: Series, unit: str | None, time_s: FloatArray, group: int) -> Series:
    """Returns a channel without the rows behind the end of its group, where it has no time."""
    size = time_s.size
    cut = replace(series, size=size, unit=unit, group=str(group))
    return replace(cut, read=lambda: series.read()[:size], time=lambda: time_s)


SCOPE = Kind(read_scope, (), HEAD)
