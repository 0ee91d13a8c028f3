# SPDX-License-Identifier: MIT
"""Time base of a record: sampling time, jitter, gaps, in words too, and segments between gaps."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from .errors import RecordError

if TYPE_CHECKING:
    from .record import Record

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


def analyse_time(
    time_s: npt.NDArray[np.float64], *, file: Path | str, first_row: int, column: str = "time_s"
) -> TimeBase:
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
    column
        name of the time column in messages.

    Raises
    ------
    RecordError
        a time is repeated, time runs backwards, or the steps are uneven.
    """
    steps = np.diff(time_s)
    _check_increasing(time_s, steps, file, first_row, column)

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
        raise _uneven(time_s, int(uneven[0]), dt_s, file, first_row, column)

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


def _check_increasing(
    time_s: npt.NDArray[np.float64],
    steps: npt.NDArray[np.float64],
    file: Path | str,
    first_row: int,
    column: str,
) -> None:
    not_increasing = np.flatnonzero(steps <= 0.0)
    if not_increasing.size == 0:
        return
    k = int(not_increasing[0])
    row = k + 1 + first_row
    time, time_before = float(time_s[k + 1]), float(time_s[k])
    if steps[k] == 0.0:
        problem = f"the time {time:.9g} s is the same as in the row before"
        mend = "remove the repeated rows, or write time with more digits"
    else:
        problem = f"time runs backwards, from {time_before:.9g} s to {time:.9g} s"
        mend = "sort the rows by time, or split the file where a new run starts"
    if not_increasing.size > 1:
        problem += f" ({not_increasing.size} such rows)"
    raise TimeError(
        file, problem, row=row, column=column, expected="time that increases", mend=mend
    )


def _uneven(
    time_s: npt.NDArray[np.float64],
    k: int,
    dt_s: float,
    file: Path | str,
    first_row: int,
    column: str,
) -> TimeError:
    step = float(time_s[k + 1] - time_s[k])
    mend = "resample the record to a uniform step"
    resolution = written_resolution(time_s)
    if resolution is not None and resolution > MAX_JITTER * dt_s:
        mend = (
            f"time is written in steps of {resolution:g} s, too coarse for samples "
            f"{dt_s:.3g} s apart: write it with more digits, or {mend}"
        )
    return TimeError(
        file,
        f"uneven time: this step is {step:.6g} s, the mean step is {dt_s:.6g} s "
        f"({100.0 * (step / dt_s - 1.0):+.1f} %)",
        row=k + 1 + first_row,
        column=column,
        expected=f"steps equal within {100.0 * MAX_JITTER:g} %",
        mend=mend,
    )


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
