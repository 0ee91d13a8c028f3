# SPDX-License-Identifier: MIT
"""Reads text: CSV as the schema has it, and tables of numbers in any other layout.

CSV is read by a fast reader, or by a slower one that finds the faulty row.
"""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Sequence
from functools import cached_property
from io import StringIO
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ...base.numbers import FloatArray
from ..errors import COLUMNS, GZIP_MAGIC, RecordError
from ..log import Kind, Log, Table
from ..values import CORRECT_CELL, no_number, plain_numbers
from .dialect import ROWS_OF_ONE_FORM, has_results, is_cut
from .text_table import EXPECTED_CSV, UTF16_BOMS, Text, blocks_of_rows, unreadable_line

FIRST_DATA_ROW = 2  # row 1 is the header
HEAD_ROWS = 100  # rows that tell whether a column holds text


class CsvTable(Table):
    """A CSV file with names in row 1; only the requested columns are parsed as numbers."""

    first_row = FIRST_DATA_ROW
    is_flat = True

    def __init__(self, data: bytes, path: Path) -> None:
        self.ending = "csv.gz" if path.name.lower().endswith(".gz") else "csv"
        self._data = data
        self._path = path
        self._names: list[str] = []
        self._body = b""
        self._refused: RecordError | None = None

    @cached_property
    def _text(self) -> Text:
        return Text(self._data, self._path)

    def names(self) -> list[str] | None:
        """Returns the names in row 1; None where the text has another layout."""
        try:
            text = self._text
        except RecordError as error:
            raise _why_no_text(self._data, self._path) or error from None
        # A file with another layout may have the right names: with a row of units below them, with
        # a decimal comma, or with dates in the column of time.
        is_other = _has_other_layout(text)
        try:
            if text.notes and (refused := _why_no_text(self._data, self._path)):
                raise refused
            self._names, self._body = _split_header(text.content, self._path)
        except RecordError as error:
            self._refused = error
        if is_other:
            return None
        if self._refused is not None:
            raise self._refused
        return self._names

    def log(self) -> Log:
        """Returns the table of numbers in the text."""
        try:
            return self._text.log()
        except RecordError as error:
            # An error with a row says more than why the file is no record of the schema.
            if self._refused is not None and error.row is None:
                raise self._refused from None
            raise

    def text_names(self) -> list[str]:
        """Names of the columns whose first cells hold text, and not one of them a number.

        Rows that cannot be divided into cells do not count: `read` says what is wrong with them.
        """
        head = self._body.split(b"\n", HEAD_ROWS)[:HEAD_ROWS]
        rows = csv.reader(line.decode("utf-8") for line in head)
        filled, with_numbers = set[str](), set[str]()
        try:
            for cells in rows:
                if len(cells) != len(self._names):
                    continue
                for name, cell in zip(self._names, cells, strict=True):
                    if cell.strip():
                        filled.add(name)
                        with_numbers |= {name} if _is_number(cell) else set()
        except csv.Error:
            return []
        return [name for name in self._names if name in filled - with_numbers]

    def read(self, wanted: Sequence[str]) -> dict[str, npt.NDArray[np.float64]]:
        """Returns columns as float64 arrays; a cell that is no number is refused with its row."""
        # Where a row is blank or has another number of cells, it is found row by row.
        places = [self._names.index(name) for name in wanted]
        parts: list[list[FloatArray]] = [[] for _ in wanted]
        try:
            for rows in blocks_of_rows(self._body, ",", self._path, FIRST_DATA_ROW):
                if set(map(len, rows)) != {len(self._names)} or [""] in rows:
                    return self._read_carefully(wanted)
                columns = [*zip(*rows, strict=True)]
                for part, place in zip(parts, places, strict=True):
                    numbers = plain_numbers(columns[place])
                    if numbers is None:
                        return self._read_carefully(wanted)
                    part.append(numbers)
        except RecordError:
            return self._read_carefully(wanted)
        return {name: np.concatenate(part) for name, part in zip(wanted, parts, strict=True)}

    def _read_carefully(self, wanted: Sequence[str]) -> dict[str, npt.NDArray[np.float64]]:
        positions = [(name, self._names.index(name)) for name in wanted]
        values: dict[str, list[float]] = {name: [] for name in wanted}
        reader = csv.reader(StringIO(self._body.decode("utf-8"), newline=""))
        row = FIRST_DATA_ROW
        try:
            for cells in reader:
                if len(cells) != len(self._names):
                    raise self._ragged(row, cells)
                for name, position in positions:
                    values[name].append(self._number(cells[position], row, name))
                row = FIRST_DATA_ROW + reader.line_num
        except csv.Error as error:
            raise unreadable_line(self._path, row, error) from None
        return {name: np.array(numbers) for name, numbers in values.items()}

    def _number(self, cell: str, row: int, column: str) -> float:
        text = cell.strip()
        if not text:
            return float("nan")
        try:
            if text.isascii() and "_" not in text:  # Python also accepts 1_000 and Arabic digits
                return float(text)
        except ValueError:
            pass
        mend = CORRECT_CELL
        if not text.isascii():
            mend = "write the number with the digits 0 to 9 and a decimal point"
        elif text.replace(",", ".", 1).lstrip("+-").replace(".", "", 1).isdigit():
            mend = "write the number with a decimal point"
        raise no_number(self._path, row, column, text, mend)

    def _ragged(self, row: int, cells: list[str]) -> RecordError:
        if not any(cell.strip() for cell in cells):
            problem, mend = "the row is blank", "remove the row"
        else:
            cell_count = f"{len(cells)} cell" + ("s" if len(cells) != 1 else "")
            problem = f"the row has {cell_count}, the header names {len(self._names)} columns"
            mend = "correct the row; if it is the last one, the file was cut short"
            if len(cells) == 2 * len(self._names):
                mend = "if the numbers have a decimal comma, export them with a decimal point"
            elif any(cell.count('"') % 2 for cell in cells) or "\n" in "".join(cells):
                mend = "look for a quotation mark that is not closed"
        return RecordError(
            self._path, problem, row=row, expected="one cell for every column", mend=mend
        )


