# SPDX-License-Identifier: MIT
"""Brings signals with any clocks to one uniform time.

A signal is interpolated between its samples by monotone cubics (PCHIP), which stay between
neighbouring samples and so invent no content: the error is at most 3/8 h^2 max|x''| for samples at
most h apart (linear interpolation h^2/8, and the cubic leaves the line by at most h^2/4, because
its slopes lie between those of neighbouring chords). Where the rate becomes lower, a zero-phase FIR
filter (`scipy.signal.resample_poly`, Kaiser window) first removes what the new rate cannot carry.

The command acts from its sample to the next one, so its new value is the mean of what acted during
the new step. This keeps its integral, and needs no other filter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from ..base.numbers import FloatArray
from .checks import BRIDGED_STEPS, MAX_JITTER, written_resolution
from .errors import SAMPLES, RecordError

# A step beyond this many usual ones lacks at least one sample.
MISSING_STEPS = 1.5
# Rows of a stretch whose mean step is taken.
STRETCH = 32
# A new sampling time with few digits may differ by this share from the old one.
NEAR_STEP = 0.003
# From this ratio of the new sampling time to the old one on, the signal is filtered.
FILTER_RATIO = 1.2
# Share of the new samples that may come out of holes; beyond it the record would be invented.
MOST_BRIDGED = 0.3
# Share of the rows that may be dropped as repeated, or sorted.
MOST_REPAIRED = 0.05
# With fewer rows rounded times cannot be told from uneven ones.
LEAST_COARSE = 10
# Largest step back in usual steps that sorting mends; a larger one is a second run.
MOST_BACK_STEPS = 5.0
# Relative difference of sampling times that counts as equal.
EQUAL = 1e-3


Rows = np.ndarray[tuple[int], np.dtype[np.intp]]


@dataclass(frozen=True)
class Timed:
    """A signal and its times in seconds, both of shape (n,); `held` until the next sample."""

    time_s: FloatArray
    values: FloatArray
    held: bool = False


def usual_step(time_s: FloatArray) -> float:
    """Returns the mean of the steps that lack no row.

    Where jitter makes short and long steps alike, long ones are no holes: then it is the median of
    the mean steps of stretches, of which few have a hole.
    """
    steps = np.diff(time_s)
    median = float(np.median(steps))
    long, short = steps > MISSING_STEPS * median, steps < (2.0 - MISSING_STEPS) * median
    if 2 * np.count_nonzero(short) < np.count_nonzero(long) or not long.any():
        return float(np.mean(steps[~long]))
    rows = min(STRETCH, steps.size)
    return float(np.median(time_s[rows:] - time_s[:-rows])) / rows


def rounded(step: float) -> float:
    """Returns the number with the fewest digits near a step, such as 0.002 for 0.0020003."""
    found = (float(f"{step:.{digits}g}") for digits in range(1, 17))
    return next(number for number in found if abs(number / step - 1.0) <= NEAR_STEP)


def missing_rows(time_s: FloatArray, step: float) -> Rows:
    """Returns how many rows are to be put between each row and the next one of an even time.

    Shape (n - 1,): 1 to 3 where a step is two to four usual ones, 0 where it is one, or longer.
    -1 stands for a step between them: what lies behind it is not on the even time before it.
    """
    steps = np.diff(time_s) / step
    whole = np.round(steps)
    rounding = float(np.spacing(np.max(np.abs(time_s)))) / step
    off = np.abs(steps - whole) > MAX_JITTER + rounding
    hole = (steps > MISSING_STEPS) & (steps <= BRIDGED_STEPS + MAX_JITTER + rounding)
    rows = np.where(hole, np.where(off, 0.0, whole) - 1.0, 0.0)
    return np.asarray(rows, dtype=np.intp)


def with_rows(signals: Mapping[str, Timed], rows: Rows) -> dict[str, Timed]:
    """Returns signals on one even time with the missing rows; the others keep their bits.

    `rows` are those of `missing_rows`, without -1. A held signal keeps its value there, the others
    are interpolated within the part between two gaps.
    """
    first = next(iter(signals.values())).time_s
    before = np.repeat(np.arange(rows.size), rows)
    # The k-th row of a hole lies k of its steps behind the row before the hole.
    count = np.arange(before.size) - np.repeat(np.cumsum(rows) - rows, rows) + 1
    share = count / (rows[before] + 1)
    new_s = first[before] + share * (first[before + 1] - first[before])
    step = usual_step(first)
    edges = [0, *(np.flatnonzero((np.diff(first) > MISSING_STEPS * step) & (rows == 0)) + 1)]
    filled = {}
    for name, one in signals.items():
        new = one.values[before].copy()
        for a, b in pairwise([*edges, first.size]):
            inside = (before >= a) & (before < b)
            if not one.held and inside.any():
                part = Timed(one.time_s[a:b], one.values[a:b])
                new[inside] = _interpolated(part, new_s[inside])
        filled[name] = Timed(
            np.insert(one.time_s, before + 1, new_s),
            np.insert(one.values, before + 1, new),
            one.held,
        )
    return filled


def repaired(time_s: FloatArray, remarks: list[str]) -> tuple[FloatArray, Rows] | None:
    """Returns increasing times and the rows that they belong to; None where they are no clock.

    Times that are written with too few digits become even; few repeated rows are dropped, and few
    rows that came late are sorted.
    """
    rows = np.arange(time_s.size)
    steps = np.diff(time_s)
    even = _if_coarse(time_s, steps) if (steps >= 0.0).all() else None
    if even is not None:
        remarks.append(
            f"time is written in steps of {written_resolution(time_s):.4g} s, too coarse for the "
            f"samples: they are taken as even, {float(even[1] - even[0]):.6g} s apart"
        )
        return even, rows
    if (steps > 0.0).all():
        return time_s, rows
    backwards = int(np.count_nonzero(steps < 0.0))
    if backwards:
        usual = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
        if backwards > MOST_REPAIRED * time_s.size or float(-steps.min()) > MOST_BACK_STEPS * usual:
            return None
        rows = np.argsort(time_s, kind="stable")
        remarks.append(f"{backwards} rows came after later ones: sorted by time")
    sorted_s = time_s[rows]
    keep = np.concatenate([[True], np.diff(sorted_s) > 0.0])
    dropped = int(np.count_nonzero(~keep))
    if dropped > MOST_REPAIRED * time_s.size:
        return None
    if dropped:
        remarks.append(f"{dropped} rows repeat the time of the row before: left out")
    return sorted_s[keep], rows[keep]


def _if_coarse(time_s: FloatArray, steps: FloatArray) -> FloatArray | None:
    """Returns the even times that were rounded to `time_s`; None if they were not even."""
    resolution = written_resolution(time_s)
    if time_s.size < LEAST_COARSE or resolution is None or time_s[-1] <= time_s[0]:
        return None
    median = float(np.median(steps))
    if resolution <= MAX_JITTER * float(np.mean(steps)):
        return None  # fine enough: what is uneven was uneven
    if (steps > 0.0).all():
        rows = steps / median
        if np.allclose(rows, np.round(rows), atol=1e-3):
            return None  # an even clock, perhaps with rows missing
    k = np.arange(time_s.size, dtype=np.float64) - 0.5 * (time_s.size - 1)
    slope = float(np.polyfit(k, time_s - time_s.mean(), 1)[0])
    for step in (rounded(slope), slope):
        # Rounded, or cut off: in both cases the errors of even samples spread over one resolution.
        error = time_s - step * k
        if np.ptp(error) <= 1.01 * resolution:
            return np.asarray(0.5 * (error.min() + error.max()) + step * k, dtype=np.float64)
    return None


class Grid:
    """A uniform time, of which a part of the points may be left out."""

    def __init__(self, start_s: float, end_s: float, dt_s: float, path: Path) -> None:
        points = (end_s - start_s) / dt_s
        SAMPLES.check(int(min(points, 1e18)) + 1, path)
        self.dt_s = dt_s
        self.time_s: FloatArray = start_s + dt_s * np.arange(
            math.floor(points + 1e-6) + 1, dtype=np.float64
        )

    def sample(self, signal: Timed) -> tuple[FloatArray, int]:
        """Returns the signal on the grid, NaN in its gaps, and the number of points out of holes.

        A hole lacks samples but is short enough to be bridged.
        """
        time_s, values = signal.time_s, signal.values
        step = usual_step(time_s)
        steps = np.diff(time_s)
        longest = BRIDGED_STEPS * max(step, self.dt_s)
        edges = [0, *(np.flatnonzero(steps > longest) + 1).tolist(), time_s.size]
        made = np.full(self.time_s.size, np.nan)
        for a, b in pairwise(edges):
            if b - a >= 2:
                self._fill(made, Timed(time_s[a:b], values[a:b], signal.held), step)
        holes = np.flatnonzero((steps > MISSING_STEPS * max(step, self.dt_s)) & (steps <= longest))
        inside = np.searchsorted(self.time_s, time_s[holes + 1]) - np.searchsorted(
            self.time_s, time_s[holes], side="right"
        )
        return made, int(np.maximum(inside, 0).sum())

    def _fill(self, made: FloatArray, part: Timed, step: float) -> None:
        slack = 1e-6 * self.dt_s
        first = int(np.searchsorted(self.time_s, part.time_s[0] - slack))
        last = int(np.searchsorted(self.time_s, part.time_s[-1] + slack, side="right"))
        if last <= first:
            return
        points = self.time_s[first:last]
        if part.held:
            made[first:last] = _held_mean(part, points, self.dt_s, step)
            return
        ratio = self.dt_s / step
        if ratio < FILTER_RATIO:
            made[first:last] = _interpolated(part, points)
            return
        from scipy.signal import resample_poly

        fine = math.ceil(ratio - 1e-6)
        count = (points.size - 1) * fine + 1
        between: FloatArray = points[0] + (self.dt_s / fine) * np.arange(count, dtype=np.float64)
        made[first:last] = resample_poly(_interpolated(part, between), 1, fine, padtype="line")


def _interpolated(part: Timed, points: FloatArray) -> FloatArray:
    from scipy.interpolate import PchipInterpolator

    inside = np.clip(points, part.time_s[0], part.time_s[-1])
    return np.asarray(PchipInterpolator(part.time_s, part.values)(inside), dtype=np.float64)


def _held_mean(part: Timed, points: FloatArray, dt_s: float, step: float) -> FloatArray:
    """Returns the mean over [t, t + dt) of a signal that holds each value until the next sample."""
    edges = np.append(part.time_s, part.time_s[-1] + max(step, dt_s))
    # The mean is subtracted so that the running integral stays small beside its differences.
    offset = float(np.mean(part.values))
    integral = np.concatenate([[0.0], np.cumsum((part.values - offset) * np.diff(edges))])
    inside = np.clip(points, edges[0], edges[-1])
    ends = np.clip(points + dt_s, edges[0], edges[-1])
    length = np.maximum(ends - inside, np.finfo(float).tiny)
    gained = np.interp(ends, edges, integral) - np.interp(inside, edges, integral)
    return np.asarray(offset + gained / length, dtype=np.float64)


def check_bridged(path: Path, bridged: int, points: int, dt_s: float) -> None:
    """Refuses a record too many of whose new samples would be made up."""
    if bridged > MOST_BRIDGED * points:
        raise RecordError(
            path,
            f"time is too irregular: of {points} samples every {dt_s:.4g} s, {bridged} would lie "
            "in holes between rows",
            expected="rows at a nearly even rate",
            mend=f"resample to a longer step, such as --dt {4.0 * dt_s:.2g}, or log at a fixed "
            "rate",
        )
