# SPDX-License-Identifier: MIT
"""Reads LabVIEW measurement files (LVM): text in segments, each with a header of its own.

The layout is that of "Specification for the LabVIEW Measurement File (.lvm)", National Instruments.
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
from ..logs import text_table as plain
from ..logs.dialect import Dialect, cells_of
from ..logs.log import Kind, Log, Series

END, START_SPECIAL, END_SPECIAL = "***End_of_Header***", "***Start_Special***", "***End_Special***"
FIRST_LINE = "LabVIEW Measurement"
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


def read(data: bytes, path: Path) -> Log:
    """Returns the channels of an LVM file, each with the time that its headers state.

    Raises
    ------
    RecordError
        a header or a row is damaged, the segments have other channels, or one begins before the
        end of another.
    """
    content, note = plain.decode(data, path)
    if not content.startswith(FIRST_LINE.encode()):
        return plain.log_of(data, path)  # LabVIEW can write the rows without headers
    plain.check_size(content, path)
    lines = content.decode().split("\n")
    separator = _separator(lines)
    header, segments, notes = _segments(lines, separator, path)
    return _File(path, lines, separator, header, segments).log([note, *notes] if note else notes)


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
        first = self._segments[0]
        names = first.names
        labels = tuple(f"{one} {i}" if one == "X_Value" else one for i, one in enumerate(names))
        dialect = Dialect(self._separator, self._decimal, labels, (), 0, 1, len(names), len(names))
        table = self._placed(
            lambda: plain.TextTable(self._body.encode(), self._path, dialect).log(notes)
        )
        by_column = {one.column: one for one in table.series}
        last = len(names) - (names[-1].casefold() == "comment")
        step = 2 if self._columns == "multi" else 1
        channels = range(1, last, step)
        made = []
        for column in channels:
            if column not in by_column:
                notes.append(f"'{names[column]}' is left out: it has no values")
                continue
            made.append(self._channel(by_column[column], column, by_column))
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
        return Log(
            "LabVIEW measurement file (LVM)", tuple(made), first.rows[0], tuple(notes), texts=texts
        )

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


KIND = Kind(read, ("lvm",), rb"(?:\xef\xbb\xbf)?LabVIEW Measurement")
