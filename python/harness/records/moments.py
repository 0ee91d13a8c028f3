# SPDX-License-Identifier: MIT
"""Reads dates and times of day in text, in any usual form, as seconds since the first of them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import islice, product

import numpy as np
import numpy.typing as npt

from ..base.numbers import FloatArray

DAY_S = 86_400
TRIED_ROWS = 50

_DAYS = ("Y-m-d", "Y/m/d", "Y.m.d", "d.m.Y", "m/d/Y", "d/m/Y", "d-m-Y", "m-d-Y", "d.m.y", "m/d/y",
         "d/m/y")  # fmt: skip
_PARTS = {"Y": r"(?P<Y>\d{4})", "y": r"(?P<y>\d\d)", "m": r"(?P<m>\d\d?)", "d": r"(?P<d>\d\d?)"}
_CLOCK = r"(?P<H>\d\d?):(?P<M>\d\d?):(?P<S>\d\d?)(?:[.,:](?P<f>\d+))?"
_TIMES = (_CLOCK, rf"{_CLOCK} ?(?P<p>[AaPp])\.?[Mm]\.?", r"(?P<H>\d\d?):(?P<M>\d\d)")
# Offsets from UTC by name, in minutes.
_ZONES = {"Z": 0, "UTC": 0, "GMT": 0, "CET": 60, "MEZ": 60, "CEST": 120, "MESZ": 120}
_OFFSET = (
    rf" ?(?i:(?P<zone>{'|'.join(sorted(_ZONES, key=len, reverse=True))}))?"
    r"(?:(?P<sign>[+-])(?P<oh>\d\d?):?(?P<om>\d\d)?)?"
)
_DIGITS_ZERO = str.maketrans("123456789", "000000000")


@dataclass(frozen=True)
class Stamps:
    """Moments of a column of text."""

    time_s: FloatArray
    """Seconds since the first row, shape (n,), NaN where there is none."""
    bad: npt.NDArray[np.bool_]
    """Whether a cell holds text that is no moment of the form of the others, shape (n,)."""
    local: bool
    """Whether the times are those of a place without their offset from UTC, so that the clock may
    have been put forward or back."""


@cache
def _forms() -> list[re.Pattern[str]]:
    """Returns the forms of moments: a day and a time, a day alone, a time alone."""
    days = [re.sub(r"\w", lambda part: _PARTS[part[0]], day.replace(".", r"\.")) for day in _DAYS]
    times = [time + _OFFSET for time in _TIMES]
    both = [rf"{day}[T ]{time}" for day, time in product(days, times)]
    return [re.compile(form, re.ASCII) for form in (*both, *days, *times)]


def moments(column: Iterable[str]) -> Stamps | None:
    """Returns the moments in a column of text, in the form that most of its first cells have.

    None if most of these cells are no dates. A date such as 03/04/2024 is read with the month first
    or the day first, whichever fits more cells, and else gives the shorter record. Times of day
    without a date go on over midnight. An empty cell is "".
    """
    cells = [" ".join(cell.split()) for cell in column]
    filled = np.array([cell != "" for cell in cells])
    head = first_filled(cells, TRIED_ROWS)
    best: tuple[int, float] | None = None
    found: Stamps | None = None
    for form in _forms():
        if 2 * np.count_nonzero(_parsed(head, form)[1]) <= len(head):
            continue
        ticks, there, offset_s, zoned = _parsed(cells, form)
        local = not zoned.any()
        time_s = since_first(ticks, there)
        time_s = time_s - (offset_s - offset_s[int(np.argmax(there))])
        if "d" not in form.groupindex:
            time_s = over_midnight(time_s)
        # Among moments with an offset from UTC, one without it cannot be placed.
        bad = filled & ~(there & (zoned | local))
        worth = (int(np.count_nonzero(bad)), float(np.nanmax(time_s) - np.nanmin(time_s)))
        if best is None or worth < best:
            best, found = worth, Stamps(time_s, bad, local)
    return found


def first_filled(cells: Iterable[str], count: int) -> list[str]:
    """Returns the first cells that are not empty."""
    return [*islice(filter(None, cells), count)]


def _parsed(
    cells: Sequence[str], form: re.Pattern[str]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.bool_], FloatArray, npt.NDArray[np.bool_]]:
    """Returns nanoseconds since 1970 by the cells' own clocks, and whether a cell is of the form.

    And the offset of each cell from UTC in seconds, and whether it states one.
    """
    ticks, offset_s = np.zeros(len(cells), np.int64), np.zeros(len(cells))
    there, zoned = np.zeros((2, len(cells)), np.bool_)
    # Cells with digits in the same places are read at once.
    shapes: dict[str, list[int]] = {}
    for row, shape in enumerate("\n".join(cells).translate(_DIGITS_ZERO).split("\n")):
        shapes.setdefault(shape, []).append(row)
    for shape, rows in shapes.items():
        if match := form.fullmatch(shape):
            text = np.array([cells[row] for row in rows], f"S{len(shape)}")
            ticks[rows], there[rows], offset_s[rows] = _read(match, text)
            groups = match.groupdict()
            zoned[rows] = bool(groups.get("zone") or groups.get("sign"))
    return ticks, there, offset_s, zoned


def _read(
    match: re.Match[str], text: npt.NDArray[np.bytes_]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.bool_], npt.NDArray[np.int64]]:
    """Returns nanoseconds, whether there is such a moment, and offsets of cells of one shape."""
    digits = text.view(np.uint8).reshape(text.size, -1)
    has = match.groupdict()

    def number(name: str, most: int = 9) -> npt.NDArray[np.int64]:
        start, end = match.span(name) if has.get(name) else (0, 0)
        one = digits[:, start : min(end, start + most)].astype(np.int64) - ord("0")
        return one @ 10 ** np.arange(one.shape[1], dtype=np.int64)[::-1]

    there = np.ones(text.size, np.bool_)
    days = np.zeros(text.size, np.int64)
    if has.get("d"):
        short = number("y")
        year = number("Y") if has.get("Y") else short + np.where(short < 70, 2000, 1900)
        months = (12 * (year - 1970) + number("m") - 1).astype("datetime64[M]")
        date = months.astype("datetime64[D]") + (number("d") - 1).astype("timedelta64[D]")
        # Nanoseconds have room for these years.
        there &= (year > 1677) & (year < 2262) & (number("m") > 0) & (number("m") < 13)
        there &= date.astype("datetime64[M]") == months
        days = date.astype(np.int64)
    hour, minute, second = number("H"), number("M"), number("S")
    if half := has.get("p"):
        there &= (hour > 0) & (hour < 13)
        hour = hour % 12 + (12 if half in "Pp" else 0)
    there &= (hour < 24) & (minute < 60) & (second <= 60)  # 60 is a leap second
    parts = len((has.get("f") or "")[:9])
    seconds = 86_400 * days + 3600 * hour + 60 * minute + second
    zone = _ZONES.get((has.get("zone") or "").upper(), 0)
    sign = -1 if has.get("sign") == "-" else 1
    offset_s = 60 * (zone + sign * (60 * number("oh") + number("om")))
    return seconds * 10**9 + number("f") * 10 ** (9 - parts), there, offset_s


def since_first(
    ticks: npt.NDArray[np.int64], there: npt.NDArray[np.bool_], tick_s: float = 1e-9
) -> FloatArray:
    """Returns seconds since the first moment that is there; whole ticks are subtracted exactly."""
    since = (ticks - ticks[int(np.argmax(there))]).astype(np.float64) * tick_s
    return np.where(there, since, np.nan)


def over_midnight(time_s: FloatArray) -> FloatArray:
    """Returns seconds from times of day, which begin again at midnight, with the days between."""
    there = ~np.isnan(time_s)
    since = time_s[there]
    back = np.diff(since, prepend=since[:1]) < -0.75 * DAY_S
    made = time_s.copy()
    made[there] = since + DAY_S * np.cumsum(back)
    return made
