# SPDX-License-Identifier: MIT
"""Reads a record from a file."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, TypedDict

import numpy as np
import numpy.typing as npt

from ..catalogue.channels import CHANNELS, COMMAND, POSITION, REQUIRED_COLUMNS, TIME
from .checks import check_columns, without_useless
from .csv_text import decompress
from .errors import RecordError
from .formats import FORMATS, ending_of, format_of, stem_of, told_by_head
from .gaps import gap_remarks
from .layout import (
    ColumnMap,
    Layout,
    check_layout,
    gauge_remarks,
    in_schema_unit,
    layout_of,
    names_in_file,
)
from .limits import bounded_memory, read_file
from .origin import NO_HINTS, Hints, Origin, without_numbers
from .record import Record, make_record
from .sentinels import has_sentinels
from .timebase import TimeError
from .unread import refusal
from .wish import Wish

if TYPE_CHECKING:
    from .csv_format import CsvTable
    from .logs.log import Log
    from .mat_format import MatTable
    from .npz_format import NpzTable
    from .parquet_format import ParquetTable

    Table = CsvTable | ParquetTable | MatTable | NpzTable

AS_THE_SCHEMA: Layout = MappingProxyType({})
# Kinds whose readers decompress more than a file states.
UNBOUNDED = ("mf4", "mdf", "mf3", "mdf3", "dat", "tdms", "mcap", "bag", "db3")
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
    ending = ending_of(path) if not path.is_dir() else _folder_kind(path)
    data, sha256 = _bytes(path, ending)
    if required is None:
        required = REQUIRED_COLUMNS if columns is None else tuple(columns)
    check_layout(layout, path)
    wish = Wish(columns, tuple(required), layout, hints)
    refused: RecordError | None = None
    no_signal: RecordError | None = None
    if ending in FORMATS and not hints:
        try:
            table = _table(data, path)
            if wish.is_met_by(table.names, path) and not is_other_log(table.names):
                return _as_the_schema(table, wish, path, sha256)
        except _NotTheSchemaError as error:
            refused = error.refused
        except RecordError as error:
            # The time may be typed as dates, and where all columns are read, a structure, a cell
            # array or a matrix may hold the signals. Of text the layout has told already.
            text = ending in ("csv", "csv.gz")
            no_channel = columns is None and error.column not in (None, TIME, *CHANNELS, *required)
            if text or isinstance(error, TimeError):
                raise
            if error.column != wish.time_name and not no_channel:
                raise
            no_signal = error
    from .logs.opening import open_log
    from .logs.reading import record_of

    name = path.name if path.is_dir() else stem_of(path)
    with bounded_memory(path) if ending in UNBOUNDED else nullcontext():
        log = open_log(data, path, ending, refused)
        if no_signal is not None and not log.series and not log.notes:
            raise no_signal
        return record_of(log, path, wish, name=name, sha256=sha256)


def open_unread(path: Path) -> Log:
    """Returns the log in a file as the file has it, before anything is guessed of it.

    Raises
    ------
    RecordError
        the file cannot be read.
    """
    from .logs.opening import open_log

    ending = ending_of(path) if not path.is_dir() else _folder_kind(path)
    data, _ = _bytes(path, ending)
    with bounded_memory(path) if ending in UNBOUNDED else nullcontext():
        return open_log(data, path, ending)


def is_other_log(file_names: Sequence[str]) -> bool:
    """Whether a file lacks `time_s` or `position_m`, and may have it under another name.

    A name is that of a position only if it states a unit: `y` is a name in plain records, too.
    """
    if TIME in file_names and POSITION in file_names:
        return False
    from .logs.names import means, unit_in_name

    named = TIME not in file_names and any(means(name, TIME) for name in file_names)
    return named or (
        POSITION not in file_names
        and any(means(one, POSITION) and unit_in_name(one, POSITION) for one in file_names)
    )


class _NotTheSchemaError(Exception):
    """A file is not laid out as the schema wants it; `refused` says why, if its reader does."""

    def __init__(self, refused: RecordError | None) -> None:
        super().__init__(str(refused))
        self.refused = refused


def _as_the_schema(table: Table, wish: Wish, path: Path, sha256: str) -> Record:
    """Reads a file that has all columns, bit for bit; only an uneven time is resampled."""
    layout = layout_of(table.names, wish.layout)
    names = names_in_file(table.names, layout, path)
    requested = wish.requested(names)
    texts = table.text_names()
    wanted = {
        name: names[name]
        for name in names
        if name in requested
        and (
            names[name] not in texts
            or name in (TIME, *CHANNELS, *wish.required, *(wish.columns or ()))
        )
    }
    left_out = [name for name in texts if name not in wanted.values()]
    arrays, useless = _arrays(table, wanted, layout, path, wish.required)
    about: _About = {
        "name": stem_of(path),
        "sha256": sha256,
        "first_row": table.first_row,
    }
    try:
        record = make_record(arrays, source=path, **about)
        remarks = (
            *without_numbers(left_out),
            *useless,
            *_other_units(layout, wanted),
            *gauge_remarks({names[one]: layout[one].unit for one in layout if one in wanted}),
            *slow_remarks(record),
            *gap_remarks(record),
        )
        return replace(record, origin=Origin(ending_of(path), (), remarks) if remarks else None)
    except TimeError as error:
        from .logs.reading import even_record

        record = even_record(arrays, error, path=path, kind=ending_of(path), **about)
        assert record.origin is not None
        remarks = (*without_numbers(left_out), *useless, *record.origin.remarks)
        return replace(record, origin=replace(record.origin, remarks=remarks))


def _other_units(layout: Layout, wanted: Mapping[str, str]) -> list[str]:
    """Returns remarks on columns whose names say another unit than the layout."""
    stated = {name: one for name, one in layout.items() if one.unit is not None and name in wanted}
    if not stated:
        return []
    from .logs.names import unit_in_name
    from .pasting import units_differ

    remarks: list[str] = []
    for name, one in stated.items():
        said = unit_in_name(one.name, name)
        remarks += units_differ(name, one.name, said, one.unit or "", "[columns]")
    return remarks


def slow_remarks(record: Record) -> tuple[str, ...]:
    """Returns a remark on a servo with a sampling time that only a wrong unit explains."""
    if record.dt_s is None or record.dt_s < SLOW_S or record.columns.keys().isdisjoint(CHANNELS):
        return ()
    return (
        f"the samples are {record.dt_s:.4g} s apart, which is slow for a servo. If '{TIME}' is in "
        f"ms: --map '{TIME}={TIME} [ms]'",
    )


class _About(TypedDict):
    name: str
    sha256: str
    first_row: int


def _arrays(
    table: Table, wanted: Mapping[str, str], layout: Layout, path: Path, required: Sequence[str]
) -> tuple[dict[str, npt.NDArray[np.float64]], list[str]]:
    """Returns the columns by their name in the record, in its units, and what is left out."""
    needed = {wanted[name] for name in (TIME, COMMAND, POSITION, *required) if name in wanted}
    read, remarks = without_useless(
        table.read(list(dict.fromkeys(wanted.values()))), needed, table.first_row
    )
    # The check comes before the renaming, so that messages use the column names of the file.
    arrays = check_columns(read, file=path, first_row=table.first_row)
    if has_sentinels({target: arrays[name] for target, name in wanted.items() if name in arrays}):
        raise _NotTheSchemaError(None)  # its gaps are those of a log
    return {
        target: in_schema_unit(arrays[name], layout[target], CHANNELS[target].unit)
        if target in layout
        else arrays[name]
        for target, name in wanted.items()
        if name in arrays
    }, remarks


def _folder_kind(path: Path) -> str:
    """Returns the kind of a folder that is one log.

    Raises
    ------
    RecordError
        it is another folder.
    """
    if (path / "metadata.yaml").is_file():
        return "db3"
    raise RecordError(
        path,
        "this is a directory",
        expected="a record file",
        mend="name one of the files in it",
    )


def _bytes(path: Path, ending: str) -> tuple[bytes, str]:
    """Returns the content of a file and its SHA-256; of a folder its digest only."""
    if "\0" in str(path):
        raise RecordError(
            path,
            "the path has a zero byte",
            expected="a record file",
            mend="check the path",
        )
    try:
        if path.is_dir():
            files = sorted(file for file in path.iterdir() if file.is_file())
            contents = [read_file(file) for file in files]
            return b"", hashlib.sha256(b"".join(contents)).hexdigest()
        data = read_file(path)
        return data, hashlib.sha256(data).hexdigest()
    except FileNotFoundError:
        problem, mend = "there is no such file", "check the path"
    except OSError as error:
        problem, mend = f"the file cannot be read ({error.strerror})", "check its permissions"
    raise RecordError(path, problem, expected="a record file", mend=mend)


def _table(data: bytes, path: Path) -> Table:
    # Only the library of the file's format is imported: polars and scipy take long to import.
    match format_of(path):
        case "csv" | "csv.gz" as kind:
            text = data if kind == "csv" else decompress(data, path)
            return _csv_table(text, path)
        case "parquet":
            from .parquet_format import ParquetTable

            return ParquetTable(data, path)
        case "mat":
            from .mat_format import HDF5_AT, HDF5_MAGIC, MatTable

            if data.startswith(HDF5_MAGIC, HDF5_AT):
                raise _NotTheSchemaError(None)
            return MatTable(data, path)
        case "npz":
            from .npz_format import NpzTable

            return NpzTable(data, path)


def _csv_table(text: bytes, path: Path) -> CsvTable:
    """Opens a CSV file, if it is laid out as the schema wants it.

    A file with another layout may have the right names: with a row of units below them, with a
    decimal comma, or with dates in the column of time.
    """
    from .csv_format import CsvTable
    from .logs.text import differs_from_schema

    if told_by_head(text) is not None or refusal(path, text) is not None:
        raise _NotTheSchemaError(None)
    refused = None
    try:
        table = CsvTable(text, path)
    except RecordError as error:
        refused = error
    if differs_from_schema(text, path):
        raise _NotTheSchemaError(refused)
    if refused is not None:
        raise refused
    return table
