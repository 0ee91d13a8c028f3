# SPDX-License-Identifier: MIT
"""Makes a record of columns that are in memory, by the rules for files."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.arrays import FloatArray, masked_count
from ..catalogue.channels import CHANNELS, COMMAND, POSITION, TIME
from .checks import check_columns, without_useless
from .errors import RecordError
from .gaps import gap_remarks
from .origin import NO_HINTS, Hints, Origin, without_numbers
from .reading import AS_THE_SCHEMA, is_other_log, slow_remarks
from .record import Record, make_record
from .sentinels import has_sentinels
from .timebase import TimeError
from .wish import Wish

KIND = "columns in memory"


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
    texts = [key for key, values in given.items() if values.dtype.kind not in "fiubmM"]
    if hints or is_other_log(list(given)) or _has_dates(given):
        record = _as_a_log(given, texts, hints, name)
    else:
        record = _as_the_schema(given, texts, name)
    return replace(record, source=None, sha256=digest(given.items()))


def digest(columns: Iterable[tuple[str, npt.NDArray[Any]]]) -> str:
    """Returns the SHA-256 hex digest of names and values of columns."""
    found = hashlib.sha256()
    for name, values in columns:
        found.update(f"{name}\0{values.dtype.str}\0{values.size}\0".encode())
        found.update(values.tobytes())
    return found.hexdigest()


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


def _has_dates(columns: Mapping[str, npt.NDArray[Any]]) -> bool:
    return any(values.dtype.kind in "mM" for values in columns.values())


def _as_the_schema(columns: Mapping[str, npt.NDArray[Any]], texts: list[str], name: str) -> Record:
    """Takes the columns as they are; only an uneven time is resampled."""
    # Text under the name of a channel is refused, not left out.
    left_out = [key for key in texts if key not in CHANNELS]
    numbers = {key: values for key, values in columns.items() if key not in left_out}
    kept, useless = without_useless(numbers, (TIME, COMMAND, POSITION), 1)
    try:
        record = make_record(kept, name=name)
        if has_sentinels(record.columns):
            return _as_a_log(columns, texts, NO_HINTS, name)
    except TimeError as error:
        from .logs.reading import even_record

        arrays: dict[str, FloatArray] = check_columns(kept, file=name, first_row=1)
        record = even_record(
            arrays, error, path=Path(name), name=name, sha256="", first_row=1, kind=KIND
        )
        assert record.origin is not None
        said = (*without_numbers(left_out), *useless, *record.origin.remarks)
        return replace(record, origin=replace(record.origin, remarks=said))
    remarks = (*without_numbers(left_out), *useless, *slow_remarks(record), *gap_remarks(record))
    return replace(record, origin=Origin(KIND, (), remarks) if remarks else None)


def _as_a_log(
    columns: Mapping[str, npt.NDArray[Any]], texts: list[str], hints: Hints, name: str
) -> Record:
    """Finds the channels by names, units and ranges."""
    from .logs.arrays import Part, series_of
    from .logs.log import Log
    from .logs.reading import record_of

    path = Path(name)
    asked = [key for key in texts if key == TIME or key in CHANNELS]
    if asked:
        raise RecordError(
            name,
            f"the values are of type {columns[asked[0]].dtype.name}",
            column=asked[0],
            expected="real numbers",
            mend="convert the column to numbers",
        )
    parts = [
        Part((key,), values.shape, values.dtype, lambda values=values: values)  # type: ignore[misc]
        for key, values in columns.items()
    ]
    log = Log(KIND, series_of(parts, path), texts=tuple(texts))
    wish = Wish(None, (), AS_THE_SCHEMA, hints)
    return record_of(log, path, wish, name=name, sha256=None)
