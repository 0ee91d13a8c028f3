# SPDX-License-Identifier: MIT
"""Reads a record: from a file with the names of the schema, from any log, from columns in memory.

The readers of the kinds of files are imported only when a file is opened, and what makes a record
of a log only where there is one.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.numbers import masked_count
from ..catalogue.channels import CHANNELS, COMMAND, POSITION, REQUIRED_COLUMNS, TIME
from .checks import TimeError, check_columns, gap_remarks, without_useless
from .errors import RecordError
from .log import Log, Part, Table, series_of
from .mapping import (
    NO_HINTS,
    ColumnMap,
    Hints,
    Layout,
    Request,
    check_layout,
    layout_of,
    names_in_file,
    units_differ,
)
from .names import means, unit_in_name
from .record import Origin, Record, digest, make_record, without_numbers
from .units import gauge_remarks, in_schema_unit
from .values import has_sentinels

AS_THE_SCHEMA: Layout = MappingProxyType({})
# Longer sampling times are none of a servo; such a column of time is often in milliseconds.
SLOW_S = 0.5


def read_record(
    path: str | os.PathLike[str],
    *,
    columns: Sequence[str] | None = None,
    required: Sequence[str] | None = None,
    layout: Mapping[str, ColumnMap] = AS_THE_SCHEMA,
    hints: Hints = NO_HINTS,
) -> Record:
    """Reads and checks a record, or a log of any other layout.

    A file with the names of the schema (or of `layout`, or of `columns`) is read as it is. In
    every other one the columns are found by their names, units and ranges, and its signals are
    brought to an even time; `Record.origin` then says what was taken for what.

    Parameters
    ----------
    path
        file in the format CSV, CSV.gz, Parquet, MAT or NPZ, given by the extension, or a log of
        another kind (docs/records.md). A ROS 2 bag may be a folder.
    columns
        names of the columns to read; `time_s` is also read if the file has it. None reads all
        columns but those that are no channel and hold text, which a remark then names.
    required
        names of columns that must exist; by default those in `columns`, or `time_s` and
        `command_v` if `columns` is None.
    layout
        columns of the schema that have other names or units in the file, as in `[columns]` of a
        rig. `columns` and `required` use the names of the schema. Layout columns that are read must
        be in the file, unless the file has only names of the schema instead.
    hints
        names, units and sampling time that the user states; they go before all others.

    Returns
    -------
    The record; without a time its `dt_s` is None.

    Raises
    ------
    RecordError
        the file has a problem; the message says where it is and how to mend it.
    ValueError
        the hints have a sampling time that is not above 0.
    """
    path = Path(path)
    if hints.dt_s is not None and not 0.0 < hints.dt_s < math.inf:
        raise ValueError(f"sampling time {hints.dt_s:g} s: expected a number above 0")
    if required is None:
        required = REQUIRED_COLUMNS if columns is None else tuple(columns)
    check_layout(layout, path)
    request = Request(columns, tuple(required), layout, hints)
    from .kinds import opened

    with opened(path) as (file, name, sha256):
        return replace(_record_in(file, path, request), name=name, sha256=sha256)


def open_unread(path: Path) -> Log:
    """Returns the log in a file as the file has it, before anything is guessed of it.

    Raises
    ------
    RecordError
        the file cannot be read.
    """
    from .kinds import opened

    with opened(path) as (file, _, _):
        return file if isinstance(file, Log) else file.log()


def _record_in(file: Log | Table, path: Path, request: Request) -> Record:
    """Returns the record in a file that is open: its table as it is, if it can be, or its log.

    Raises
    ------
    RecordError
        as `read_record`.
    """
    no_signal: RecordError | None = None
    if isinstance(file, Table):
        try:
            record = None if request.hints else _as_it_is(file, path, request)
            if record is not None:
                return record
        except RecordError as error:
            # The time may be typed as dates, and where all columns are read, a structure, a cell
            # array or a matrix may hold the signals.
            no_channel = request.columns is None and error.column not in (
                *(None, TIME, *CHANNELS, *request.required),
            )
            if file.is_flat or isinstance(error, TimeError):
                raise
            if error.column != request.time_name and not no_channel:
                raise
            no_signal = error
        file = file.log()
        if no_signal is not None and not file.series and not file.notes:
            raise no_signal
    return _record_of(file, path, request)


def _is_other_log(file_names: Sequence[str]) -> bool:
    """Whether a file lacks `time_s` or `position_m`, and may have it under another name.

    A name is that of a position only if it states a unit: `y` is a name in plain records, too.
    """
    if TIME in file_names and POSITION in file_names:
        return False
    named = TIME not in file_names and any(means(name, TIME) for name in file_names)
    return named or (
        POSITION not in file_names
        and any(means(one, POSITION) and unit_in_name(one, POSITION) for one in file_names)
    )


def _as_it_is(table: Table, path: Path, request: Request) -> Record | None:
    """Reads a file that has all columns, bit for bit; only an uneven time is resampled.

    None where it has other names, another layout, or numbers that stand for no value: such a file
    is a log.
    """
    file_names = table.names()
    if file_names is None:
        return None
    layout = layout_of(file_names, request.layout)
    names = names_in_file(file_names, layout, path)
    if not request.is_met_by(names, layout) or _is_other_log(file_names):
        return None
    asked = request.requested(names)
    texts = table.text_names()
    known = (TIME, *CHANNELS, *request.required, *(request.columns or ()))
    wanted = {
        target: one
        for target, one in names.items()
        if target in asked and (one not in texts or target in known)
    }
    left_out = without_numbers([one for one in texts if one not in wanted.values()])
    needed = {wanted[one] for one in (TIME, COMMAND, POSITION, *request.required) if one in wanted}
    read, useless = without_useless(
        table.read(list(dict.fromkeys(wanted.values()))), needed, table.first_row
    )
    # The check comes before the renaming, so that messages use the column names of the file.
    arrays = check_columns(read, file=path, first_row=table.first_row)
    columns = {target: arrays[one] for target, one in wanted.items() if one in arrays}
    if has_sentinels(columns):
        return None
    for target in columns.keys() & layout.keys():
        columns[target] = in_schema_unit(
            columns[target], layout[target].unit, CHANNELS[target].unit
        )
    try:
        record = make_record(columns, source=path, first_row=table.first_row)
        remarks = (
            *(
                remark
                for one in layout
                if one in wanted
                for remark in units_differ(
                    one, layout[one].name, None, layout[one].unit, by_rig=True
                )
            ),
            *gauge_remarks({names[one]: layout[one].unit for one in layout if one in wanted}),
            *_slow_remarks(record),
            *gap_remarks(record),
        )
    except TimeError as error:
        from .resampling import Maker

        maker = Maker(path, table.first_row, None)
        even = maker.even(columns, error)
        record = make_record(even, source=path, first_row=table.first_row)
        remarks = tuple(maker.remarks)
    remarks = (*left_out, *useless, *remarks)
    return replace(record, origin=Origin(table.ending, (), remarks) if remarks else None)


def _slow_remarks(record: Record) -> tuple[str, ...]:
    """Returns a remark on a servo with a sampling time that only a wrong unit explains."""
    if record.dt_s is None or record.dt_s < SLOW_S or record.columns.keys().isdisjoint(CHANNELS):
        return ()
    return (
        f"the samples are {record.dt_s:.4g} s apart, which is slow for a servo. If '{TIME}' is in "
        f"ms: --map '{TIME}={TIME} [ms]'",
    )


def _record_of(log: Log, path: Path, request: Request) -> Record:
    """Returns the record that a log holds.

    Raises
    ------
    RecordError
        a required column is not found, or not without doubt; its time cannot be repaired.
    """
    from .clock import Clocks
    from .matching import Matching
    from .resampling import Maker

    required, hints = request.required, request.hints
    named = CHANNELS if request.columns is None else request.columns
    wanted = list(dict.fromkeys([*named, *required, *hints.maps]))
    matching = Matching(log, path, request)
    choices = matching.choose(wanted, set(required) - {TIME})
    clocks = Clocks(log, path, request)
    if request.columns is None:
        choices += matching.rest(choices, clocks.columns())
    if not choices:
        raise RecordError(
            path,
            "; ".join((f"no column of numbers was found (read as {log.kind})", *log.notes)),
            expected="at least one signal",
            mend="look into the file, or export it again",
        )
    maker = Maker(path, log.first_row, hints.dt_s)
    made, taken_time = maker.make(choices, clocks, set(required), TIME in required)
    if taken_time is None and matching.without_value:
        column, remark = next(iter(matching.without_value.items()))
        raise RecordError(
            path,
            f"{remark}, and without a time there can be no gap",
            column=column,
            expected="a value in every row, or a time",
            mend="say the sampling time in seconds, such as --dt 0.001, or correct these rows",
        )
    used = [one.taken for one in choices if one.taken.channel in made]
    taken = (*([taken_time.taken] if taken_time else []), *used)
    remarks = (
        *log.notes,
        *(matching.missing(taken) if request.columns is None else ()),
        *matching.remarks,
        *without_numbers(log.texts),
        *clocks.remarks,
        *maker.remarks,
    )
    origin = Origin(log.kind, taken, remarks)
    return make_record(made, source=path, first_row=log.first_row, origin=origin)


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
    if not given:
        check_columns({}, file=name, first_row=1)
    for key, array in given.items():
        if masked_count(array):
            check_columns({key: array}, file=name, first_row=1)
        if array.shape[:1] != next(iter(given.values())).shape[:1]:
            numbers = {one: np.zeros(other.shape) for one, other in given.items()}
            check_columns(numbers, file=name, first_row=1)
    record = _record_in(_Columns(given, name), Path(name), Request(None, (), {}, hints))
    return replace(record, name=name, source=None, sha256=digest(given.items()))


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
