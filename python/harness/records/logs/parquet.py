# SPDX-License-Identifier: MIT
"""Reads logs from Parquet files, with typed dates."""

from __future__ import annotations

from functools import cache
from io import BytesIO
from pathlib import Path

import polars as pl

from ...base.arrays import FloatArray
from ..errors import damaged
from ..limits import BYTES
from ..parquet_format import FLOAT64_BYTES, ParquetTable
from .dates import from_datetimes
from .log import Log, Series


def read(data: bytes, path: Path) -> Log:
    """Returns the columns of numbers and of dates of a Parquet file as a log.

    Raises
    ------
    RecordError
        the file is damaged or beyond a limit.
    """
    table = ParquetTable(data, path)
    schema = table.schema
    usable = [name for name in table.names if schema[name].is_numeric() or _is_time(schema[name])]
    BYTES.check(table.rows * len(usable) * FLOAT64_BYTES, path)
    skipped = tuple(name for name in table.names if name not in usable)

    def series(name: str) -> Series:
        @cache
        def values() -> FloatArray:
            try:
                column = pl.read_parquet(BytesIO(data), columns=[name])[name]
            except (pl.exceptions.PolarsError, pl.exceptions.PanicException) as error:
                raise damaged(path, "Parquet", error) from None
            if _is_time(schema[name]):
                return from_datetimes(column)
            return column.cast(pl.Float64).fill_null(float("nan")).to_numpy()

        dtype = schema[name]
        is_time = _is_time(dtype)
        local = isinstance(dtype, pl.Datetime) and dtype.time_zone is None
        return Series(
            name, table.rows, values, "s" if is_time else None, is_time=is_time, local=local
        )

    return Log("Parquet", tuple(series(name) for name in usable), texts=skipped)


def _is_time(dtype: pl.DataType) -> bool:
    return dtype.is_temporal()
