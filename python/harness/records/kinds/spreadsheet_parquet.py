# SPDX-License-Identifier: MIT
"""Reads the sheets of Excel and OpenDocument files, and Parquet files with typed columns.

How large a sheet becomes is found before it is loaded. The reader makes a rectangle of all cells
between the first and the last one, and a copy of a text for each cell that has it. A small file may
so ask for any memory, and the reader then ends the process. The bytes are searched as the reader
reads them: it expands no entities.
"""

from __future__ import annotations

import re
import zipfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ...base.numbers import FloatArray
from ..errors import BYTES, COLUMNS, SAMPLES, RecordError, damage_named
from ..log import Kind, Log, Series, Table
from ..moments import over_midnight, since_first
from .text_table import Text

if TYPE_CHECKING:
    import polars as pl


MOST_SHEETS = 50
NINE_DECIMALS = 1e-9
TICKS_S = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "d": 86_400.0}
CELL_BYTES = 32
# The reader takes no more from an OpenDocument file.
MOST_ROWS, MOST_COLUMNS = 1_048_576, 16_384

_PLACE = re.compile(rb"""\br\s*=\s*["']\s*([A-Za-z]{0,4})(\d{1,9})\b""")
_SHARED = re.compile(rb"""\bt\s*=\s*["']s["'][^>]*>\s*<(?:\w+:)?v[^>]*>\s*(\d{1,9})\s*<""")
_ANY_SHARED = re.compile(rb"""\bt\s*=\s*["']s["']""")
_END_OF_TEXT = re.compile(rb"</(?:\w+:)?si\s*>")
_TAG = re.compile(
    rb"<(/?)(?:\w+:)?(table|table-row|table-cell|covered-table-cell)(?=[\s/>])([^>]*?)(/?)>"
)
_REPEATED = re.compile(rb"""number-(?:columns|rows)-repeated\s*=\s*["'](\d+)""")


def read_spreadsheet(data: bytes, path: Path) -> Log:
    """Returns the sheet with most rows of numbers as a log."""
    import fastexcel

    _check_size(data, path)
    with damage_named(path, "spreadsheet"):
        book = fastexcel.read_excel(data)
        names = list(book.sheet_names)[:MOST_SHEETS]
        sheets = [(name, _as_text(book, name, path)) for name in names]
    logs = []
    for name, text in sheets:
        sheet = Text(text, path) if text.strip() else None
        if sheet is not None and sheet.dialect is not None:
            log = sheet.log()
            log = replace(log, series=_exact(log, book, name, path))
            logs.append((max(one.size for one in log.series), name, log))
    if not logs:
        raise RecordError(
            path,
            "no sheet is a table of numbers",
            expected="a sheet with names above columns of numbers",
            mend="put the signals into one sheet, one in each column",
        )
    _, name, log = max(logs, key=lambda one: one[0])
    layout = log.kind.removeprefix("text, columns separated by tabs").removeprefix(", ")
    kind = f"spreadsheet, sheet '{name}'" + (f", {layout}" if layout else "")
    others = [other for _, other, _ in logs if other != name]
    notes = (f"other sheets are not read: {', '.join(others)}",) if others else ()
    return replace(log, kind=kind, notes=(*log.notes, *notes))


def _check_size(data: bytes, path: Path) -> None:
    """Checks the sizes that a zip file states, and those of its sheets, before they are loaded."""
    if not data.startswith(b"PK"):
        return
    with damage_named(path, "spreadsheet"), zipfile.ZipFile(BytesIO(data)) as archive:
        BYTES.check(sum(one.file_size for one in archive.infolist()), path)
        names = [one for one in archive.namelist() if one.lower().endswith(".xml")]
        texts: list[int] = []
        for name in names:
            if name.lower().endswith("sharedstrings.xml"):
                texts = [len(one) for one in _END_OF_TEXT.split(archive.read(name))]
        for name in names:
            content = archive.read(name)
            if name == "content.xml":
                _check_ods(content, path)
            elif b"sheetData" in content:
                _check_xlsx(content, texts, path)


