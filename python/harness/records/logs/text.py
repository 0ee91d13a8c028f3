# SPDX-License-Identifier: MIT
"""Reads logs that are text, in any layout that `dialect` finds."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import polars as pl

from ehsid.harness.arrays import FloatArray
from ehsid.harness.records.csv_text import (
    GZIP_MAGIC,
    UTF8_BOM,
    UTF16_BOMS,
    check_size,
    plain_number_mend,
)
from ehsid.harness.records.errors import RecordError
from ehsid.harness.records.limits import BYTES, COLUMNS
from ehsid.harness.records.logs.dates import seconds
from ehsid.harness.records.logs.dialect import EMPTY, SAMPLE_LINES, Dialect, cells_of, sniff
from ehsid.harness.records.logs.log import Log, Series

CELL_BYTES = 8
MARKS = {".": "point", ",": "comma"}
EXPECTED = "a table of numbers as text, with names above the columns"


def decode(data: bytes, path: Path) -> tuple[bytes, str | None]:
    """Returns the text as UTF-8 with line feeds, and a note on another coding or None.

    Raises
    ------
    RecordError
        the file is empty or binary.
    """
    if not data.strip():
        raise RecordError(path, "the file is empty", expected=EXPECTED, mend="export it again")
    note = None
    if data.startswith(UTF16_BOMS):
        try:
            data = data.decode("utf-16").encode()
        except UnicodeError:
            raise _binary(path) from None
        note = "the text is UTF-16"
    data = data.removeprefix(UTF8_BOM)
    if b"\x00" in data or data.startswith(GZIP_MAGIC):
        raise _binary(path)
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        # Every byte but five is a letter or sign of Windows-1252.
        data = data.decode("cp1252", errors="replace").encode()
        note = "the text is not UTF-8: read as Windows-1252 (Latin-1)"
    data = data.replace(b"\r\n", b"\n")
    return (data if b"\n" in data else data.replace(b"\r", b"\n")), note


def _binary(path: Path) -> RecordError:
    return RecordError(
        path,
        "the file is binary, not text",
        expected=EXPECTED,
        mend="give it the extension of its real format, or export it as text",
    )


def dialect_of(data: bytes) -> Dialect | None:
    """Returns the layout of a text, or None if it is no table of numbers."""
    # A line is bounded by the limits; names and numbers need far less.
    head = data[: SAMPLE_LINES * 20_000].split(b"\n", SAMPLE_LINES)
    whole = len(head) <= SAMPLE_LINES and len(data) <= SAMPLE_LINES * 20_000
    lines = [line.decode("utf-8", "replace") for line in head[:SAMPLE_LINES]]
    return sniff(lines, whole=whole)


def read(data: bytes, path: Path) -> Log:
    """Returns the log in a text file.

    Raises
    ------
    RecordError
        the text is no table of numbers, or is beyond a limit.
    """
    log = table_log(data, path)
    if log is None:
        raise RecordError(
            path,
            "no table of numbers was found: no delimiter divides the lines into equally many "
            "columns of numbers",
            expected=EXPECTED,
            mend="look into the file; it may be cut, or of another kind than its name says",
        )
    return log


def table_log(data: bytes, path: Path) -> Log | None:
    """Returns the log in a text, or None if the text is no table of numbers.

    Raises
    ------
    RecordError
        the text is empty or binary, or is beyond a limit.
    """
    text, note = decode(data, path)
    check_size(text, path)
    dialect = dialect_of(text)
    return None if dialect is None else TextTable(text, path, dialect).log([note] if note else [])


class TextTable:
    """The rows of a text file below its header."""

    def __init__(self, text: bytes, path: Path, dialect: Dialect) -> None:
        self._path = path
        self._dialect = dialect
        self._text = text

    def log(self, notes: list[str]) -> Log:
        """Returns the log; cells are turned into numbers only when a series is read."""
        dialect, path = self._dialect, self._path
        COLUMNS.check(dialect.columns, path, row=dialect.names_row or dialect.data_row)
        body = self._body(notes)
        BYTES.check((body.count(b"\n") + 1) * dialect.columns * CELL_BYTES, path)
        frame = self._frame(body)
        self._check_header(body, notes)
        names = _unique([*dialect.names, *[""] * (dialect.columns - len(dialect.names))], notes)
        units = [*dialect.units, *[""] * (dialect.columns - len(dialect.units))]
        series, texts = [], []
        for i, name in enumerate(names):
            column = frame[f"{i}"]
            if column.null_count() < len(column):
                series.append(self._series(name, units[i] or None, column, i, notes))
                if not series[-1].is_time and self._is_text(column):
                    texts.append(name)
        series += self._date_and_time(series, names, frame)
        return Log(
            dialect.words,
            tuple(series),
            dialect.data_row,
            tuple(notes),
            dialect.dt_s,
            tuple(texts),
        )

    def _body(self, notes: list[str]) -> bytes:
        """Returns the rows of the data; a last row that the logger did not finish is left out."""
        body = self._text.split(b"\n", self._dialect.data_row - 1)[-1].rstrip(b"\n\t ")
        *_, before, last = [b"", *body.rsplit(b"\n", 1)]
        if before and not self._text.endswith(b"\n"):
            delimiter = self._dialect.delimiter
            previous = before.rsplit(b"\n", 1)[-1].decode()
            if len(cells_of(last.decode(), delimiter)) < len(cells_of(previous, delimiter)):
                notes.append("the last row is not complete and is left out")
                body = before
        if self._dialect.delimiter == " ":
            return b"\n".join(b" ".join(line.split()) for line in body.split(b"\n"))
        return body

    def _frame(self, body: bytes) -> pl.DataFrame:
        dialect = self._dialect
        # The reader takes the number of columns from the first row, which may be a short one.
        widest = dialect.delimiter.encode() * (dialect.columns - 1) + b"\n"
        try:
            return pl.read_csv(
                widest + body,
                has_header=False,
                separator=dialect.delimiter,
                schema={f"{i}": pl.String for i in range(dialect.columns)},
                quote_char='"' if b'"' in body else None,
            ).slice(1)
        except pl.exceptions.PolarsError:
            self._find_ragged(body)
            raise RecordError(
                self._path,
                "the rows cannot be divided into cells",
                expected=EXPECTED,
                mend="look for stray quotation marks and control characters",
            ) from None

    def _check_header(self, body: bytes, notes: list[str]) -> None:
        """Checks that there is a name for every column, and a column for every name."""
        dialect = self._dialect
        names = len(dialect.names)
        if not dialect.names:
            above = self._text.split(b"\n", dialect.data_row - 1)[:-1]
            filled = [line.decode("utf-8", "replace").strip() for line in above if line.strip()]
            if filled:
                notes.append(
                    f"'{filled[-1][:40]}' above the data does not name its {dialect.columns} "
                    "columns: they are numbered"
                )
            return
        if not dialect.names_row or names == dialect.cells:
            return
        rows = body.decode("utf-8", "replace").split("\n")
        widest = max(row.count(dialect.delimiter) for row in rows) + 1
        if names < dialect.cells:
            mend = (
                "add the name that is missing, such as 'row' if the first column numbers the rows"
            )
            if dialect.delimiter == ",":
                comma = "if the numbers have a decimal comma, export them with a decimal point"
                mend = comma if 2 * names == dialect.cells else f"{mend}; {comma}"
        elif names > widest and all(dialect.names[widest:]):
            mend = "remove the name that has no values, or export the file again with all values"
            if dialect.delimiter == " ":
                mend = "write names without blanks, because blanks separate the columns"
        else:
            return
        raise RecordError(
            self._path,
            f"the header has {names} names, the rows have {min(widest, dialect.columns)} cells",
            row=dialect.names_row,
            expected="one name for each column",
            mend=mend,
        )

    def _find_ragged(self, body: bytes) -> None:
        dialect = self._dialect
        for i, line in enumerate(body.decode("utf-8", "replace").split("\n")):
            count = len(cells_of(line, dialect.delimiter))
            if count > dialect.columns:
                raise RecordError(
                    self._path,
                    f"the row has {count} cells, the header has {dialect.columns} columns",
                    row=dialect.data_row + i,
                    expected="one cell for every column",
                    mend="correct the row; a second log may follow in the same file",
                )

    def _series(
        self, name: str, unit: str | None, column: pl.Series, number: int, notes: list[str]
    ) -> Series:
        sample = column.drop_nulls()
        dates = seconds(sample.head(1)) is not None and self._unread(sample.head(1))
        decimal = self._decimal(sample.head(SAMPLE_LINES))
        if decimal != self._dialect.decimal:
            notes.append(f"'{name}' has a decimal {MARKS[decimal]}, unlike other columns")

        @cache
        def values() -> FloatArray:
            if dates:
                found = seconds(column)
                if found is not None:
                    return found
            numbers, bad = self._numbers(column, decimal)
            if bad.any():
                raise self._no_number(name, column, int(np.argmax(bad)))
            return numbers

        return Series(
            name, len(column), values, "s" if dates else unit, is_time=dates, column=number
        )

    def _unread(self, column: pl.Series) -> bool:
        """Whether a cell of a column is no number in the notation of the file."""
        return bool(self._numbers(column, self._dialect.decimal)[1].any())

    def _decimal(self, sample: pl.Series) -> str:
        """Returns the decimal mark of a column: that of the file, if its numbers do not differ."""
        other = "," if self._dialect.decimal == "." else "."
        if self._unread(sample) and not self._numbers(sample, other)[1].any():
            return other
        return self._dialect.decimal

    @staticmethod
    def _numbers(
        column: pl.Series, decimal: str
    ) -> tuple[FloatArray, np.ndarray[tuple[int], np.dtype[np.bool_]]]:
        """Returns the numbers of a column, NaN where there is none, and where text is no number."""
        text = column.str.strip_chars()
        if decimal == ",":
            text = text.str.replace(",", ".", literal=True)
        numbers = text.str.replace("[dD]([+-]?[0-9]+)$", "e${1}").cast(pl.Float64, strict=False)
        unread = numbers.is_null() & text.is_not_null()
        if unread.any():
            unread &= ~text.str.to_lowercase().is_in(list(EMPTY))
        return numbers.fill_null(float("nan")).to_numpy(), unread.to_numpy()

    def _is_text(self, column: pl.Series) -> bool:
        """Whether the first cells of a column hold text, and not one of them a number."""
        head = column.drop_nulls().head(SAMPLE_LINES)
        numbers, unread = self._numbers(head, self._decimal(head))
        return bool(unread.any()) and not bool(np.isfinite(numbers).any())

    def _no_number(self, name: str, column: pl.Series, row: int) -> RecordError:
        cell = str(column[row]).strip()
        shown = cell if len(cell) <= 40 else cell[:37] + "..."
        return RecordError(
            self._path,
            f"the text '{shown}' is not a number",
            row=self._dialect.data_row + row,
            column=name,
            expected=f"a number such as 0{self._dialect.decimal}125 or 1.2e-3",
            mend=plain_number_mend(cell) or "correct the cell, or name the columns to use",
        )

    def _date_and_time(
        self, series: Sequence[Series], names: Sequence[str], frame: pl.DataFrame
    ) -> list[Series]:
        """Returns one series for a column of dates and one of times of day beside each other."""
        dated = [one for one in series if one.is_time]
        if len(dated) < 2:
            return []
        first, second = (frame[f"{names.index(one.name)}"] for one in dated[:2])
        if re.match(r"\s*\d{1,2}:", str(first.drop_nulls()[0])):
            first, second = second, first
        both = first.str.strip_chars() + " " + second.str.strip_chars()
        found = seconds(both.head(2))
        if found is None:
            return []
        name = f"{dated[0].name} {dated[1].name}"

        @cache
        def values() -> FloatArray:
            joined = seconds(both)
            assert joined is not None
            return joined

        return [Series(name, len(both), values, "s", is_time=True)]


def _unique(names: Sequence[str], notes: list[str]) -> list[str]:
    """Returns the names, none twice; columns without a name are numbered from 1."""
    seen: dict[str, int] = {}
    made = []
    for i, name in enumerate(names, start=1):
        wanted = name.strip() or f"column_{i}"
        seen[wanted] = seen.get(wanted, 0) + 1
        if seen[wanted] > 1:
            wanted = f"{wanted} ({seen[wanted]})"
            notes.append(f"column {i} has a name that is there already: it is read as '{wanted}'")
        made.append(wanted)
    return made


def differs_from_schema(data: bytes, path: Path) -> bool:
    """Whether a text is a table of numbers with another layout than that of a CSV record."""
    try:
        text, note = decode(data, path)
        check_size(text, path)
    except RecordError:
        return False
    dialect = dialect_of(text)
    if dialect is None:
        return False
    plain = dialect.delimiter == "," and dialect.decimal == "." and dialect.names_row == 1
    named = len(dialect.names) - (dialect.names[-1:] == ("",))
    plain &= len(dialect.names) == dialect.columns and named == dialect.cells
    if dialect.names_row == 0 and dialect.data_row == 2 and dialect.delimiter == ",":
        return False  # names, but not as many as columns: the checks of a record say what is wrong
    return note is not None or not plain or dialect.data_row != 2 or bool(dialect.dates)