def _why_no_text(data: bytes, path: Path) -> RecordError | None:
    """Returns the error for bytes that are no UTF-8 text; None for any others."""
    place: int | None = None
    if not data.strip():
        problem, mend = "the file is empty", "export it again"
    elif data.startswith(GZIP_MAGIC):
        problem = "the file is compressed with gzip but its name does not say so"
        mend = "rename it to end in .csv.gz"
    elif data.startswith(UTF16_BOMS):
        problem = "the text is UTF-16"
        mend = "save it as 'CSV UTF-8' in the program that wrote it"
    elif b"\x00" in data:
        place = data.index(b"\x00")
        problem = "the file holds zero bytes: it is binary, or UTF-16 text"
        mend = "export it as CSV in UTF-8, or give it the extension of its real format"
    else:
        try:
            data.decode("utf-8")
        except UnicodeDecodeError as error:
            place = error.start
            problem = f"byte 0x{data[place]:02x} is not UTF-8 text "
            problem += "(Latin-1 or Windows-1252 text, or a binary file)"
            mend = "save it as UTF-8, or keep to plain ASCII letters"
        else:
            return None
    row = None if place is None else data.count(b"\n", 0, place) + 1
    return RecordError(path, problem, row=row, expected=EXPECTED_CSV, mend=mend)


def _split_header(text: bytes, path: Path) -> tuple[list[str], bytes]:
    """Returns the column names and the bytes below them, without blank lines at the end.

    Raises
    ------
    RecordError
        a wrong delimiter, no usable column names, no data rows, or an end within a number.
    """
    first_line, _, body = text.partition(b"\n")
    names = _header_names(first_line.decode("utf-8").rstrip("\r"), body, path)
    if not body.endswith((b"\n", b"\r")):
        _check_end(body, path, row=text.count(b"\n") + 1)
    body = body.rstrip(b"\r\n\t ")
    if not body:
        raise RecordError(
            path,
            "there is a header but no data",
            row=1,
            expected="data rows below the header",
            mend="export the record again, with its data",
        )
    return names, body


