# SPDX-License-Identifier: MIT
"""Checks of the columns of a record, the same for every file format."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.arrays import masked_count
from .errors import RecordError

MIN_SAMPLES = 2
# No quantity in any unit is so large, and the square of a larger number overflows in float64.
LARGEST = 1e100


def check_columns(
    columns: Mapping[str, npt.ArrayLike], *, file: Path | str, first_row: int
) -> dict[str, npt.NDArray[np.float64]]:
    """Returns copies of the columns as float64 arrays of shape (n,), all finite and equally long.

    Raises
    ------
    RecordError
        see `make_record`.
    """
    arrays = {name: _as_numbers(name, values, file) for name, values in columns.items()}
    _check_lengths(arrays, file)
    for name, array in arrays.items():
        _check_finite(name, array, file, first_row)
        _check_size(name, array, file, first_row)
    return arrays


def without_useless(
    columns: Mapping[str, npt.NDArray[Any]], needed: Collection[str], first_row: int
) -> tuple[dict[str, npt.NDArray[Any]], list[str]]:
    """Returns the columns without those that nobody needs and no record can hold, and remarks.

    These have an infinite number, or no number in most of their rows, as a small table beside the
    log has. In a column that is needed either is an error.
    """
    kept: dict[str, npt.NDArray[Any]] = {}
    remarks: list[str] = []
    for name, values in columns.items():
        array = values if values.dtype.kind == "f" and values.ndim == 1 else np.zeros(1)
        infinite, empty = np.isinf(array), int(np.count_nonzero(np.isnan(array)))
        if name in needed or (not infinite.any() and 2 * empty <= array.size):
            kept[name] = values
        elif infinite.any():
            row = int(np.argmax(infinite)) + first_row
            remarks.append(f"'{name}' is left out: row {row} is infinite")
        else:
            remarks.append(f"'{name}' is left out: it has no value in {empty} of {array.size} rows")
    return kept, remarks


def _as_numbers(name: str, values: npt.ArrayLike, file: Path | str) -> npt.NDArray[np.float64]:
    masked = masked_count(values)
    if masked:
        raise RecordError(
            file,
            f"{masked} values are masked",
            column=name,
            expected="a number in every row",
            mend="remove these rows (the hole in time then splits the record), or fill in the "
            "values",
        )
    array = np.asarray(values)
    if array.ndim == 2 and (1 in array.shape or array.size == 0):
        array = array.reshape(-1)  # row and column vectors of MATLAB, and its empty 0 x 0 array
    if array.ndim != 1:
        shape = " x ".join(str(size) for size in array.shape) or "a single number"
        raise RecordError(
            file,
            f"the values are not one column: {shape}",
            column=name,
            expected="a vector, one value a sample",
            mend="store each signal under its own name, or name the columns to use",
        )
    if array.dtype.kind not in "fiub":
        raise RecordError(
            file,
            f"the values are of type {array.dtype.name}",
            column=name,
            expected="real numbers",
            mend="convert the column to numbers, or name the columns to use",
        )
    return np.array(array, dtype=np.float64)


def _check_lengths(arrays: Mapping[str, npt.NDArray[np.float64]], file: Path | str) -> None:
    if not arrays:
        raise RecordError(
            file, "there are no columns", expected="named columns", mend="export the record again"
        )
    sizes = {name: array.size for name, array in arrays.items()}
    longest = max(sizes, key=lambda name: sizes[name])
    shortest = min(sizes, key=lambda name: sizes[name])
    if sizes[longest] != sizes[shortest]:
        raise RecordError(
            file,
            f"it has {sizes[shortest]} samples, '{longest}' has {sizes[longest]}",
            column=shortest,
            expected="columns of equal length",
            mend="cut or resample the signals to one common time base, or name the columns to use",
        )
    if sizes[longest] < MIN_SAMPLES:
        count_text = "no samples" if sizes[longest] == 0 else "one sample only"
        raise RecordError(
            file,
            f"there are names but {count_text}",
            expected=f"at least {MIN_SAMPLES} samples",
            mend="export the record again, with its data",
        )


def _check_finite(
    name: str, array: npt.NDArray[np.float64], file: Path | str, first_row: int
) -> None:
    bad = ~np.isfinite(array)
    if not bad.any():
        return
    first = int(np.argmax(bad))
    kind = np.isnan(array) if np.isnan(array[first]) else np.isinf(array)
    other = np.flatnonzero(~kind[first:])
    run = int(other[0]) if other.size else array.size - first
    state = "empty or NaN" if np.isnan(array[first]) else "infinite"
    rows = (
        f"row {first + first_row} is {state}"
        if run == 1
        else f"rows {first + first_row} to {first + run - 1 + first_row} are {state} ({run} rows)"
    )
    others = int(bad.sum()) - run
    mend = "remove these rows (the hole in time then splits the record), or fill in the values"
    if 2 * int(bad.sum()) > array.size:
        mend = "export the column with a value in every row, or name the columns to use without it"
    if others:
        rows += f", and {others} more row{'s' * (others > 1)} later"
    raise RecordError(
        file,
        rows,
        row=first + first_row,
        column=name,
        expected="a finite number in every row",
        mend=mend,
    )


def _check_size(
    name: str, array: npt.NDArray[np.float64], file: Path | str, first_row: int
) -> None:
    bad = np.flatnonzero(np.abs(array) > LARGEST)
    if bad.size:
        raise RecordError(
            file,
            f"the number {array[bad[0]]:.4g} is too large to compute with"
            + (f" ({bad.size} such rows)" if bad.size > 1 else ""),
            row=int(bad[0]) + first_row,
            column=name,
            expected=f"numbers up to {LARGEST:g}",
            mend="correct the cell, or the unit of the column",
        )