def _exact(log: Log, book: Any, name: str, path: Path) -> tuple[Series, ...]:
    """Returns the series with the numbers of the cells, of which the text has nine decimals only.

    A cell that is text, such as a number with a decimal comma, is read from the text.
    """

    @cache
    def cells() -> pl.DataFrame:
        sheet = book.load_sheet(name, header_row=None, skip_rows=log.first_row - 1, dtypes="float")
        frame: pl.DataFrame = sheet.to_polars()
        return frame

    def exact(one: Series) -> Series:
        def values() -> FloatArray:
            from_text = one.read()
            assert one.column is not None
            with damage_named(path, "spreadsheet"):
                column = cells().to_series(one.column).head(one.size)
            numbers = column.extend_constant(None, one.size - len(column))
            found = numbers.fill_null(float("nan")).to_numpy()
            # The number of a cell with text is what Excel would make of "1.000", not the log.
            return np.where(np.abs(found - from_text) <= NINE_DECIMALS, found, from_text)

        return one if one.is_time or one.column is None else replace(one, read=cache(values))

    return tuple(exact(one) for one in log.series)


def _as_text(book: Any, name: str, path: Path) -> bytes:
    """Returns a sheet as lines with tabs between the cells."""
    import polars as pl

    sheet = book.load_sheet(name, header_row=None, skip_rows=0, dtypes="string")
    COLUMNS.check(sheet.width, path)
    SAMPLES.check(sheet.total_height, path)
    frame = sheet.to_polars()
    if not frame.width:
        return b""
    clean = frame.select(pl.all().cast(pl.String).str.replace_all(r"[\t\r\n]+", " ").fill_null(""))
    buffer = BytesIO()
    clean.write_csv(buffer, include_header=False, separator="\t", quote_style="never")
    return buffer.getvalue()


def _check_xlsx(content: bytes, texts: list[int], path: Path) -> None:
    columns: set[bytes] = set()
    rows = [MOST_ROWS, 0]
    for place in _PLACE.finditer(content):
        columns.add(place[1])
        row = int(place[2])
        rows = [min(rows[0], row), max(rows[1], row)]
    numbers = [_column_number(one) for one in columns if one]
    used = Counter(one[1] for one in _SHARED.finditer(content))
    total = sum(count * texts[int(one)] for one, count in used.items() if int(one) < len(texts))
    other = sum(1 for _ in _ANY_SHARED.finditer(content)) - sum(used.values())
    total += max(other, 0) * max(texts, default=0)
    _check(rows[1] - rows[0] + 1, max(numbers, default=0) - min(numbers, default=0) + 1, total,
           path)  # fmt: skip


def _column_number(letters: bytes) -> int:
    """Returns the number of a column, such as 28 of AB."""
    number = 0
    for letter in letters.upper():
        number = 26 * number + letter - ord("A") + 1
    return number


def _check_ods(content: bytes, path: Path) -> None:
    row = column = last_row = last_column = total = in_row = repeated_rows = cells_end = 0
    repeated_cells, filled = 1, False
    for tag in _TAG.finditer(content):
        closing, kind, attributes, empty = tag.groups()
        found = _REPEATED.search(attributes)
        repeated = int(found[1][:9]) if found else 1
        if kind == b"table":
            _check(last_row, last_column, total, path)
            row = last_row = last_column = total = 0
        elif kind == b"table-row":
            if not closing:
                repeated_rows, column, in_row, filled = min(repeated, MOST_ROWS), 0, 0, False
            if closing or empty:
                row = min(row + repeated_rows, MOST_ROWS)
                last_row = row if filled else last_row
                total += in_row * repeated_rows
        elif not closing:
            repeated_cells, cells_end = min(repeated, MOST_COLUMNS), tag.end()
            column = min(column + repeated_cells, MOST_COLUMNS)
            if not empty or b"value" in attributes:
                filled, last_column = True, max(last_column, column)
        else:
            in_row += repeated_cells * (tag.start() - cells_end)
    _check(last_row, last_column, total, path)


