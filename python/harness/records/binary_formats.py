# SPDX-License-Identifier: MIT
"""Columns from Parquet, MAT and NPZ files."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl
import scipy.io
import scipy.sparse

from ehsid.harness.records.errors import RecordError
from ehsid.harness.records.mat_elements import check_elements


class ParquetTable:
    """A Parquet file; missing cells become NaN."""

    first_row = 1

    def __init__(self, data: bytes, path: Path) -> None:
        self._path = path
        try:
            self._frame = pl.read_parquet(BytesIO(data))
        except (pl.exceptions.PolarsError, pl.exceptions.PanicException) as error:
            # PanicException: the reader takes some damaged sizes for sound ones.
            raise _damaged(path, "Parquet", error) from None
        self.names = self._frame.columns

    def read(self, wanted: Sequence[str]) -> dict[str, npt.NDArray[Any]]:
        """Columns `wanted`, floating where the file holds numbers.

        Raises
        ------
        RecordError
            a column that does not hold numbers.
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


class MatTable:
    """A MAT file of version 4 to 7; each variable is a column."""

    first_row = 1

    def __init__(self, data: bytes, path: Path) -> None:
        self._path = path
        try:
            check_elements(data)
            # Some versions of the stubs know paths only; the function takes any binary file.
            file: Any = BytesIO(data)
            with warnings.catch_warnings():
                # scipy 1.18 warns that sparse variables will be of another class. We refuse all.
                warnings.filterwarnings("ignore", ".*`spmatrix`", DeprecationWarning)
                content = scipy.io.loadmat(file)
        except NotImplementedError:
            raise RecordError(
                path,
                "this is a MAT file of version 7.3 (HDF5), which is not read",
                expected="a MAT file of version 4 to 7",
                mend="save it in MATLAB with save('name.mat', '-v7')",
            ) from None
        except Exception as error:  # the reader has no common exception for damaged files
            raise _damaged(path, "MAT", error) from None
        self._variables = {k: v for k, v in content.items() if not k.startswith("__")}
        self.names = list(self._variables)

    def read(self, wanted: Sequence[str]) -> dict[str, npt.NDArray[Any]]:
        """Variables `wanted` as they are in the file.

        Raises
        ------
        RecordError
            a sparse matrix.
        """
        return {name: self._dense(name) for name in wanted}

    def _dense(self, name: str) -> npt.NDArray[Any]:
        variable = self._variables[name]
        shape = variable.shape
        if scipy.sparse.issparse(variable):  # its size is what the file says, not what it holds
            raise RecordError(
                self._path,
                f"the values are a sparse matrix, {' x '.join(map(str, shape))}",
                column=name,
                expected="a vector, one value a sample",
                mend="store the signal with full(...)",
            )
        return np.asarray(variable)


class NpzTable:
    """A NumPy archive; each array is a column."""

    first_row = 1

    def __init__(self, data: bytes, path: Path) -> None:
        self._path = path
        try:
            archive = np.load(BytesIO(data), allow_pickle=False)
        except Exception as error:  # as above: zip, array header and array each have their own
            raise _damaged(path, "NPZ", error) from None
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise RecordError(
                path,
                "this is a single array, not an archive of named arrays",
                expected="an NPZ file",
                mend="write it with numpy.savez(path, time_s=..., command_v=...)",
            )
        self._archive = archive
        self.names = list(archive.files)

    def read(self, wanted: Sequence[str]) -> dict[str, npt.NDArray[Any]]:
        """Arrays `wanted` as they are in the file.

        Raises
        ------
        RecordError
            an array of Python objects, or a damaged one.
        """
        columns: dict[str, npt.NDArray[Any]] = {}
        for name in wanted:
            try:
                columns[name] = self._archive[name]
            except Exception as error:  # as above
                raise RecordError(
                    self._path,
                    f"the array cannot be read ({_first_line(error)})",
                    column=name,
                    expected="an array of numbers",
                    mend="convert it to float64 and write the file again",
                ) from None
        return columns


def _first_line(error: BaseException) -> str:
    return (str(error).strip() or type(error).__name__).splitlines()[0].rstrip(".")


def _damaged(path: Path, kind: str, error: BaseException) -> RecordError:
    return RecordError(
        path,
        f"this is not a readable {kind} file ({_first_line(error)})",
        expected=f"a {kind} file, as its name says",
        mend="export it again, or give it the extension of its real format",
    )
