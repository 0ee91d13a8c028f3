# SPDX-License-Identifier: MIT
"""The record: uniform samples of named columns, how it came from a log, and how it is written."""

from __future__ import annotations

import gzip
import hashlib
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ..base.csv_text import csv_text
from ..base.files import replacing
from ..catalogue.channels import CHANNELS, TIME
from .checks import Gap, Jitter, analyse_time, check_columns
from .errors import RecordError, missing_column, missing_package
from .units import is_convertible

MOST_LISTED = 12  # names of columns in a remark
DATES = "dates or times in the log"  # begins the reason of a time that has no unit


@dataclass(frozen=True)
class Taken:
    """A column of a log and what it was taken for: value in the record = factor x + offset."""

    channel: str
    """Column of the record."""
    column: str
    """Column of the log, or "" where the time comes from elsewhere."""
    unit: str | None
    """Unit of the log in the notation of `ColumnMap`; None is the unit of the record."""
    factor: float
    offset: float
    """The conversion."""
    why: str
    """The reason, in words."""

    def unit_to_state(self) -> str | None:
        """Returns the unit; None of dates and of a command that keeps its numbers, as in mA."""
        schema_unit = CHANNELS[self.channel].unit
        unit = self.unit or schema_unit
        counted = self.unit is None and (self.offset != 0.0 or self.why.startswith(DATES))
        return unit if is_convertible(unit, schema_unit) and not counted else None


@dataclass(frozen=True)
class Origin:
    """How a log became a record."""

    kind: str
    """What the file was taken for, such as "text, columns separated by ';', decimal comma"."""
    taken: tuple[Taken, ...]
    """The columns that are in the record."""
    remarks: tuple[str, ...]
    """Sentences on what was changed, left out or guessed."""

    def to_dict(self) -> dict[str, Any]:
        """Returns the origin as plain values for JSON."""
        return {
            "kind": self.kind,
            "columns": [vars(one).copy() for one in self.taken],
            "remarks": list(self.remarks),
        }

    def rows(self) -> list[tuple[str, str, str, str, str]]:
        """Returns the table of columns as text: column, taken for, unit, factor, why."""
        return [
            (
                one.column or "-",
                one.channel,
                one.unit or unit_of(one.channel),
                f"{one.factor:.6g}" + (f" {one.offset:+.6g}" if one.offset else ""),
                one.why,
            )
            for one in self.taken
        ]

    def columns_block(self) -> str:
        """Returns the columns of the schema as a [columns] block of a rig file; "" without any."""
        lines = [
            columns_line(one.channel, one.column, one.unit_to_state())
            for one in self.taken
            if one.channel in CHANNELS and one.column
        ]
        return "\n".join(["[columns]", *lines]) + "\n" if lines else ""


def without_numbers(names: Sequence[str]) -> tuple[str, ...]:
    """Returns one remark on all columns that are left out because they hold text; none of none."""
    if not names:
        return ()
    listed = ", ".join(f"'{name}'" for name in names[:MOST_LISTED])
    more = f" and {len(names) - MOST_LISTED} more" if len(names) > MOST_LISTED else ""
    return (f"columns without numbers are left out: {listed}{more}",)


def unit_of(name: str) -> str:
    """Returns the unit of a column of a record in words, "as logged" for one of no channel."""
    return CHANNELS[name].unit if name in CHANNELS else "as logged"


def columns_line(channel: str, column: str, unit: str | None) -> str:
    """Returns the line of [columns] in a rig file for a column; without a unit for None."""
    pairs = f"name = {toml_string(column)}"
    pairs += "" if unit is None else f", unit = {toml_string(unit)}"
    return f"{channel} = {{ {pairs} }}"


