# SPDX-License-Identifier: MIT
"""Makes a record of columns that are in memory, by the rules for files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.arrays import masked_count
from ..catalogue.channels import CHANNELS
from .checks import check_columns
from .errors import RecordError
from .logs.log import Log, Part, Table, series_of
from .mapping import NO_HINTS, Hints, Request
from .reading import record_in
from .record import Record, digest


def record_of_columns(
    columns: Mapping[str, npt.ArrayLike], *, hints: Hints = NO_HINTS, name: str = "record"
) -> Record:
    """Returns the record that a file with these columns would give.

    Parameters
    ----------
    columns
        one-dimensional values of equal length by column name. Columns with the names of the schema
        are in its units. Dates are allowed where they are the time.
    hints
        names, units and sampling time that the user states, as for `read_record`.
    name
        of the record, also in messages.

    Returns
    -------
    The record, without a file as its source; `sha256` is the digest of the columns.

    Raises
    ------
    RecordError
        a column has a problem; the message says where it is and how to mend it.
    """
    given = {str(key): _array(values, str(key), name) for key, values in columns.items()}
    _check(given, name)
    request = Request(None, (), {}, hints)
    record = record_in(_Columns(given, name), Path(name), request, name=name, sha256=None)
    return replace(record, source=None, sha256=digest(given.items()))


class _Columns(Table):
    """Arrays of equal length by name."""

    ending = "columns in memory"
    is_flat = True

    def __init__(self, arrays: Mapping[str, npt.NDArray[Any]], name: str) -> None:
        self._arrays = arrays
        self._name = name

    def names(self) -> list[str] | None:
        dated = any(values.dtype.kind in "mM" for values in self._arrays.values())
        return None if dated else list(self._arrays)

    def text_names(self) -> list[str]:
        return [key for key, values in self._arrays.items() if values.dtype.kind not in "fiubmM"]

    def read(self, wanted: Sequence[str]) -> dict[str, npt.NDArray[Any]]:
        return {name: self._arrays[name] for name in wanted}

    def log(self) -> Log:
        texts = self.text_names()
        for key in texts:
            if key in CHANNELS:
                raise RecordError(
                    self._name,
                    f"the values are of type {self._arrays[key].dtype.name}",
                    column=key,
                    expected="real numbers",
                    mend="convert the column to numbers",
                )
        parts = [Part.of((key,), values) for key, values in self._arrays.items()]
        return Log(self.ending, series_of(parts, Path(self._name)), texts=tuple(texts))


def _array(values: npt.ArrayLike, column: str, name: str) -> npt.NDArray[Any]:
    if isinstance(values, np.ndarray):  # a masked array stays one, so that its mask is seen
        return values
    try:
        return np.asarray(values)
    except ValueError:  # lists of unequal lengths in a list
        raise RecordError(
            name,
            "the values are not one column",
            column=column,
            expected="a vector, one value a sample",
            mend="give each signal under its own name",
        ) from None


def _check(columns: Mapping[str, npt.NDArray[Any]], name: str) -> None:
    if not columns:
        check_columns({}, file=name, first_row=1)
    for key, values in columns.items():
        if masked_count(values):
            check_columns({key: values}, file=name, first_row=1)
        if values.shape[:1] != next(iter(columns.values())).shape[:1]:
            numbers = {one: np.zeros(array.shape) for one, array in columns.items()}
            check_columns(numbers, file=name, first_row=1)
