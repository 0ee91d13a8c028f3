# SPDX-License-Identifier: MIT
"""How a log was read: its columns as they are, and the record that was made of them."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np

from ehsid.harness.base.encoding import json_text, read_json
from ehsid.harness.base.files import result_files, write_text
from ehsid.harness.catalogue.channels import TIME
from ehsid.harness.records import Hints, Record, RecordError
from ehsid.harness.records.log import Log
from ehsid.harness.records.mapping import parse_maps
from ehsid.harness.records.reading import open_unread, read_record
from ehsid.harness.records.record import record_bytes

from .downsampling import make_pyramid, store
from .session import Entry, Session

MOST_COLUMNS = 64  # of a log, that are drawn
RAW, MADE = "raw", "record"
FILE = "reading.json"


class LogColumn(msgspec.Struct, frozen=True):
    """A column of a log as it is."""

    name: str
    unit: str
    """As the log has them; the unit is "" where it has none."""
    size: int
    """Number of values."""
    low: float | None = None
    high: float | None = None
    """The smallest and the largest number; None where there is none."""
    key: str = ""
    """Of its pyramid among the files; "" where it cannot be drawn."""


class Reading(msgspec.Struct, frozen=True):
    """How a log was read."""

    told: str
    """Digest of what the user said about the log; see `Entry.told`."""
    kind: str = ""
    """What the file was taken for; "" where it cannot be opened."""
    columns: list[LogColumn] = []
    """Of the log."""
    problem: str = ""
    """Why there is no record; "" where there is one."""
    taken: list[tuple[str, str, str, str, str]] = []
    """Rows of the table of columns: column, taken for, unit, factor, why."""
    remarks: list[str] = []
    """Sentences on what was changed, left out or guessed."""
    channels: list[str] = []
    """Columns of the record, in their order; the pyramid of number i has the key "record_i"."""
    samples: int = 0
    dt_s: float | None = None
    pieces: int = 1
    """Size of the record, its sampling time, and the number of pieces without a gap."""


def reading_of(session: Session, entry: Entry) -> Reading | None:
    """Returns how a log was read the last time; None if it was not yet."""
    return read_json(session.look_of(entry) / FILE, Reading)


def read_alike(session: Session, entry: Entry) -> list[Entry]:
    """Returns the other records whose logs have columns of the same names and the same choices."""
    reading = reading_of(session, entry)
    if reading is None:
        return []
    names = [column.name for column in reading.columns]
    others = [one for one in session.settings.records if one is not entry]
    readings = [(one, reading_of(session, one)) for one in others if one.maps == entry.maps]
    return [
        one
        for one, read in readings
        if read is not None and names == [column.name for column in read.columns]
    ]


def hints_of(entry: Entry) -> Hints:
    """Returns what the user says about a log.

    Raises
    ------
    ValueError
        a column or its unit cannot be read.
    """
    maps = parse_maps([f"{channel}={column}" for channel, column in entry.maps.items()], "column")
    return Hints(maps, entry.dt_s)


def read_log(session: Session, entry: Entry) -> Reading:
    """Reads a log, keeps it as a record as `ehsid import` does, and writes down how it was read.

    A log that is no record is drawn all the same: its problem is in the reading.
    """
    folder = session.look_of(entry)
    folder.mkdir(parents=True, exist_ok=True)
    path, target = session.log_of(entry), session.record_of(entry)
    try:
        log = open_unread(path)
    except RecordError as error:
        reading = Reading(entry.told(), problem=str(error))
    else:
        kind, columns = log.kind, _columns(log, folder)
        try:
            target.parent.mkdir(exist_ok=True)
            with result_files(target, "import", inputs=[path]) as new:
                record = read_record(path, required=(), hints=hints_of(entry))
                (new / target.name).write_bytes(record_bytes(record, target.name))
            reading = _of_record(record, entry, kind, columns, folder)
        except ValueError as error:
            reading = Reading(entry.told(), kind, columns, problem=str(error))
    if reading.problem:
        target.unlink(missing_ok=True)
    write_text(folder / FILE, json_text(reading))
    return reading


def _columns(log: Log, folder: Path) -> list[LogColumn]:
    """Returns the columns of a log, and stores those that can be drawn."""
    columns = []
    for number, series in enumerate(log.series[:MOST_COLUMNS]):
        unit, key = series.unit or "", f"{RAW}_{number}"
        try:
            values = series.read()
        except ValueError:  # text among the numbers; the reading of the record says where
            columns.append(LogColumn(series.name, unit, series.size))
            continue
        finite = values[np.isfinite(values)]
        if not finite.size:
            columns.append(LogColumn(series.name, unit, series.size))
            continue
        store(make_pyramid(np.where(np.isfinite(values), values, np.nan)), folder, key)
        low, high = float(finite.min()), float(finite.max())
        columns.append(LogColumn(series.name, unit, series.size, low, high, key))
    return columns


def _of_record(
    record: Record, entry: Entry, kind: str, columns: list[LogColumn], folder: Path
) -> Reading:
    for number, values in enumerate(record.columns.values()):
        store(make_pyramid(values), folder, f"{MADE}_{number}")
    if record.time_s is not None:
        np.save(folder / f"{TIME}.npy", record.time_s)
    origin = record.origin
    return Reading(
        entry.told(),
        kind if origin is None else origin.kind,
        columns,
        taken=[] if origin is None else origin.rows(),
        remarks=[] if origin is None else list(origin.remarks),
        channels=list(record.columns),
        samples=len(record),
        dt_s=record.dt_s,
        pieces=len(record.segments),
    )
