# SPDX-License-Identifier: MIT
"""Reads records from files and from memory."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace

from .. import records
from ..catalogue.channels import TIME
from ..records import NO_HINTS, Hints, read_record
from ..records.in_memory import record_of_columns
from ..records.mapping import parse_maps
from .frames import Columns, columns_of
from .record import Record
from .wording import in_python, log_reading

Source = str | os.PathLike[str] | Columns | Record | records.Record
"""What is taken for a record: a path, columns in memory, or a record."""


def read(
    source: Source,
    *,
    maps: Mapping[str, str] | None = None,
    dt_s: float | None = None,
    name: str | None = None,
) -> Record:
    """Reads and checks a record, from a file of any kind or from memory.

    Columns with the names of the schema (docs/records.md) are taken as they are. In every other
    layout the channels are found by names, units and ranges; the logger `ehsid` tells what was
    taken for what, and `Record.summary` does so, too.

    Parameters
    ----------
    source
        path of a log; columns in memory: a mapping of arrays of shape (n,) by name, or a DataFrame
        of polars or pandas; or a record, to be resampled or renamed.
    maps
        columns for channels, with their units: {"position_m": "Weg [mm]"}.
    dt_s
        sampling time in seconds, above 0: of rows without time, else that to which the record is
        resampled.
    name
        name of the record; without it the stem of the file, or "record".

    Raises
    ------
    ValueError
        the source has a problem; the message says where, what was expected, and how to mend it.

    Examples
    --------
    >>> import ehsid
    >>> ehsid.read("examples/data/hydraulic_crane.csv")
    <ehsid.Record: hydraulic_crane, 1024 samples, no time; sample, valve_opening, oil_pressure>
    >>> log = {"Weg": [10.0, 10.5, 11.5], "u": [0.0, 1.0, 1.0]}
    >>> ehsid.read(log, maps={"position_m": "Weg [mm]", "command_v": "u"}, dt_s=0.001)
    <ehsid.Record: record, 3 samples, every 0.001 s; command_v in V, position_m in m>
    """
    with in_python():
        hints = hints_of(maps, dt_s)
        result = _result(source, hints, name or "record")
    if name is not None:
        result = replace(result, name=name)
    log_reading(result)
    return Record(result)


def _result(source: Source, hints: Hints, name: str) -> records.Record:
    if isinstance(source, str | os.PathLike):
        return read_record(source, required=(), hints=hints)
    if not isinstance(source, Record | records.Record):
        return record_of_columns(columns_of(source), hints=hints, name=name)
    record = record_of(source)
    if not hints:
        return record
    time_s = {} if record.time_s is None else {TIME: record.time_s}
    made = record_of_columns({**time_s, **record.columns}, hints=hints, name=record.name)
    return replace(made, source=record.source)


def hints_of(maps: Mapping[str, str] | None, dt_s: float | None) -> Hints:
    """Returns what the caller says about a log.

    Raises
    ------
    ValueError
        a map names no channel or no unit of it, or the sampling time is not above 0.
    """
    if dt_s is not None and not 0.0 < dt_s < float("inf"):
        raise ValueError(f"dt_s = {dt_s:g}: expected a sampling time in seconds, above 0")
    if not maps and dt_s is None:
        return NO_HINTS
    texts = [f"{channel}={column}" for channel, column in (maps or {}).items()]
    return Hints(parse_maps(texts, "maps"), dt_s)


def record_of(source: Source) -> records.Record:
    """Returns a record as the rooms have it, of whatever is taken for one.

    Raises
    ------
    ValueError
        as `read`.
    """
    if isinstance(source, records.Record):
        return source
    return source.result if isinstance(source, Record) else read(source).result