def toml_string(text: str) -> str:
    """Returns a text as a basic string of TOML."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in escaped) + '"'


def with_reading(results: dict[str, Any], origin: Origin | None) -> dict[str, Any]:
    """Returns results as JSON has them, with what was taken for what in a log as "reading"."""
    return results if origin is None else {**results, "reading": origin.to_dict()}


@dataclass(frozen=True, eq=False)
class Record:
    """Uniform samples of named columns; arrays are read-only."""

    name: str
    """Stem of the file name, or the name given to `make_record`."""
    columns: Mapping[str, npt.NDArray[np.float64]]
    """Finite float64 array of shape (n,) for each column name, without `time_s`."""
    time_s: npt.NDArray[np.float64] | None
    """Time in seconds, float64 array of shape (n,); None if the sampling time is not known."""
    dt_s: float | None
    """Sampling time in seconds, or None (then time is counted in samples)."""
    segments: tuple[slice, ...]
    """Slices of samples without a gap; they cover the record in order."""
    jitter: Jitter | None
    """Deviation of the time steps from dt_s; None without time."""
    gaps: tuple[Gap, ...]
    """Gaps in time between the segments."""
    source: Path | None = None
    """File from which the record was read, or None."""
    sha256: str | None = None
    """SHA-256 hex digest of the bytes of that file, or None."""
    origin: Origin | None = None
    """What was taken for what in a log that does not follow the schema; None for a record that
    does."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "columns", MappingProxyType(dict(self.columns)))

    def __reduce__(self) -> tuple[type[Record], tuple[Any, ...]]:
        # A mapping proxy cannot be pickled. Another process receives a plain dictionary.
        rest = (self.time_s, self.dt_s, self.segments, self.jitter, self.gaps)
        return Record, (self.name, dict(self.columns), *rest, self.source, self.sha256, self.origin)

    def __len__(self) -> int:
        """Number of samples."""
        return next(iter(self.columns.values())).size

    def column(self, name: str) -> npt.NDArray[np.float64]:
        """Returns the column called `name`, shape (n,).

        Raises
        ------
        RecordError
            there is no such column; the message suggests the nearest name.
        """
        if name not in self.columns:
            raise missing_column(
                self.source or self.name, name, self.columns, "a column of this name"
            )
        return self.columns[name]

    def own_unit(self, name: str) -> str | None:
        """Returns the unit of a column that keeps the numbers of its log, such as "percent".

        None: it has the unit of the schema.
        """
        taken = () if self.origin is None else self.origin.taken
        kept = (one.unit for one in taken if one.channel == name and one.factor == 1.0)
        return next(kept, None)


def make_record(
    columns: Mapping[str, npt.ArrayLike],
    *,
    name: str = "record",
    source: Path | None = None,
    first_row: int = 1,
    origin: Origin | None = None,
) -> Record:
    """Checks columns and builds a record from them.

    Parameters
    ----------
    columns
        numbers for each column name, one-dimensional and of equal length. `time_s` is optional and
        becomes the time base.
    name
        name of the record.
    source
        file from which the columns were read.
    first_row
        row number of the first sample in messages (2 for CSV, whose row 1 is the header).
    origin
        what was taken for what in the file; None where it follows the schema.

    Raises
    ------
    RecordError
        there is no column besides `time_s`, there are fewer than two samples, the columns have
        unequal lengths or are not one-dimensional, values are not numbers, NaN or infinite, or the
        time base is not usable.
    """
    file = source or name
    arrays = check_columns(columns, file=file, first_row=first_row)
    time_s = arrays.pop(TIME, None)
    if not arrays:
        raise RecordError(
            file,
            f"there is no column beside '{TIME}'",
            expected="at least one measured column",
            mend="add the measured columns",
        )
    base = None if time_s is None else analyse_time(time_s, file=file, first_row=first_row)
    for array in arrays.values() if time_s is None else (time_s, *arrays.values()):
        array.setflags(write=False)
    whole = slice(0, next(iter(arrays.values())).size)
    return Record(
        name=name,
        columns=arrays,
        time_s=time_s,
        dt_s=base.dt_s if base else None,
        segments=base.segments if base else (whole,),
        jitter=base.jitter if base else None,
        gaps=base.gaps if base else (),
        source=source,
        origin=origin,
    )


def digest(columns: Iterable[tuple[str, npt.NDArray[Any]]]) -> str:
    """Returns the SHA-256 hex digest of names and values of columns."""
    found = hashlib.sha256()
    for name, values in columns:
        found.update(f"{name}\0{values.dtype.str}\0{values.size}\0".encode())
        found.update(values.tobytes())
    return found.hexdigest()


