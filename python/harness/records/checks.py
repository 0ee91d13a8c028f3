# SPDX-License-Identifier: MIT
"""What a column of a record may hold: finite numbers, and none that stands for no value.

Numbers such as -9999 and 9.9E37 stand for no value, and are told apart from true extremes. A true
extreme is reached: a position at its end stop and a sensor at its limit have neighbours among the
other values. A number that stands for no value lies alone, far outside of all others. A command may
step to its full scale, and so may a signal that is no channel: of them only numbers are taken for
no value that no full scale has.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.numbers import FloatArray, masked_count
from ..catalogue.channels import CHANNELS, COMMAND, TIME
from .errors import RecordError

MIN_SAMPLES = 2
# No quantity in any unit is so large, and the square of a larger number overflows in float64.
LARGEST = 1e100
# No quantity of a machine is so large; instruments say 9.9E37, and netCDF 9.96921e36.
NO_QUANTITY = 1e20
NINES = frozenset(sign * (10.0**digits - 1.0) for digits in range(3, 11) for sign in (1, -1))
# The ends of integers, and what netCDF puts beside them.
FULL = frozenset(
    float(number)
    for bits in (15, 16, 31, 32, 63, 64)
    for number in (2**bits - 1, -(2**bits), 1 - 2**bits)
)
# Distance to the nearest other value, in spans of all others: of a number that is known to stand
# for no value, of any other, and of any in a signal that may be switched.
FAR_KNOWN, FAR, FAR_SWITCHED = 1.0, 5.0, 100.0
# With fewer other values there is no telling what lies outside of them.
LEAST_VALUES = 20
# So many different values has a signal that is measured, and not switched between levels.
LEAST_DIFFERENT = 10
# A larger command is none in V, mV, mA or percent; it may be in counts.
LARGEST_COMMAND = 20_000.0
SWITCHED = (COMMAND, "spool")


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


@dataclass(frozen=True)
class Sentinels:
    """The numbers in the values of a signal that stand for no value, and the span of the others."""

    numbers: tuple[float, ...]
    lowest: float
    highest: float

    def without(self, values: FloatArray) -> FloatArray:
        """Returns the values with NaN in their place."""
        return np.where(np.isin(values, self.numbers), np.nan, values)

    def remark(self, name: str, values: FloatArray) -> str:
        """Returns a sentence on what is taken for no value."""
        rows = int(np.count_nonzero(np.isin(values, self.numbers)))
        numbers = " or ".join(f"{number:.9g}" for number in self.numbers)
        return (
            f"'{name}' is {numbers} in {rows} of {values.size} rows, far outside of its other "
            f"values ({self.lowest:.4g} to {self.highest:.4g}): taken as no value"
        )


def sentinels_of(values: FloatArray, channel: str) -> Sentinels | None:
    """Returns what in the values of a channel, shape (n,), stands for no value; None if nothing."""
    left = values[np.isfinite(values)]
    numbers: list[float] = []
    while left.size:
        # Both ends at once, as each would hide the other.
        ends = [float(left.min()), float(left.max())]
        huge = [end for end in ends if abs(end) >= NO_QUANTITY]
        others = left[~np.isin(left, huge or ends)]
        found = [end for end in huge or ends if _is_none(end, left, others, channel)]
        if not found:
            break
        numbers += found
        left = left[~np.isin(left, found)]
    if not numbers or not left.size:
        return None
    return Sentinels(tuple(numbers), float(left.min()), float(left.max()))


def has_sentinels(columns: Mapping[str, FloatArray]) -> bool:
    """Whether a column, named by its channel, has numbers that stand for no value."""
    return any(sentinels_of(one, name) for name, one in columns.items() if name != TIME)


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


def _is_none(number: float, left: FloatArray, others: FloatArray, channel: str) -> bool:
    if others.size < LEAST_VALUES:
        return False
    largest = float(np.max(np.abs(others)))
    distance, span = float(np.min(np.abs(others - number))), float(np.ptp(others))
    repeats = int(np.count_nonzero(left == number)) > 1
    if abs(number) >= NO_QUANTITY:
        return largest < NO_QUANTITY and (repeats or abs(number) < 1e40)
    nines = number in NINES
    if channel in SWITCHED or channel not in CHANNELS:
        # No full scale is -9999, but that of a pulse width may be 999.
        far = FAR if nines and number < -1000.0 else FAR_SWITCHED
        if distance <= far * span or not _differ(others, 2 if nines else LEAST_DIFFERENT):
            return False
        # A command in counts is whole, and may step to the end of its integer.
        counts = bool((others == np.round(others)).all())
        return nines or (
            repeats
            and not counts
            and abs(number) > LARGEST_COMMAND
            and abs(number) >= FAR * largest
        )
    if nines or number in FULL:
        return distance > FAR_KNOWN * span and distance > 0.0
    return (
        repeats
        and distance > FAR * span
        and abs(number) >= FAR * largest
        and _differ(others, LEAST_DIFFERENT)
    )


def _differ(values: FloatArray, count: int) -> bool:
    return bool(np.unique(values).size >= count)
