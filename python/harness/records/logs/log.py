# SPDX-License-Identifier: MIT
"""A file as it is, before anything is guessed: its kind, its table of columns, its named series."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy.typing as npt

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


class Table(ABC):
    """A file that may be a record as it is: columns, each under its name.

    Its parts raise RecordError where the file is damaged or beyond a limit.

    Attributes
    ----------
    ending
        ending of the names of such files, as messages call the kind.
    first_row
        row of the first value, as messages count rows.
    is_flat
        whether it has columns only. Else a variable may hold several signals, and a column that is
        none may be read in the log.
    """

    ending: str
    first_row = 1
    is_flat = False

    @abstractmethod
    def names(self) -> list[str] | None:
        """Returns the names of the columns; None where the file is laid out otherwise."""

    def text_names(self) -> list[str]:
        """Returns the names of the columns that hold text, as far as that is known unread."""
        return []

    @abstractmethod
    def read(self, wanted: Sequence[str]) -> dict[str, npt.NDArray[Any]]:
        """Returns columns as they are in the file, NaN for an empty cell.

        Raises
        ------
        RecordError
            a column does not hold what can be a signal.
        """

    @abstractmethod
    def log(self) -> Log:
        """Returns all signals of the file, of which channels are then found."""


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    Attributes
    ----------
    read
        returns the log in the content of a file, or the table that it is; the path is for messages.
        It raises RecordError where the file is damaged or beyond a limit.
    endings
        endings of its names, in lower case.
    head
        regular expression of its first bytes, which tell it whatever the name says; None if they
        are like those of other files.
    unbounded
        whether its reader decompresses more than a file states.
    of_notes
        those of the endings that a note may have, too.
    """

    read: Callable[[bytes, Path], Log | Table]
    endings: tuple[str, ...]
    head: bytes | None = None
    unbounded: bool = False
    of_notes: tuple[str, ...] = ()