def _header_names(line: str, body: bytes, path: Path) -> list[str]:
    try:
        names = [name.strip() for name in next(csv.reader([line]), [])]
    except csv.Error as error:
        raise unreadable_line(path, 1, error) from None
    COLUMNS.check(len(names), path)
    if not any(names):
        raise RecordError(
            path, "the first row is blank", row=1, expected=EXPECTED_CSV, mend="remove that row"
        )
    if all(_is_number(name) for name in names):
        raise RecordError(
            path,
            "the first row holds numbers, not names",
            row=1,
            expected=EXPECTED_CSV,
            mend="add a header row such as time_s,command_v,position_m",
        )
    if any(delimiter in line for delimiter in ";\t|") or (len(names) == 1 and " " in names[0]):
        raise _wrong_delimiter(line, body, path)
    for position, name in enumerate(names, start=1):
        if not name:
            raise RecordError(
                path,
                f"column {position} of {len(names)} has no name",
                row=1,
                expected="a name for every column",
                mend="name the column, or remove the surplus comma",
            )
    repeated = [name for name, count in Counter(names).items() if count > 1]
    if repeated:
        raise RecordError(
            path,
            f"the column name occurs {names.count(repeated[0])} times",
            row=1,
            column=repeated[0],
            expected="every column name once",
            mend="rename or remove the repeated column",
        )
    return names


def _wrong_delimiter(line: str, body: bytes, path: Path) -> RecordError:
    delimiter = max(";\t| ", key=line.count)
    shown = {"\t": "tabs", " ": "spaces"}.get(delimiter, f"'{delimiter}'")
    problem = f"the columns are separated by {shown}"
    mend = "export it with commas between the columns"
    if b"," in body.partition(b"\n")[0]:
        problem += " and the numbers have a decimal comma"
        mend += " and a decimal point in the numbers"
    return RecordError(path, problem, row=1, expected=EXPECTED_CSV, mend=mend)


def _check_end(body: bytes, path: Path, *, row: int) -> None:
    """Checks that a last line without a line end does not stop within its last number.

    This shows only where the last column has a usual number of decimals in the rows before.
    """
    *before, last = (line.rpartition(b",")[2] for line in body.rsplit(b"\n", ROWS_OF_ONE_FORM + 1))
    above = [cell.decode() for cell in before[-ROWS_OF_ONE_FORM:]]
    if is_cut(above, last.decode(), "."):
        usual = len(above[-1].strip().partition(".")[2])
        raise RecordError(
            path,
            f"the file ends within the number '{last.decode().strip()}': the numbers above have "
            f"{usual} decimals",
            row=row,
            expected="a line end behind the last row",
            mend="copy or export the file again; if the number is whole, end the file with a line "
            "end",
        )


def _has_other_layout(text: Text) -> bool:
    """Whether a text is a table of numbers with another layout than that of a CSV record."""
    dialect = text.dialect
    if dialect is None:
        return False
    if has_results(text.content, dialect.delimiter):
        return True
    plain = dialect.delimiter == "," and dialect.decimal == "." and dialect.names_row == 1
    named = len(dialect.names) - (dialect.names[-1:] == ("",))
    plain &= len(dialect.names) == dialect.columns and named == dialect.cells
    if dialect.names_row == 0 and dialect.data_row == 2 and dialect.delimiter == ",":
        return False  # names, but not as many as columns: the checks of a record say what is wrong
    return bool(text.notes) or not plain or dialect.data_row != 2 or bool(dialect.dates)


def _is_number(text: str) -> bool:
    """Whether a cell is a number, "nan" included."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def read_text(data: bytes, path: Path) -> Log | Table:
    """Returns the table in a CSV file, and the log in any other text."""
    is_csv = path.name.lower().endswith((".csv", ".csv.gz"))
    return CsvTable(data, path) if is_csv else Text(data, path).log()


NOTES = ("txt.gz", "dat.gz", "txt", "dat", "asc", "log", "prn")
TEXT = Kind(read_text, ("csv.gz", "csv", "tsv.gz", "tsv", "tab", *NOTES), of_notes=NOTES)
