# SPDX-License-Identifier: MIT
"""Reads columns from Parquet files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy.typing as npt
import polars as pl

from .errors import RecordError, damaged
from .limits import BYTES, COLUMNS, SAMPLES

FLOAT64_BYTES = 8


class ParquetTable:
    """A Parquet file; missing cells become NaN."""

    first_row = 1

    def __init__(self, data: bytes, path: Path) -> None:
        self._path = path
        self._data = data
        with self._damage_named():
            self.schema = pl.read_parquet_schema(BytesIO(data))
            rows = pl.scan_parquet(BytesIO(data)).select(pl.len()).collect().item()
        self.names = list(self.schema)
        self.rows = int(rows)
        SAMPLES.check(self.rows, path)
        COLUMNS.check(len(self.names), path)

    def text_names(self) -> list[str]:
        """Names of the columns that hold text."""
        return [name for name, dtype in self.schema.items() if dtype == pl.String]

    def read(self, wanted: Sequence[str]) -> dict[str, npt.NDArray[Any]]:
        """Returns the columns `wanted` as float64 arrays.

        Raises
        ------
        RecordError
            a column does not hold numbers or Boolean values, or is damaged, or all together are
            beyond the limit.
        """
        for name in wanted:
            self._check_type(name)
        BYTES.check(self.rows * len(wanted) * FLOAT64_BYTES, self._path)
        with self._damage_named():
            frame = pl.read_parquet(BytesIO(self._data), columns=list(wanted))
        return {name: frame[name].cast(pl.Float64).to_numpy() for name in wanted}

    def _check_type(self, name: str) -> None:
        dtype = self.schema[name]
        if not dtype.is_numeric() and dtype != pl.Boolean:
            raise RecordError(
                self._path,
                f"the values are of type {dtype}",
                column=name,
                expected="real numbers (time in seconds as a number)",
                mend="convert the column to numbers, or name the columns to use",
            )

    @contextmanager
    def _damage_named(self) -> Iterator[None]:
        try:
            yield
        except (pl.exceptions.PolarsError, pl.exceptions.PanicException) as error:
            # The reader does not detect some damaged sizes and then raises PanicException.
            raise damaged(self._path, "Parquet", error) from None
