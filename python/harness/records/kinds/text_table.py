# SPDX-License-Identifier: MIT
"""Makes a log of text, in any layout that `dialect` finds."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache, cached_property
from itertools import islice, zip_longest
from pathlib import Path

import numpy as np

from ...base.numbers import FloatArray
from ...catalogue.channels import TIME
from ..errors import BYTES, COLUMNS, GZIP_MAGIC, LINE, SAMPLES, RecordError
from ..log import Log, Series
from ..moments import TRIED_ROWS, Stamps, first_filled, moments
from ..names import is_counter, means
from ..values import (
    CORRECT_CELL,
    Cells,
    Marks,
    marks_of,
    no_number,
    numbers_in,
    shown,
)
from .dialect import SAMPLE_LINES, Dialect, samples_of, sniff

UTF8_BOM = b"\xef\xbb\xbf"
UTF16_BOMS = (b"\xff\xfe", b"\xfe\xff")
CELL_BYTES = 8
# Blocks of this size stay in the cache of a processor.
BLOCK_BYTES, BLOCK_ROWS = 2**16, 1000
MARKS = {".": "point", ",": "comma"}
EXPECTED_CSV = "comma-separated UTF-8 text with column names in row 1 and a decimal point"
EXPECTED = "a table of numbers as text, with names above the columns"


def unreadable_line(
    path: Path, row: int, error: csv.Error, expected: str = EXPECTED_CSV
) -> RecordError:
    """Returns the error for a line that is not CSV, such as one with a stray carriage return."""
    return RecordError(
        path,
        f"the row cannot be divided into cells ({str(error).split(' - ')[0]})",
        row=row,
        expected=expected,
        mend="look for stray quotation marks and control characters, and mixed line ends",
    )


def blocks_of_rows(
    body: bytes, delimiter: str, path: Path, first_row: int
) -> Iterator[list[list[str]]]:
    """Returns rows as lists of their cells, some rows at a time.

    Raises
    ------
    RecordError
        a row cannot be divided into cells.
    """
    if b'"' in body:
        rows = csv.reader(body.decode().split("\n"), delimiter=delimiter, strict=True)
        block, end = list[list[str]](), 0
        try:
            for cells in rows:
                block.append(cells)
                end = rows.line_num
                if len(block) == BLOCK_ROWS:
                    yield block
                    block = []
        except csv.Error as error:
            expected = EXPECTED_CSV if delimiter == "," else EXPECTED
            raise unreadable_line(path, first_row + end, error, expected) from None
        yield from [block] if block else []
        return
    start = 0
    while start <= len(body):
        end = body.find(b"\n", start + BLOCK_BYTES)
        end = end if end >= 0 else len(body)
        yield [line.split(delimiter) for line in body[start:end].decode().split("\n")]
        start = end + 1


def _binary(path: Path) -> RecordError:
    return RecordError(
        path,
        "the file is binary, not text",
        expected=EXPECTED,
        mend="give it the extension of its real format, or export it as text",
    )


class Text:
    """A text as UTF-8 with line feeds, and `notes` on another coding.

    Raises
    ------
    RecordError
        the file is empty or binary.
    """

    def __init__(self, data: bytes, path: Path) -> None:
        self._path = path
        self.notes: list[str] = []
        if not data.strip():
            raise RecordError(path, "the file is empty", expected=EXPECTED, mend="export it again")
        if data.startswith(UTF16_BOMS):
            try:
                data = data.decode("utf-16").encode()
            except UnicodeError:
                raise _binary(path) from None
            self.notes.append("the text is UTF-16")
        data = data.removeprefix(UTF8_BOM)
        if b"\x00" in data or data.startswith(GZIP_MAGIC):
            raise _binary(path)
        try:
            data.decode("utf-8")
        except UnicodeDecodeError:
            # Every byte but five is a letter or sign of Windows-1252.
            data = data.decode("cp1252", errors="replace").encode()
            self.notes.append("the text is not UTF-8: read as Windows-1252 (Latin-1)")
        data = data.replace(b"\r\n", b"\n")
        self.content = data if b"\n" in data else data.replace(b"\r", b"\n")

    def check_size(self) -> None:
        """Checks the number of lines and their lengths before any line is divided into cells."""
        SAMPLES.check(self.content.count(b"\n") - 1, self._path)
        longest, start = LINE.most, 0
        while len(self.content) - start > longest:
            # The last line end that is near enough: all lines before it are short enough.
            end = self.content.rfind(b"\n", start, start + longest + 1)
            if end < 0:
                row = self.content.count(b"\n", 0, start) + 1
                LINE.check(len(self.content) - start, self._path, row=row, at_least=True)
            start = end + 1

    @cached_property
    def dialect(self) -> Dialect | None:
        """The layout; None if the text is no table of numbers."""
        self.check_size()
        # A line is bounded by the limits; names and numbers need far less.
        head = self.content[: SAMPLE_LINES * 20_000].split(b"\n", SAMPLE_LINES)
        whole = len(head) <= SAMPLE_LINES and len(self.content) <= SAMPLE_LINES * 20_000
        lines = [line.decode("utf-8", "replace") for line in head[:SAMPLE_LINES]]
        return sniff(lines, whole=whole)

    def log(self) -> Log:
        """Returns the table of numbers in the text.

        Raises
        ------
        RecordError
            there is none, or its rows do not belong to its names.
        """
        if self.dialect is None:
            raise RecordError(
                self._path,
                "no table of numbers was found: no delimiter divides the lines into equally many "
                "columns of numbers",
                expected=EXPECTED,
                mend="look into the file; it may be cut, or of another kind than its name says",
            )
        return TextTable(self.content, self._path, self.dialect).log([*self.notes])


class TextTable:
    """The rows of a text file below its header."""

    def __init__(self, text: bytes, path: Path, dialect: Dialect) -> None:
        self._path = path
        self._dialect = dialect
        self._text = text
        self._usual = Marks(dialect.decimal)

    def log(self, notes: list[str]) -> Log:
        """Returns the log; cells are turned into numbers only when a series is read."""
        dialect, path = self._dialect, self._path
        COLUMNS.check(dialect.columns, path, row=dialect.names_row or dialect.data_row)
        body = self._body(notes)
        BYTES.check((body.count(b"\n") + 1) * dialect.columns * CELL_BYTES, path)
        columns = self._columns(body)
        self._check_header(body, notes)
        names = _unique([*dialect.names, *[""] * (dialect.columns - len(dialect.names))], notes)
        units = [*dialect.units, *[""] * (dialect.columns - len(dialect.units))]
        blocks = _blocks(names, dialect.names, columns)
        series, texts = [], []
        for i, name in enumerate(names):
            column = columns[i]
            if any(column):
                series.append(self._series(name, units[i] or None, column, i, notes))
                if not series[-1].is_time and self._is_text(column):
                    texts.append(name)
        series = [replace(one, group=blocks[one.column or 0]) for one in series]
        series += self._date_and_time(series, names, columns)
        return Log(
            dialect.words,
            tuple(series),
            dialect.data_row,
            tuple(notes),
            dialect.dt_s,
            tuple(texts),
        )

    def _body(self, notes: list[str]) -> bytes:
        """Returns the rows of the samples; `notes` get what else stands below them."""
        dialect = self._dialect
        body = self._text.split(b"\n", dialect.data_row - 1)[-1].rstrip(b"\n\t ")
        ended = self._text.endswith(b"\n")
        body, said = samples_of(body, dialect.delimiter, dialect.decimal, ended=ended)
        notes += said
        if self._dialect.delimiter == " ":
            return b"\n".join(b" ".join(line.split()) for line in body.split(b"\n"))
        return body

    def _columns(self, body: bytes) -> list[Cells]:
        """Returns the cells of the columns; those that a short row lacks are empty."""
        columns = [Cells() for _ in range(self._dialect.columns)]
        row = self._dialect.data_row
        for rows in blocks_of_rows(body, self._dialect.delimiter, self._path, row):
            self._check_width(rows, row)
            # The first row makes the block as wide as the table.
            widest = zip_longest([""] * len(columns), *rows, fillvalue="")
            for column, cells in zip(columns, widest, strict=True):
                column.append(cells[1:])
            row += len(rows)
        return columns

    def _check_width(self, rows: Sequence[Sequence[str]], first: int) -> None:
        columns = self._dialect.columns
        for row, cells in enumerate(rows, first):
            if len(cells) > columns:
                raise RecordError(
                    self._path,
                    f"the row has {len(cells)} cells, the header has {columns} columns",
                    row=row,
                    expected="one cell for every column",
                    mend="correct the row; a second log may follow in the same file",
                )

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

    def _series(
        self, name: str, unit: str | None, column: Cells, number: int, notes: list[str]
    ) -> Series:
        sample = first_filled(column, TRIED_ROWS)
        dates = moments(sample) if numbers_in("\n".join(sample), self._usual)[1].any() else None
        if dates is not None:
            return self._dates(name, column, dates.local, number)
        marks = marks_of(column, self._dialect.decimal)
        if marks.thousands is not None:
            notes.append(f"'{name}': '{marks.thousands}' stands between thousands, as in 1000")
        elif marks.decimal != self._dialect.decimal:
            notes.append(f"'{name}' has a decimal {MARKS[marks.decimal]}, unlike other columns")

        @cache
        def values() -> FloatArray:
            if marks.doubtful is not None:
                raise self._doubtful(name, column, marks.doubtful)
            numbers, bad = column.numbers(marks)
            if bad.any():
                k = int(np.argmax(bad))
                row, decimal = self._dialect.data_row + k, self._dialect.decimal
                cell = next(islice(column, k, None))
                raise no_number(self._path, row, name, cell, CORRECT_CELL, decimal)
            return numbers

        return Series(name, len(column), values, unit, column=number)

    def _dates(self, name: str, column: Cells, local: bool, number: int | None) -> Series:
        @cache
        def values() -> FloatArray:
            found = moments(column)
            assert found is not None
            if found.bad.any():
                raise self._no_moment(name, [*column], found)
            return found.time_s

        return Series(name, len(column), values, "s", is_time=True, local=local, column=number)

    def _is_text(self, column: Cells) -> bool:
        """Whether the first cells of a column hold text, and not one of them a number."""
        head = first_filled(column, SAMPLE_LINES)
        numbers, unread = numbers_in("\n".join(head), marks_of(head, self._dialect.decimal))
        return bool(unread.any()) and not bool(np.isfinite(numbers).any())

    def _doubtful(self, name: str, column: Cells, cell: str) -> RecordError:
        mark = "." if self._dialect.decimal == "," else ","
        return RecordError(
            self._path,
            f"'{cell}' may be {cell.replace(mark, '')} or {cell.replace(mark, '.')}: the file has "
            f"'{self._dialect.decimal}' as its decimal mark, and every number of this column has "
            f"'{mark}' before its last three digits",
            row=self._dialect.data_row + [*column].index(cell),
            column=name,
            expected="numbers that can be read in one way only",
            mend=f"export the log without '{mark}' between thousands, and with one decimal mark",
        )

    def _no_moment(self, name: str, cells: Sequence[str], found: Stamps) -> RecordError:
        row = int(np.argmax(found.bad))
        usual = cells[int(np.argmax(~np.isnan(found.time_s)))]
        return RecordError(
            self._path,
            f"the text '{shown(cells[row])}' is no date or time of the form of '{usual}'",
            row=self._dialect.data_row + row,
            column=name,
            expected="a date or time of the same form in every row",
            mend="correct the cell, or remove the row",
        )

    def _date_and_time(
        self, series: Sequence[Series], names: Sequence[str], columns: Sequence[Cells]
    ) -> list[Series]:
        """Returns one series for a column of dates and one of times of day beside each other."""
        dated = [one for one in series if one.is_time]
        if len(dated) < 2:
            return []
        first, second = (columns[names.index(one.name)] for one in dated[:2])
        if re.match(r"\d{1,2}:", next(filter(None, first))):
            first, second = second, first
        days_and_times = zip(first, second, strict=True)
        both = Cells()
        both.append([f"{day} {time}" if day and time else "" for day, time in days_and_times])
        found = moments(first_filled(both, TRIED_ROWS))
        if found is None:
            return []
        return [self._dates(f"{dated[0].name} {dated[1].name}", both, found.local, None)]


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


def _blocks(names: Sequence[str], given: Sequence[str], columns: Sequence[Cells]) -> list[str]:
    """Returns for each column the number of the table that it belongs to, as a name of a group.

    Tables stand side by side where a column of time follows under the name of an earlier one, or
    behind a column without name and cells.
    """
    blocks, block = [], 0
    seen: set[str] = set()
    apart = False
    for i in range(len(names)):
        said = given[i].strip() if i < len(given) else ""
        apart |= not said and not any(columns[i])
        if said and means(said, TIME) and not is_counter(said):
            block += bool(seen) and (apart or said in seen)
            seen.add(said)
            apart = False
        blocks.append(f"{block}")
    return blocks if block else [""] * len(names)