def _check(rows: int, columns: int, text_bytes: int, path: Path) -> None:
    COLUMNS.check(columns, path)
    SAMPLES.check(rows, path)
    BYTES.check(rows * columns * CELL_BYTES + text_bytes, path)


SPREADSHEET = Kind(read_spreadsheet, ("xlsx", "xlsm", "xlsb", "xls", "ods"))


FLOAT64_BYTES = 8


class ParquetTable(Table):
    """The columns of a file, read one by one."""

    ending = "parquet"

    def __init__(self, data: bytes, path: Path) -> None:
        import polars as pl

        self._path = path
        self._data = data
        with damage_named(path, "Parquet"):
            self._schema = pl.read_parquet_schema(BytesIO(data))
            rows = pl.scan_parquet(BytesIO(data)).select(pl.len()).collect().item()
        self._rows = int(rows)
        SAMPLES.check(self._rows, path)
        COLUMNS.check(len(self._schema), path)

    def names(self) -> list[str]:
        """Returns the names of the columns."""
        return list(self._schema)

    def text_names(self) -> list[str]:
        """Returns the names of the columns that hold text."""
        return [name for name, dtype in self._schema.items() if str(dtype) == "String"]

    def read(self, wanted: Sequence[str]) -> dict[str, npt.NDArray[Any]]:
        """Returns columns as float64 arrays."""
        for name in wanted:
            self._check_type(name)
        frame = self._frame(wanted)
        return {name: _as_float(frame[name]) for name in wanted}

    def log(self) -> Log:
        """Returns all signals of the file."""
        usable = [
            one for one, dtype in self._schema.items() if dtype.is_numeric() or dtype.is_temporal()
        ]
        BYTES.check(self._rows * len(usable) * FLOAT64_BYTES, self._path)
        skipped = tuple(name for name in self._schema if name not in usable)
        return Log("Parquet", tuple(self._series(name) for name in usable), texts=skipped)

    def _series(self, name: str) -> Series:
        dtype = self._schema[name]
        is_time = dtype.is_temporal()
        local = is_time and getattr(dtype, "time_zone", "none") is None

        @cache
        def values() -> FloatArray:
            column = self._frame([name])[name]
            return _from_datetimes(column) if is_time else _as_float(column)

        unit = "s" if is_time else None
        return Series(name, self._rows, values, unit, is_time=is_time, local=local)

    def _frame(self, names: Sequence[str]) -> pl.DataFrame:
        import polars as pl

        BYTES.check(self._rows * len(names) * FLOAT64_BYTES, self._path)
        with damage_named(self._path, "Parquet"):
            return pl.read_parquet(BytesIO(self._data), columns=list(names))

    def _check_type(self, name: str) -> None:
        dtype = self._schema[name]
        if not dtype.is_numeric() and str(dtype) != "Boolean":
            raise RecordError(
                self._path,
                f"the values are of type {dtype}",
                column=name,
                expected="real numbers (time in seconds as a number)",
                mend="convert the column to numbers, or name the columns to use",
            )


def _from_datetimes(stamps: pl.Series) -> FloatArray:
    """Returns seconds since the first of typed moments, times of day or durations.

    They are counted in their own unit: in nanoseconds, only the years 1677 to 2262 have room. With
    a time zone, what counts is stored in UTC and runs on over the change of summer time.
    """
    import polars as pl

    unit = "d" if stamps.dtype == pl.Date else getattr(stamps.dtype, "time_unit", None) or "ns"
    ticks = stamps.to_physical().cast(pl.Int64).fill_null(0).to_numpy()
    found = since_first(ticks, stamps.is_not_null().to_numpy(), TICKS_S[unit])
    return over_midnight(found) if stamps.dtype == pl.Time else found


def _as_float(column: pl.Series) -> FloatArray:
    import polars as pl

    return column.cast(pl.Float64).to_numpy()


PARQUET = Kind(ParquetTable, ("parquet",))
