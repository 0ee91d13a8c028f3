# SPDX-License-Identifier: MIT
"""Reads columns from Parquet files."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy.typing as npt
import polars as pl

from ehsid.harness.records.errors import RecordError, damaged


class ParquetTable:
    """A Parquet file; missing cells become NaN."""

    first_row = 1

    def __init__(self, data: bytes, path: Path) -> None:
        self._path = path
        try:
            self._frame = pl.read_parquet(BytesIO(data))
        except (pl.exceptions.PolarsError, pl.exceptions.PanicException) as error:
            # The reader does not detect some damaged sizes and then raises PanicException.
            raise damaged(path, "Parquet", error) from None
        self.names = self._frame.columns

    def read(self, wanted: Sequence[str]) -> dict[str, npt.NDArray[Any]]:
        """Returns the columns `wanted` as float64 arrays.

        Raises
        ------
        RecordError
            a column does not hold numbers or Boolean values.
        """
        return {name: self._numbers(self._frame[name]) for name in wanted}

    def _numbers(self, series: pl.Series) -> npt.NDArray[Any]:
        if series.dtype.is_numeric() or series.dtype == pl.Boolean:
            return series.cast(pl.Float64).to_numpy()
        raise RecordError(
            self._path,
            f"the values are of type {series.dtype}",
            column=series.name,
            expected="real numbers (time in seconds as a number)",
            mend="convert the column to numbers, or name the columns to use",
        )
