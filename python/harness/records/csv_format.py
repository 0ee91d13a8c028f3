# SPDX-License-Identifier: MIT
"""Reads numbers from CSV with a fast reader, or with a slower one that finds the faulty row."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO
from pathlib import Path

import numpy as np
import numpy.typing as npt
import polars as pl

from .csv_text import is_number, plain_number_mend, split_header, unreadable_line
from .errors import RecordError

FIRST_DATA_ROW = 2  # row 1 is the header
HEAD_ROWS = 100  # rows that tell whether a column holds text


class CsvTable:
    """A CSV file with a valid header; only the requested columns are parsed as numbers."""

    first_row = FIRST_DATA_ROW

    def __init__(self, data: bytes, path: Path) -> None:
        self._path = path
        self.names, self._body = split_header(data, path)

    def text_names(self) -> list[str]:
        """Names of the columns whose first cells hold text, and not one of them a number.

        Rows that cannot be divided into cells do not count: `read` says what is wrong with them.
        """
        head = self._body.split(b"\n", HEAD_ROWS)[:HEAD_ROWS]
        rows = csv.reader(line.decode("utf-8") for line in head)
        filled, with_numbers = set[str](), set[str]()
        try:
            for cells in rows:
                if len(cells) != len(self.names):
                    continue
                for name, cell in zip(self.names, cells, strict=True):
                    if cell.strip():
                        filled.add(name)
                        with_numbers |= {name} if is_number(cell) else set()
        except csv.Error:
            return []
        return [name for name in self.names if name in filled - with_numbers]

    def read(self, wanted: Sequence[str]) -> dict[str, npt.NDArray[np.float64]]:
        """Returns the columns `wanted` as float64 arrays; an empty cell becomes NaN.

        Raises
        ------
        RecordError
            a cell is not a number, or a row has too many or too few cells.
        """
        # All columns are parsed, the other ones as text, so that surplus cells are always detected.
        schema: dict[str, type[pl.DataType]] = {
            name: pl.Float64 if name in wanted else pl.String for name in self.names
        }
        try:
            frame = pl.read_csv(self._body, has_header=False, schema=schema)
        except pl.exceptions.PolarsError:
            return self._read_carefully(wanted)
        if any(frame[name].null_count() for name in self.names):
            # There is an empty cell, or a row that ends too early. The fast reader does not tell
            # these two cases apart.
            return self._read_carefully(wanted)
        return {name: frame[name].to_numpy() for name in wanted}

    def _read_carefully(self, wanted: Sequence[str]) -> dict[str, npt.NDArray[np.float64]]:
        positions = [(name, self.names.index(name)) for name in wanted]
        values: dict[str, list[float]] = {name: [] for name in wanted}
        reader = csv.reader(StringIO(self._body.decode("utf-8"), newline=""))
        row = FIRST_DATA_ROW
        try:
            for cells in reader:
                if len(cells) != len(self.names):
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
        shown = text if len(text) <= 40 else text[:37] + "..."
        mend = "correct the cell, or name the columns to use"
        if not text.isascii():
            mend = "write the number with the digits 0 to 9 and a decimal point"
        elif text.replace(",", ".", 1).lstrip("+-").replace(".", "", 1).isdigit():
            mend = "write the number with a decimal point"
        mend = plain_number_mend(text) or mend
        raise RecordError(
            self._path,
            f"the text '{shown}' is not a number",
            row=row,
            column=column,
            expected="a number such as 0.125 or 1.2e-3",
            mend=mend,
        )

    def _ragged(self, row: int, cells: list[str]) -> RecordError:
        if not any(cell.strip() for cell in cells):
            problem, mend = "the row is blank", "remove the row"
        else:
            cell_count = f"{len(cells)} cell" + ("s" if len(cells) != 1 else "")
            problem = f"the row has {cell_count}, the header names {len(self.names)} columns"
            mend = "correct the row; if it is the last one, the file was cut short"
            if len(cells) == 2 * len(self.names):
                mend = "if the numbers have a decimal comma, export them with a decimal point"
            elif any(cell.count('"') % 2 for cell in cells) or "\n" in "".join(cells):
                mend = "look for a quotation mark that is not closed"
        return RecordError(
            self._path, problem, row=row, expected="one cell for every column", mend=mend
        )
