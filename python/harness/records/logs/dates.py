# SPDX-License-Identifier: MIT
"""Dates and times of day as text, turned into seconds since the first row."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt
import polars as pl

from ...base.arrays import FloatArray

DAY_S = 86_400.0
TRIED_ROWS = 50
SECONDS = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "d": DAY_S}

_DAYS = ("%Y-%m-%d", "%Y/%m/%d", "%Y.%m.%d", "%d.%m.%Y", "%m/%d/%Y", "%d/%m/%Y", "%d-%m-%Y",
         "%m-%d-%Y", "%d.%m.%y", "%m/%d/%y", "%d/%m/%y")  # fmt: skip
_TIMES = ("%H:%M:%S%.f", "%H:%M:%S", "%I:%M:%S%.f %p", "%I:%M:%S %p", "%H:%M")
_NO_DAY = "2000-01-01 "
_CLOCK = r"\d:\d{2}(?::\d{2}(?:\.\d+)?)?(?: [AP]M)?"
# Offsets from UTC by name, in minutes.
_ZONES = {"Z": 0, "UTC": 0, "GMT": 0, "CET": 60, "MEZ": 60, "CEST": 120, "MESZ": 120}
_ZONE = rf"(?i)({_CLOCK}) ?({'|'.join(sorted(_ZONES, key=len, reverse=True))})?"
_OFFSET = r"(?:([+-])(\d{1,2}):?(\d{2})?)?$"


@dataclass(frozen=True)
class Stamps:
    """Moments of a column of text.

    Attributes
    ----------
    time_s
        seconds since the first row, shape (n,), NaN where there is none.
    bad
        whether a cell holds text that is no moment of the form of the others, shape (n,).
    local
        whether the times are those of a place without their offset from UTC, so that the clock may
        have been put forward or back.
    """

    time_s: FloatArray
    bad: npt.NDArray[np.bool_]
    local: bool


def moments(text: pl.Series) -> Stamps | None:
    """Returns the moments in a column of text, in the form that most of its first cells have.

    None if most of these cells are no dates. A date such as 03/04/2024 is read with the month first
    or the day first, whichever fits more cells, and else gives the shorter record. Times of day
    without a date go on over midnight.
    """
    clean = (
        text.str.strip_chars()
        .str.replace(r"(\d)T(\d)", "${1} ${2}")
        .str.replace(r"\s+", " ")
        .str.replace(r"(\d:\d{2}:\d{2})[,:](\d+)", "${1}.${2}")
        .str.replace(r"(?i)(\d) ?([AP])\.?M\b\.?", "${1} ${2}M")
    )
    offset_s, zoned = _offsets(clean)
    local = not zoned.any()
    clean = clean.str.replace(_ZONE + _OFFSET, "${1}")
    head = clean.drop_nulls().head(TRIED_ROWS)
    best: tuple[int, float] | None = None
    found: Stamps | None = None
    for pattern in [*(f"{day} {time}" for day, time in product(_DAYS, _TIMES)), *_DAYS, *_TIMES]:
        with_day = "%d" in pattern
        shown = pattern if with_day else f"%Y-%m-%d {pattern}"
        if 2 * _parsed(head if with_day else _NO_DAY + head, shown).null_count() >= len(head):
            continue
        parsed = _parsed(clean if with_day else _NO_DAY + clean, shown)
        time_s = _since_first(parsed)
        time_s = time_s - (offset_s - offset_s[int(np.argmax(~np.isnan(time_s)))])
        if not with_day:
            time_s = _over_midnight(time_s)
        # Among moments with an offset from UTC, one without it cannot be placed.
        bad = clean.is_not_null().to_numpy() & (parsed.is_null().to_numpy() | ~(zoned | local))
        worth = (int(np.count_nonzero(bad)), float(np.nanmax(time_s) - np.nanmin(time_s)))
        if best is None or worth < best:
            best, found = worth, Stamps(time_s, bad, local)
    return found


def _offsets(clean: pl.Series) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Returns the offset of each cell from UTC in seconds, and whether it states one."""
    parts = clean.str.extract_groups(_ZONE + _OFFSET).struct.unnest()
    names, signs, hours, minutes = (parts.to_series(k) for k in range(1, 5))
    by_name = names.str.to_uppercase().replace_strict(_ZONES, default=0, return_dtype=pl.Int64)
    shift = hours.cast(pl.Int64).fill_null(0) * 60 + minutes.cast(pl.Int64).fill_null(0)
    sign = (signs == "-").fill_null(False).cast(pl.Int64) * -2 + 1
    total = 60.0 * (by_name.fill_null(0) + sign * shift).cast(pl.Float64).to_numpy()
    stated = (names.is_not_null() | signs.is_not_null()).to_numpy()
    return np.asarray(total, dtype=np.float64), stated


def _parsed(text: pl.Series, pattern: str) -> pl.Series:
    return text.str.to_datetime(pattern, time_unit="ns", strict=False)


def _since_first(stamps: pl.Series, tick_s: float = 1e-9) -> FloatArray:
    """Returns seconds since the first moment; whole ticks are subtracted exactly."""
    ticks = stamps.cast(pl.Int64)
    first = ticks.drop_nulls()[0]
    since = (ticks - first).cast(pl.Float64).fill_null(float("nan")).to_numpy()
    return np.asarray(since * tick_s, dtype=np.float64)


def _over_midnight(time_s: FloatArray) -> FloatArray:
    there = ~np.isnan(time_s)
    since = time_s[there]
    back = np.diff(since, prepend=since[:1]) < -0.75 * DAY_S
    made = time_s.copy()
    made[there] = since + DAY_S * np.cumsum(back)
    return made


def from_datetimes(stamps: pl.Series) -> FloatArray:
    """Returns seconds since the first of typed moments, times of day or durations.

    They are counted in their own unit: in nanoseconds, only the years 1677 to 2262 have room. With
    a time zone, what counts is stored in UTC and runs on over the change of summer time.
    """
    if stamps.null_count() == len(stamps):
        return np.full(len(stamps), np.nan)
    unit = "d" if stamps.dtype == pl.Date else getattr(stamps.dtype, "time_unit", None) or "ns"
    found = _since_first(stamps.to_physical(), SECONDS[unit])
    return _over_midnight(found) if stamps.dtype == pl.Time else found