def told_apart(records: Sequence[Record]) -> list[Record]:
    """Returns the records with unique names.

    If records have the same file stem, the name of the folder is put before it.

    Raises
    ------
    ValueError
        two records have the same data, or the names are still not unique.
    """
    seen: dict[str, Record] = {}
    for record in records:
        # A record that was made in memory, such as a simulated one, has no digest of a file.
        key = record.sha256 or digest(record.columns.items())
        if key in seen:
            raise ValueError(
                f"{_place(record)}: the same data as {_place(seen[key])}; give each record once, "
                "and hold out none that is fitted"
            )
        seen[key] = record
    stems = [record.name for record in records]
    named = [
        replace(record, name=f"{Path(record.source).resolve().parent.name}_{record.name}")
        if record.source is not None and stems.count(record.name) > 1
        else record
        for record in records
    ]
    names = [record.name for record in named]
    twice = [record for record in named if names.count(record.name) > 1]
    if twice:
        raise ValueError(
            f"{_place(twice[0])} and {_place(twice[1])}: both are called "
            f"'{twice[0].name}'; rename one"
        )
    return named


def _place(record: Record) -> Path | str:
    """Returns the file of a record, or its name where it has none."""
    return record.source or record.name


Format = Literal["csv", "csv.gz", "parquet", "mat", "npz"]

# Those that are written. "csv.gz" is one of its own: "rec.csv.gz" matches no other ending.
FORMATS: tuple[Format, ...] = ("csv.gz", "csv", "parquet", "mat", "npz")


def write_record(record: Record, path: str | os.PathLike[str]) -> None:
    """Writes the record in the format of the file's extension; replaces an existing file.

    Reading the file gives the same float64 values. The file appears under its name only when it is
    complete.

    Raises
    ------
    RecordError
        the extension is unknown, the format does not allow a column name, or the file cannot be
        written.
    """
    path = Path(path)
    content = record_bytes(record, path)
    try:
        with replacing(path) as unfinished:
            unfinished.write_bytes(content)
    except OSError as error:
        raise RecordError(
            path,
            f"the file cannot be written ({error.strerror})",
            expected="a folder that exists and may be written to",
            mend="create the folder, or choose another place",
        ) from None


def record_bytes(record: Record, path: str | os.PathLike[str]) -> bytes:
    """Returns the content of a record's file in the format of the file's extension.

    Raises
    ------
    RecordError
        the extension is unknown, or the format does not allow a column name; it names the path.
    """
    path = Path(path)
    kind = format_of(path)
    columns: dict[str, npt.NDArray[np.float64]] = dict(record.columns)
    if record.time_s is not None:
        columns = {TIME: record.time_s, **columns}
    for name in columns if kind == "mat" else ():
        if not (name.isascii() and name.isidentifier() and name[0] != "_" and len(name) <= 63):
            raise RecordError(
                path,
                "MATLAB does not allow this name for a variable",
                column=name,
                expected="a letter, then letters, digits and underscores, 63 at most",
                mend="rename the column, or write another format",
            )
    return _encode(columns, kind)


def _encode(columns: dict[str, npt.NDArray[np.float64]], kind: Format) -> bytes:
    buffer = BytesIO()
    match kind:
        case "csv":
            return csv_text(columns).encode()
        case "csv.gz":
            # Without a time stamp, the same record always gives the same bytes.
            return gzip.compress(_encode(columns, "csv"), compresslevel=6, mtime=0)
        case "parquet":
            import polars as pl  # takes long, as does scipy

            pl.DataFrame(columns).write_parquet(buffer)
        case "mat":
            import scipy.io

            file: Any = buffer  # the stubs accept only paths; the function takes any binary file
            scipy.io.savemat(file, columns, oned_as="column", do_compression=True)
        case "npz":
            np.savez_compressed(buffer, **columns)  # type: ignore[arg-type]
    return buffer.getvalue()


def format_of(path: Path) -> Format:
    """Returns the format to write by the ending of the name, in upper or lower case.

    Raises
    ------
    RecordError
        the ending is unknown, or the package that writes the format is not installed.
    """
    for ending in FORMATS:
        if path.name.lower().endswith("." + ending):
            if ending == "parquet" and find_spec("polars") is None:
                raise missing_package(path, "polars", "writes")
            return ending
    raise unknown_ending(path, sorted(FORMATS))


def unknown_ending(
    path: Path,
    endings: Sequence[str],
    mend: str = "export or convert the record to one of these formats",
) -> RecordError:
    """Returns the error for a name with an ending that is none of those listed."""
    problem = (
        f"the extension '{path.suffix}' is not known" if path.suffix else "it has no extension"
    )
    listed = ", ".join("." + ending for ending in endings)
    return RecordError(path, problem, expected=f"one of {listed}", mend=mend)
