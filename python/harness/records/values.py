# SPDX-License-Identifier: MIT
"""What the values in a log mean: numbers in any notation, dates, and numbers for no value.

Moments become seconds since the first row.

Numbers such as -9999 and 9.9E37 stand for no value, and are told apart from true extremes. A true
extreme is reached: a position at its end stop and a sensor at its limit have neighbours among the
other values. A number that stands for no value lies alone, far outside of all others. A command may
step to its full scale, and so may a signal that is no channel: of them only numbers are taken for
no value that no full scale has.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..base.numbers import FloatArray
from ..catalogue.channels import CHANNELS, COMMAND, TIME
from .errors import RecordError

if TYPE_CHECKING:
    import polars as pl


CORRECT_CELL = "correct the cell, or name the columns to use"
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

# A number with a prefix of the SI, a unit, or both behind it: "-5.7m", "3k", "12.5 mV".
WITH_PREFIX = re.compile(
    r"([+-]?(?:\d+[.,]?\d*|[.,]\d+))\s?(?=\S)([fpnuµμmkKMGT]|[Mm]eg)?(?:V|A|m|s|Hz|N|Pa|bar)?"
)
POWERS = {"f": -15, "p": -12, "n": -9, "u": -6, "m": -3, "k": 3, "K": 3, "M": 6, "G": 9, "T": 12}


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
    import polars as pl

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
    import polars as pl

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
    import polars as pl

    if stamps.null_count() == len(stamps):
        return np.full(len(stamps), np.nan)
    unit = "d" if stamps.dtype == pl.Date else getattr(stamps.dtype, "time_unit", None) or "ns"
    found = _since_first(stamps.to_physical(), SECONDS[unit])
    return _over_midnight(found) if stamps.dtype == pl.Time else found


@dataclass(frozen=True)
class Marks:
    """How the numbers of a column are written."""

    decimal: str
    """"." or ","."""
    thousands: str | None = None
    """The mark between groups of three digits, or None."""
    doubtful: str | None = None
    """A number that can be read in two ways, or None."""

    def plain(self, text: pl.Series) -> pl.Series:
        """Returns the numbers with a decimal point; with a mark of neither use they stay text."""
        if self.thousands is not None:
            text = text.str.replace_all(self.thousands, "", literal=True)
        if self.decimal == ",":
            # A point would pass for the decimal one.
            text = text.str.replace_all(".", "?", literal=True)
            text = text.str.replace(",", ".", literal=True)
        return text


def marks_of(column: pl.Series, usual: str) -> Marks:
    """Returns the marks of a column in a file whose decimal mark is usually `usual`.

    "1.000" beside "999" or "1,5" is a thousand; where all cells are like "1.234", it may be both.
    """
    other = "." if usual == "," else ","
    text = column.drop_nulls().str.strip_chars()
    has_other = text.str.contains(other, literal=True)
    marked, rest = text.filter(has_other), text.filter(~has_other)
    if len(marked):
        if _all(marked, rf"[1-9]\d{{0,2}}(?:\{other}\d{{3}})+(?:\{usual}\d*)?"):
            several = marked.str.count_matches(other, literal=True).max() != 1
            sure = several or marked.str.contains(usual, literal=True).any()
            fewer = rest.filter(rest.str.contains(r"\d"))
            if (sure or len(fewer)) and _all(fewer, rf"\d{{1,3}}(?:\{usual}\d*)?"):
                return Marks(usual, other)
            return Marks(usual, doubtful=str(marked[0]))
        if not text.str.contains(usual, literal=True).any() and _all(
            marked, rf"(?:\d+\{other}\d*|\{other}\d+)(?:[eEdD][+-]?\d+)?"
        ):
            return Marks(other)
        return Marks(usual)
    has_usual = text.str.contains(usual, literal=True)
    marked, rest = text.filter(has_usual), text.filter(~has_usual)
    if (
        len(marked)
        and _all(marked, rf"[1-9]\d{{0,2}}(?:\{usual}\d{{3}})+")
        and _all(rest, r"\d{1,3}")
        and rest.str.contains(r"\d{3}").any()
    ):
        return Marks(other, usual)
    return Marks(usual)


def _all(cells: pl.Series, pattern: str) -> bool:
    return bool(cells.str.contains(rf"^[+-]?{pattern}$").all())


def no_number(
    path: Path, row: int, column: str, cell: str, mend: str, decimal: str = "."
) -> RecordError:
    """Returns the error for a cell that is no number; `mend` is for one without a prefix."""
    return RecordError(
        path,
        f"the text '{shown(cell)}' is not a number",
        row=row,
        column=column,
        expected=f"a number such as 0{decimal}125 or 1.2e-3",
        mend=_plain_number_mend(cell) or mend,
    )


def shown(cell: str) -> str:
    """Returns a cell as messages have it: not longer than 40 letters."""
    text = cell.strip()
    return text if len(text) <= 40 else text[:37] + "..."


def _plain_number_mend(cell: str) -> str | None:
    """Returns the remedy for a cell such as "-5.7m"; None for any other text.

    The letter is not read: "M" is a million to most programs and a thousandth to LTspice, and "m"
    may be the unit.
    """
    match = WITH_PREFIX.fullmatch(cell.strip())
    if match is None:
        return None
    power = POWERS.get((match[2] or "").replace("µ", "u").replace("μ", "u")[:1])
    shown = f" (if '{match[2]}' is a prefix, {match[1]}e{power})" if power else ""
    return (
        f"export the column as plain numbers{shown}, and put a unit into the name of the column, "
        "such as 'Stroke [mm]'"
    )


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
