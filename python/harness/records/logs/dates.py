# SPDX-License-Identifier: MIT
"""Dates and times of day as text, turned into seconds since the first row."""

from __future__ import annotations

from itertools import product

import numpy as np
import polars as pl

from ehsid.harness.arrays import FloatArray

DAY_S = 86_400.0
TRIED_ROWS = 50
SECONDS = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "d": DAY_S}

_DAYS = ("%Y-%m-%d", "%Y/%m/%d", "%Y.%m.%d", "%d.%m.%Y", "%m/%d/%Y", "%d/%m/%Y", "%d-%m-%Y",
         "%m-%d-%Y", "%d.%m.%y", "%m/%d/%y", "%d/%m/%y")  # fmt: skip
_TIMES = ("%H:%M:%S%.f", "%H:%M:%S", "%I:%M:%S%.f %p", "%I:%M:%S %p", "%H:%M")
_NO_DAY = "2000-01-01 "


def seconds(text: pl.Series) -> FloatArray | None:
    """Returns seconds since the first row, shape (n,), NaN for an empty cell; None if not dates.

    A date such as 03/04/2024 is read with the month first or the day first, whichever gives the
    shorter record. Times of day without a date go on over midnight.
    """
    clean = (
        text.str.strip_chars()
        .str.replace("T", " ", literal=True)
        .str.replace(r"\s+", " ")
        .str.replace(r"(\d{2}:\d{2}:\d{2})[,:](\d+)", "${1}.${2}")
        .str.replace(r"\s*(?:Z|UTC|[+-]\d{2}:?\d{2})$", "")
    )
    head = clean.drop_nulls().head(TRIED_ROWS)
    best: FloatArray | None = None
    patterns = [*(f"{day} {time}" for day, time in product(_DAYS, _TIMES)), *_DAYS, *_TIMES]
    for pattern in patterns:
        with_day = "%d" in pattern
        shown = pattern if with_day else f"%Y-%m-%d {pattern}"
        if _parsed(head if with_day else _NO_DAY + head, shown).null_count():
            continue
        parsed = _parsed(clean if with_day else _NO_DAY + clean, shown)
        if parsed.null_count() > clean.null_count():
            continue
        found = _since_first(parsed)
        if not with_day:
            found = _over_midnight(found)
        if best is None or _span(found) < _span(best):
            best = found
    return best


def _parsed(text: pl.Series, pattern: str) -> pl.Series:
    return text.str.to_datetime(pattern, time_unit="ns", strict=False)


def _since_first(moments: pl.Series, tick_s: float = 1e-9) -> FloatArray:
    """Returns seconds since the first moment; whole ticks are subtracted exactly."""
    ticks = moments.cast(pl.Int64)
    first = ticks.drop_nulls()[0]
    since = (ticks - first).cast(pl.Float64).fill_null(float("nan")).to_numpy()
    return np.asarray(since * tick_s, dtype=np.float64)


def _over_midnight(time_s: FloatArray) -> FloatArray:
    back = np.diff(time_s, prepend=time_s[:1]) < -0.5 * DAY_S
    return np.asarray(time_s + DAY_S * np.cumsum(back), dtype=np.float64)


def _span(time_s: FloatArray) -> float:
    return float(np.nanmax(time_s) - np.nanmin(time_s))


def from_datetimes(moments: pl.Series) -> FloatArray:
    """Returns seconds since the first of typed moments, times of day or durations.

    They are counted in their own unit: in nanoseconds, only the years 1677 to 2262 have room. With
    a time zone, what counts is stored in UTC and runs on over the change of summer time.
    """
    if moments.null_count() == len(moments):
        return np.full(len(moments), np.nan)
    unit = "d" if moments.dtype == pl.Date else getattr(moments.dtype, "time_unit", None) or "ns"
    return _since_first(moments.to_physical(), SECONDS[unit])
