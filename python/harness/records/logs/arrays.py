# SPDX-License-Identifier: MIT
"""Makes a log of arrays that have paths as names: variables, fields of structures, datasets."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...base.arrays import FloatArray
from ...catalogue.channels import TIME
from ..errors import RecordError
from ..limits import BYTES, COLUMNS, SAMPLES
from .log import Series
from .names import means

VALUE_BYTES = 8
# A matrix with more columns than this is no set of signals.
MOST_SIGNALS = 64
SEPARATOR = "."


@dataclass(frozen=True)
class Part:
    """An array of a file: its path, shape and dtype, how to read it, and its unit if known."""

    path: tuple[str, ...]
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    read: Callable[[], npt.NDArray[Any]]
    unit: str | None = None
    labels: tuple[str, ...] = ()

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
        label = part.labels[k] if len(part.labels) == count else f"{name}[{k + 1}]"

        def column(k: int = k) -> FloatArray:
            table = whole().reshape(shape)
            return np.ascontiguousarray(table[:, k] if by_rows else table[k])

        made.append((part.path, Series(label, size, column, part.unit, is_time=is_time)))
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
