# SPDX-License-Identifier: MIT
"""Reads Parquet files: columns of numbers, a missing cell as NaN, and typed dates."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from ...base.numbers import FloatArray
from ..errors import BYTES, COLUMNS, SAMPLES, RecordError, damage_named
from ..logs.cells import from_datetimes
from ..logs.log import Kind, Log, Series, Table

if TYPE_CHECKING:
    import polars as pl

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
        usable = [one for one, dtype in self._schema.items() if _is_usable(dtype)]
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
            return from_datetimes(column) if is_time else _as_float(column)

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


def _is_usable(dtype: pl.DataType) -> bool:
    return dtype.is_numeric() or dtype.is_temporal()


def _as_float(column: pl.Series) -> FloatArray:
    import polars as pl

    return column.cast(pl.Float64).to_numpy()


KIND = Kind(ParquetTable, ("parquet",))
