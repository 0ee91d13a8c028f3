# SPDX-License-Identifier: MIT
"""A file as it is, before anything is guessed: its kind, its table of columns, its named series."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.numbers import FloatArray
from ..catalogue.channels import TIME
from .errors import BYTES, COLUMNS, SAMPLES, RecordError
from .names import means

VALUE_BYTES = 8
# A matrix with more columns than this is no set of signals.
MOST_SIGNALS = 64
SEPARATOR = "."

Read = Callable[[], FloatArray]


@dataclass(frozen=True)
class Series:
    """A signal of a log."""

    name: str
    """Name as the file has it."""
    size: int
    """Number of values."""
    read: Read
    """Returns the values as float64, shape (size,), NaN where one is missing. Raises RecordError
    where the file has something else than a number."""
    unit: str | None = None
    """Unit as the file has it, outside of the name; None if it has none."""
    group: str = ""
    """Series of one group have their values in the same rows, at the same times."""
    time: Read | None = None
    """Returns the times of the values in seconds, shape (size,), where the format itself tells
    them; else None, and the time may be another series of the group."""
    is_time: bool = False
    """Whether the format itself says that the values are times in seconds."""
    local: bool = False
    """Whether these times are those of a place, of which the offset from UTC is not known."""
    column: int | None = None
    """Number of the column in a table of text, from 0; None elsewhere."""


@dataclass(frozen=True)
class Log:
    """What a file holds."""

    kind: str
    """What the file was taken for, in words."""
    series: tuple[Series, ...]
    """All signals with numbers, and those with dates."""
    first_row: int = 1
    """Row of the first value, as messages count rows."""
    notes: tuple[str, ...] = field(default=())
    """Sentences on what was left out or changed in reading."""
    dt_s: float | None = None
    """Sampling time in seconds, where the file states one; else None."""
    texts: tuple[str, ...] = ()
    """Names of the columns that hold text and no numbers; they may be among the series."""


class Table(ABC):
    """A file that may be a record as it is: columns, each under its name.

    Its parts raise RecordError where the file is damaged or beyond a limit.

    Attributes
    ----------
    first_row
        row of the first value, as messages count rows.
    is_flat
        whether it has columns only. Else a variable may hold several signals, and a column that is
        none may be read in the log.
    """

    ending: str
    """Ending of the names of such files, as messages call the kind."""
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
    """A kind of file."""

    read: Callable[[bytes, Path], Log | Table]
    """Returns the log in the content of a file, or the table that it is; the path is for messages.
    It raises RecordError where the file is damaged or beyond a limit."""
    endings: tuple[str, ...]
    """Endings of its names, in lower case."""
    head: bytes | None = None
    """Regular expression of its first bytes, which tell it whatever the name says; None if they are
    like those of other files."""
    unbounded: bool = False
    """Whether its reader decompresses more than a file states."""
    of_notes: tuple[str, ...] = ()
    """Those of the endings that a note may have, too."""


@dataclass(frozen=True)
class Part:
    """An array of a file: its path, shape and dtype, how to read it, and its unit if known."""

    path: tuple[str, ...]
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    read: Callable[[], npt.NDArray[Any]]
    unit: str | None = None

    @classmethod
    def of(cls, path: tuple[str, ...], values: npt.NDArray[Any], unit: str | None = None) -> Part:
        """Returns the part for an array that has been read."""
        return cls(path, values.shape, values.dtype, values.copy, unit)


def series_of(parts: Iterable[Part], path: Path) -> tuple[Series, ...]:
    """Returns the signals in arrays: vectors, columns of matrices, and times that have a type.

    The sizes are checked before anything is read. Series are in one group if they have the same
    length and the same time: one in the same structure, or else in one around it.

    Raises
    ------
    RecordError
        all arrays together are beyond a limit.
    """
    found: list[tuple[tuple[str, ...], Series]] = []
    total = 0
    for part in parts:
        is_time = part.dtype.kind in "mM"
        if part.dtype.kind not in "fiubmM" or len(part.shape) not in (1, 2) or 0 in part.shape:
            continue
        shape = tuple(size for size in part.shape if size != 1) or (1,)
        if len(shape) == 2 and min(shape) > MOST_SIGNALS:
            continue
        if max(shape) < 2:
            continue
        total += int(np.prod(part.shape)) * VALUE_BYTES
        BYTES.check(total, path)
        SAMPLES.check(max(shape), path)
        found += _signals(part, shape, is_time, path)
        COLUMNS.check(len(found), path)
    return tuple(replace(one, group=_group(where, one, found)) for where, one in found)


def _signals(
    part: Part, shape: tuple[int, ...], is_time: bool, path: Path
) -> list[tuple[tuple[str, ...], Series]]:
    name = SEPARATOR.join(part.path)

    @cache
    def whole() -> FloatArray:
        return as_float(part.read(), name, path)

    if len(shape) == 1:
        series = Series(
            name, shape[0], lambda: whole().reshape(-1), "s" if is_time else part.unit,
            is_time=is_time, local=part.dtype.kind == "M",
        )  # fmt: skip
        return [(part.path, series)]
    # The longer side has the samples.
    by_rows = shape[0] >= shape[1]
    count, size = min(shape), max(shape)
    made = []
    for k in range(count):

        def column(k: int = k) -> FloatArray:
            table = whole().reshape(shape)
            return np.ascontiguousarray(table[:, k] if by_rows else table[k])

        signal = f"{name}[{k + 1}]"
        made.append((part.path, Series(signal, size, column, part.unit, is_time=is_time)))
    return made


def as_float(values: npt.NDArray[Any], name: str, path: Path) -> FloatArray:
    """Returns values as float64; moments as seconds since the first, NaN where there is none.

    Raises
    ------
    RecordError
        they are not numbers.
    """
    values = np.asarray(values)
    if values.dtype.kind in "mM":
        ticks = values.astype("datetime64[ns]" if values.dtype.kind == "M" else "timedelta64[ns]")
        there = ~np.isnat(ticks)
        seconds = np.full(ticks.shape, np.nan)
        if there.any():
            seconds[there] = (ticks[there] - ticks[there].flat[0]).astype(np.int64) * 1e-9
        return seconds
    if values.dtype.kind not in "fiub":
        raise RecordError(
            path,
            f"the values are of type {values.dtype.name}",
            column=name,
            expected="real numbers",
            mend="convert the column to numbers, or name the columns to use",
        )
    return np.asarray(values, dtype=np.float64)


def _group(
    where: tuple[str, ...], series: Series, found: list[tuple[tuple[str, ...], Series]]
) -> str:
    """Returns the path of the nearest structure around a series that has a time, and its length."""
    for depth in range(len(where) - 1, -1, -1):
        around = where[:depth]
        if any(
            one.size == series.size
            and other[:depth] == around
            and len(other) == depth + 1
            and (one.is_time or other[-1] == TIME or means(other[-1], TIME))
            for other, one in found
        ):
            return f"{SEPARATOR.join(around)}|{series.size}"
    return f"|{series.size}"
