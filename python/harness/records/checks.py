# SPDX-License-Identifier: MIT
"""What the columns of a record and its time may be: finite numbers, and even steps between gaps."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..base.numbers import masked_count
from ..catalogue.channels import TIME
from .errors import RecordError

if TYPE_CHECKING:
    from .record import Record


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


MAX_JITTER = 0.01  # relative to dt; a record with more jitter does not count as uniform
GAP_FACTOR = 1.5  # a step longer than this many median steps is a gap
# A longer step than so many usual ones is a gap across which a log is not interpolated.
BRIDGED_STEPS = 4.0


class TimeError(RecordError):
    """The time column of a record is not uniform; another module may be able to resample it."""


@dataclass(frozen=True)
class Jitter:
    """Deviation of the time steps inside segments from the sampling time dt."""

    max_relative: float
    """Largest |step - dt| / dt."""
    rms_relative: float
    """Root mean square of (step - dt) / dt."""
    worst_row: int
    """Row at the end of the step with the largest deviation, counted as in `RecordError.row`."""


@dataclass(frozen=True)
class Gap:
    """A gap in the time of a record."""

    row: int
    """Row of the first sample after the gap, counted as in `RecordError.row`."""
    start_s: float
    """Time of the last sample before the gap, in seconds."""
    duration_s: float
    """Time between the two samples around the gap, in seconds."""


@dataclass(frozen=True)
class TimeBase:
    """Result of `analyse_time`: dt_s, jitter, gaps, and the segments as slices of samples."""

    dt_s: float
    jitter: Jitter
    gaps: tuple[Gap, ...]
    segments: tuple[slice, ...]


def analyse_time(time_s: npt.NDArray[np.float64], *, file: Path | str, first_row: int) -> TimeBase:
    """Checks the time column and splits the record at its gaps.

    A step is a gap if it is longer than 1.5 times the median step. dt_s is the mean of the other
    steps, and each of them must agree with dt_s within 1 %.

    Parameters
    ----------
    time_s
        time in seconds, shape (n,), n >= 2, finite.
    file
        name of the file in messages.
    first_row
        row number of the first sample in messages.

    Raises
    ------
    RecordError
        a time is repeated, time runs backwards, or the steps are uneven.
    """
    steps = np.diff(time_s)

    def refused(k: int, problem: str, expected: str, mend: str) -> TimeError:
        row = k + 1 + first_row
        return TimeError(file, problem, row=row, column=TIME, expected=expected, mend=mend)

    back = np.flatnonzero(steps <= 0.0)
    if back.size:
        time_before, time = (float(one) for one in time_s[back[0] : back[0] + 2])
        problem = f"time runs backwards, from {time_before:.9g} s to {time:.9g} s"
        mend = "sort the rows by time, or split the file where a new run starts"
        if time == time_before:
            problem = f"the time {time:.9g} s is the same as in the row before"
            mend = "remove the repeated rows, or write time with more digits"
        if back.size > 1:
            problem += f" ({back.size} such rows)"
        raise refused(int(back[0]), problem, "time that increases", mend)
    is_gap = steps > GAP_FACTOR * float(np.median(steps))
    regular = steps[~is_gap]
    dt_s = float(np.mean(regular))
    deviation = np.where(is_gap, 0.0, steps / dt_s - 1.0)

    worst = int(np.argmax(np.abs(deviation)))
    # Two neighbouring times are each rounded to half a unit in the last place. Their difference
    # therefore has a rounding error of up to one unit.
    rounding = float(np.spacing(np.max(np.abs(time_s)))) / dt_s
    uneven = np.flatnonzero(np.abs(deviation) > MAX_JITTER + rounding)
    if uneven.size:
        step = float(steps[uneven[0]])
        problem = f"uneven time: this step is {step:.6g} s, the mean step is {dt_s:.6g} s "
        problem += f"({100.0 * (step / dt_s - 1.0):+.1f} %)"
        mend = "resample the record to a uniform step"
        resolution = written_resolution(time_s)
        if resolution is not None and resolution > MAX_JITTER * dt_s:
            mend = (
                f"time is written in steps of {resolution:g} s, too coarse for samples "
                f"{dt_s:.3g} s apart: write it with more digits, or {mend}"
            )
        expected = f"steps equal within {100.0 * MAX_JITTER:g} %"
        raise refused(int(uneven[0]), problem, expected, mend)

    segment_ends = np.flatnonzero(is_gap) + 1
    edges = [0, *segment_ends.tolist(), time_s.size]
    return TimeBase(
        dt_s=dt_s,
        jitter=Jitter(
            max_relative=float(abs(deviation[worst])),
            rms_relative=float(np.sqrt(np.mean(deviation[~is_gap] ** 2))),
            worst_row=worst + 1 + first_row,
        ),
        gaps=tuple(
            Gap(int(k) + first_row, float(time_s[k - 1]), float(steps[k - 1])) for k in segment_ends
        ),
        segments=tuple(slice(a, b) for a, b in pairwise(edges)),
    )


def is_uniform(time_s: npt.NDArray[np.float64]) -> bool:
    """Whether `analyse_time` accepts these times."""
    try:
        analyse_time(time_s, file="", first_row=1)
    except TimeError:
        return False
    return True


def written_resolution(time_s: npt.NDArray[np.float64]) -> float | None:
    """Returns the coarsest step 10^-d s, d = 0..6, of which every time is a multiple, or None."""
    for digits in range(7):
        if np.allclose(np.round(time_s, digits), time_s, rtol=0.0, atol=10.0**-digits * 1e-6):
            return float(10.0**-digits)
    return None


def missing_rows(gap: Gap, dt_s: float) -> int:
    """Returns the number of rows that are missing in a gap."""
    return max(round(gap.duration_s / dt_s) - 1, 1)


def is_short(gap: Gap, dt_s: float) -> bool:
    """Whether so few rows are missing that a log is interpolated there."""
    return gap.duration_s <= (BRIDGED_STEPS + MAX_JITTER) * dt_s


def pieces_in_words(record: Record) -> str:
    """Returns one clause on the gaps of a record and the pieces that they leave.

    It begins as in "128 single rows are missing".
    """
    assert record.dt_s is not None
    dt_s = record.dt_s
    short = [gap for gap in record.gaps if is_short(gap, dt_s)]
    long = [gap for gap in record.gaps if not is_short(gap, dt_s)]
    said = []
    if short:
        rows = sum(missing_rows(gap, dt_s) for gap in short)
        if rows == len(short):
            said.append("1 single row is" if rows == 1 else f"{rows} single rows are")
        else:
            where = "1 place" if len(short) == 1 else f"{len(short)} places"
            said.append(f"{rows} rows at {where} are")
        said[0] += " missing"
    if long:
        longest = max(long, key=lambda gap: gap.duration_s)
        seconds = f"{longest.duration_s:.3g} s after {longest.start_s:.4g} s"
        said.append(
            f"there is a gap of {seconds}"
            if len(long) == 1
            else f"there are {len(long)} gaps, the longest of {seconds}"
        )
    return f"{' and '.join(said)}, so the record is in {len(record.segments)} pieces"


def mend_of_gaps(record: Record) -> str:
    """Returns what helps against the gaps of a record."""
    assert record.dt_s is not None
    if any(is_short(gap, record.dt_s) for gap in record.gaps):
        return (
            f"read it with --dt {record.dt_s:.6g}, which interpolates holes of up to "
            f"{round(BRIDGED_STEPS) - 1} rows"
        )
    return "find out why the logger left rows out, or give a part without a gap"


def gap_remarks(record: Record) -> tuple[str, ...]:
    """Returns a remark on a record with gaps that was read as it is; none of one without."""
    if not record.gaps:
        return ()
    return (
        f"{pieces_in_words(record)}; nothing is filled in, and a simulation starts anew in each. "
        f"To mend it: {mend_of_gaps(record)}",
    )
