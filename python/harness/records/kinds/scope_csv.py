# SPDX-License-Identifier: MIT
"""Reads CSV exports of TwinCAT Scope: rows of keys, then groups of channels side by side.

In the rows of keys each group begins with the key; below it are the times of the group, in ms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...base.numbers import FloatArray
from ..errors import RecordError
from ..logs import text_table as plain
from ..logs.dialect import Dialect, cells_of
from ..logs.log import Kind, Log, Series

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


def read(data: bytes, path: Path) -> Log:
    """Returns the channels, each with the times of its group.

    Raises
    ------
    RecordError
        there are no names or no values, or a row has more cells than there are names.
    """
    content, note = plain.decode(data, path)
    plain.check_size(content, path)
    text = content.decode()
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
    columns = [f"{NAME} {i}" if i in starts else name for i, name in enumerate(names)]
    dialect = Dialect(
        delimiter, decimal, tuple(columns), (), 0, data_row, max(width, len(names)), len(names)
    )
    notes = [note] if note else []
    table = plain.TextTable(body.encode(), path, dialect).log(notes)
    made = _channels(table, keys, starts, notes)
    return Log("CSV export of TwinCAT Scope", made, data_row, tuple(notes))


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
            made.append(_cut(series, _unit(cell.get(UNIT, "")), time_s, number))
    if scaled:
        notes.append(
            f"{', '.join(scaled)}: the values are taken as already scaled; Scope states a factor "
            "or an offset, and exports raw values only without its option 'Scale values'"
        )
    return tuple(made)


def _cut(series: Series, unit: str | None, time_s: FloatArray, group: int) -> Series:
    """Returns a channel without the rows behind the end of its group, where it has no time."""
    size = time_s.size
    cut = replace(series, size=size, read=lambda: series.read()[:size], time=lambda: time_s)
    return replace(cut, unit=unit, group=str(group))


def _unit(cell: str) -> str | None:
    """Returns the unit of a cell such as "mm (Length)"; None for "(None)"."""
    return cell.partition(" (")[0].strip() if not cell.startswith("(") else None


KIND = Kind(read, (), HEAD)
