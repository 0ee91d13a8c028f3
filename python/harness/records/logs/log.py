# SPDX-License-Identifier: MIT
"""A log as its file has it: named series, each with its own clock, before anything is guessed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from ...base.arrays import FloatArray

Read = Callable[[], FloatArray]


@dataclass(frozen=True)
class Series:
    """A signal of a log.

    Attributes
    ----------
    name
        name as the file has it.
    size
        number of values.
    read
        returns the values as float64, shape (size,), NaN where one is missing. Raises RecordError
        where the file has something else than a number.
    unit
        unit as the file has it, outside of the name; None if it has none.
    group
        series of one group have their values in the same rows, at the same times.
    time
        returns the times of the values in seconds, shape (size,), where the format itself tells
        them; else None, and the time may be another series of the group.
    is_time
        whether the format itself says that the values are times in seconds.
    local
        whether these times are those of a place, of which the offset from UTC is not known.
    column
        number of the column in a table of text, from 0; None elsewhere.
    """

    name: str
    size: int
    read: Read
    unit: str | None = None
    group: str = ""
    time: Read | None = None
    is_time: bool = False
    local: bool = False
    column: int | None = None


@dataclass(frozen=True)
class Log:
    """What a file holds.

    Attributes
    ----------
    kind
        what the file was taken for, in words.
    series
        all signals with numbers, and those with dates.
    first_row
        row of the first value, as messages count rows.
    notes
        sentences on what was left out or changed in reading.
    dt_s
        sampling time in seconds, where the file states one; else None.
    texts
        names of the columns that hold text and no numbers; they may be among the series.
    """

    kind: str
    series: tuple[Series, ...]
    first_row: int = 1
    notes: tuple[str, ...] = field(default=())
    dt_s: float | None = None
    texts: tuple[str, ...] = ()
