# SPDX-License-Identifier: MIT
"""Reads a record from a file.

What finds the kind of a file and reads logs is imported only when a file is opened.
"""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from ..catalogue.channels import CHANNELS, COMMAND, POSITION, REQUIRED_COLUMNS, TIME
from .checks import check_columns, has_sentinels, without_useless
from .errors import RecordError, bounded_memory, decompress, read_file
from .layout import (
    ColumnMap,
    Layout,
    check_layout,
    gauge_remarks,
    in_schema_unit,
    layout_of,
    names_in_file,
)
from .mapping import NO_HINTS, Hints, Request, units_differ
from .record import Origin, Record, make_record, without_numbers
from .timebase import TimeError, gap_remarks

if TYPE_CHECKING:
    from .logs.log import Log, Table

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
    with _opened(path) as (file, name, sha256):
        return record_in(file, path, request, name=name, sha256=sha256)


def open_unread(path: Path) -> Log:
    """Returns the log in a file as the file has it, before anything is guessed of it.

    Raises
    ------
    RecordError
        the file cannot be read.
    """
    from .logs.log import Log

    with _opened(path) as (file, _, _):
        return file if isinstance(file, Log) else file.log()


def record_in(
    file: Log | Table, path: Path, request: Request, *, name: str, sha256: str | None
) -> Record:
    """Returns the record in a file that is open: its table as it is, if it can be, or its log.

    Raises
    ------
    RecordError
        as `read_record`.
    """
    from .logs.log import Table
    from .logs.reading import record_of

    no_signal: RecordError | None = None
    if isinstance(file, Table):
        try:
            record = None if request.hints else _as_it_is(file, path, request, name, sha256)
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
    return record_of(file, path, request, name=name, sha256=sha256)


def _is_other_log(file_names: Sequence[str]) -> bool:
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


def _as_it_is(
    table: Table, path: Path, request: Request, name: str, sha256: str | None
) -> Record | None:
    """Reads a file that has all columns, bit for bit; only an uneven time is resampled.

    None where it has other names, another layout, or numbers that stand for no value: such a file
    is a log.
    """
    file_names = table.names()
    if file_names is None or not request.is_met_by(file_names, path) or _is_other_log(file_names):
        return None
    layout = layout_of(file_names, request.layout)
    names = names_in_file(file_names, layout, path)
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
        columns[target] = in_schema_unit(columns[target], layout[target], CHANNELS[target].unit)
    try:
        record = make_record(
            columns, name=name, source=path, sha256=sha256, first_row=table.first_row
        )
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
        from .logs.reading import even_record

        record, remarks = even_record(
            columns, error, path=path, name=name, sha256=sha256, first_row=table.first_row
        )
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


@contextmanager
def _opened(path: Path) -> Iterator[tuple[Log | Table, str, str]]:
    """Opens a file for as long as the block lasts; gives its name and its SHA-256 digest, too."""
    from .formats import ending_of, kind_of, opened

    ending = _folder_kind(path) if path.is_dir() else ending_of(path)
    # Without its ending: "run.csv.gz" gives "run".
    name = path.name if path.is_dir() else path.name[: -len(ending) - 1]
    data, sha256 = _bytes(path)
    if ending.endswith(".gz"):
        data = decompress(data, path)
    kind = kind_of(data, path, ending)
    with bounded_memory(path) if kind.unbounded else nullcontext():
        yield opened(kind, data, path), name, sha256


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


def _bytes(path: Path) -> tuple[bytes, str]:
    """Returns the content of a file and its SHA-256; of a folder its digest only."""
    try:
        if "\0" in str(path):
            problem, mend = "the path has a zero byte", "check the path"
        elif path.is_dir():
            files = sorted(file for file in path.iterdir() if file.is_file())
            contents = [read_file(file) for file in files]
            return b"", hashlib.sha256(b"".join(contents)).hexdigest()
        else:
            data = read_file(path)
            return data, hashlib.sha256(data).hexdigest()
    except FileNotFoundError:
        problem, mend = "there is no such file", "check the path"
    except OSError as error:
        problem, mend = f"the file cannot be read ({error.strerror})", "check its permissions"
    raise RecordError(path, problem, expected="a record file", mend=mend)
