# SPDX-License-Identifier: MIT
"""The work of the steps, as functions that a worker process calls with plain values."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from ehsid.harness.base.encoding import json_text
from ehsid.harness.base.files import result_folder, write_text
from ehsid.harness.catalogue.channels import COMMAND, POSITION, TIME
from ehsid.harness.records import CHANNELS, Record, read_record
from ehsid.harness.rigs import Rig, read_rig

from .jobs import Report
from .reading import read_log
from .session import Entry, Session
from .so_far import forget, keep

if TYPE_CHECKING:
    from ehsid.harness.diagnosis.result import Stage

REMARKS = "check/remarks.json"
REQUIRED = (TIME, COMMAND, POSITION)


class Said(msgspec.Struct, frozen=True):
    """A remark of the gate on the data: of which record, what, and whether it forbids a fit."""

    record: str
    what: str
    serious: bool


def read_task(folder: Path, record_id: str, *, report: Report) -> None:
    """Reads a log of a session; see `read_log`."""
    session = Session(folder)
    entry = session.entry(record_id)
    if entry is not None:  # else it was removed meanwhile
        read_log(session, entry)
    report(1.0)


def check_task(folder: Path, *, report: Report) -> None:
    """Compares rig and records, as `ehsid rig check --out check`, and passes them by the gate."""
    from ehsid.harness.diagnosis.data.gate import gate
    from ehsid.harness.fitness import check_rig
    from ehsid.harness.show.rig_check_files import files_of, write_rig_check

    session = Session(folder)
    entries = session.settings.records
    out = folder / "check"
    with result_folder(out, "rig-check", files_of(len(entries)), _inputs(session)) as new:
        rig = read_rig(session.rig_file)
        records = [_read(session, entry, rig) for entry in entries]
        checks = []
        for number, record in enumerate(records, start=1):
            checks.append(check_rig(record, rig))
            report(0.8 * number / len(records))
        remarks = [Said(one.record, one.what, one.serious) for one in gate(records, rig)]
        write_rig_check(new, rig, checks)
    write_text(folder / REMARKS, json_text(remarks))
    report(1.0)


def gap_task(folder: Path, *, report: Report) -> None:
    """Diagnoses the gap, as `ehsid gap --out gap`, and keeps what is known so far."""
    from ehsid.harness.diagnosis import STAGES, Interim, diagnose
    from ehsid.harness.diagnosis.schema import RESULT_FILES
    from ehsid.harness.records.record import told_apart
    from ehsid.harness.show.diagnosis_files import write_diagnosis

    past: list[Stage] = []

    def watch(interim: Interim) -> None:
        keep(folder, interim, past)
        past.append(interim.stage)

    def begun(stage: Stage) -> None:
        report(0.0, STAGES[stage])

    session = Session(folder)
    forget(folder)
    with result_folder(folder / "gap", "gap", RESULT_FILES, _inputs(session)) as new:
        rig = read_rig(session.rig_file)
        entries = sorted(session.settings.records, key=lambda entry: entry.held_out)
        records = told_apart([_read(session, entry, rig) for entry in entries])
        fitted = sum(not entry.held_out for entry in entries)
        diagnosis = diagnose(
            records[:fitted],
            rig,
            validate=records[fitted:],
            progress=report,
            watch=watch,
            begun=begun,
        )
        report(1.0, "writing the report")
        write_diagnosis(new, diagnosis, records, str(session.rig_file))
    forget(folder)


def _inputs(session: Session) -> list[Path]:
    return [session.rig_file, *map(session.record_of, session.settings.records)]


def _read(session: Session, entry: Entry, rig: Rig) -> Record:
    path = session.record_of(entry)
    return read_record(path, columns=list(CHANNELS), required=REQUIRED, layout=rig.columns)
