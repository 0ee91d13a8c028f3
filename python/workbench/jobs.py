# SPDX-License-Identifier: MIT
"""Work in processes of its own: with progress, to be cancelled, and ended with the program.

A job that is lost, because its process was killed or ran out of memory, says so in words.

The work of the steps, as functions that a worker process calls with plain values.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from enum import StrEnum
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import msgspec

from ehsid.harness.base.encoding import json_text
from ehsid.harness.base.error_words import error_words
from ehsid.harness.base.files import result_folder, write_text
from ehsid.harness.base.parallel import end_with, end_workers
from ehsid.harness.base.time_to_go import TimeToGo
from ehsid.harness.catalogue.channels import COMMAND, POSITION, TIME
from ehsid.harness.records import CHANNELS, Record, read_record
from ehsid.harness.rigs import Rig, read_rig

from .reading import read_log
from .session import Entry, Session
from .so_far import forget, keep, keep_found

if TYPE_CHECKING:
    from ehsid.harness.diagnosis.result import Stage


END_S = 3.0  # that a worker has to end by itself


# A function of a module; called with its arguments, and with `report`: see `Report`.
Task = Callable[..., None]


class Report(Protocol):
    """What a task tells while it is at work."""

    def __call__(self, share: float, stage: str = "") -> None:
        """Tells the share that is done, 0 to 1, and what is done now; "" where that is the same."""


class State(StrEnum):
    """Where a job is."""

    running = "running"
    done = "done"
    failed = "failed"
    cancelled = "cancelled"
    lost = "lost"


class Job:
    """A task in a process of its own.

    Attributes
    ----------
    what
        what is done, in words.
    state
        where it is.
    share
        of the work that is done, 0 to 1.
    stage
        what is done now, in words; "" where the task does not tell.
    message
        why it failed or was lost; "" otherwise.
    """

    def __init__(
        self, what: str, task: Task, *args: Any, log: Path, changed: Callable[[], None]
    ) -> None:
        """Starts the work.

        Parameters
        ----------
        what
            what is done, in words.
        task, args
            function of a module and its arguments, which are sent to the process.
        log
            file to which the traceback of a fault of the program is added.
        changed
            called in a thread after every change.
        """
        self.what = what
        self.state = State.running
        self.share = 0.0
        self.stage = ""
        self.message = ""
        self._began = time.monotonic()
        self._ended: float | None = None
        self._to_go = TimeToGo()
        self._changed = changed
        self._lock = threading.Lock()
        context = multiprocessing.get_context("spawn")
        receiver, sender = context.Pipe(duplex=False)
        self._process = context.Process(
            target=_work, args=(sender, task, args, log, os.getpid()), daemon=False
        )
        self._process.start()
        sender.close()  # so that the end of the process ends the pipe
        self._watcher = threading.Thread(target=self._watch, args=(receiver,), daemon=True)
        self._watcher.start()

    @property
    def running(self) -> bool:
        """Whether it is still at work."""
        return self.state is State.running

    @property
    def pid(self) -> int | None:
        """Number of its process."""
        return self._process.pid

    @property
    def seconds(self) -> float:
        """Time since the start, or that the job took."""
        return (self._ended or time.monotonic()) - self._began

    @property
    def left_s(self) -> float | None:
        """Time to go, in seconds; None where it cannot be told."""
        return self._to_go.left_s if self.running else None

    def cancel(self) -> None:
        """Ends the process; its results are left as they were before."""
        self._end(State.cancelled, "")
        self._process.terminate()
        self._process.join(END_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()

    def wait(self, timeout_s: float | None = None) -> None:
        """Waits for the end."""
        self._watcher.join(timeout_s)

    def _watch(self, receiver: Connection) -> None:
        while True:
            try:
                kind, value = receiver.recv()
            except (EOFError, OSError):
                break
            if kind == "share":
                self._advance(*value)
            else:
                self._end(State(kind), value)
        self._process.join()
        code = self._process.exitcode
        why = f"signal {-code}" if code is not None and code < 0 else f"exit code {code}"
        self._end(
            State.lost,
            f"{self.what}: the process that did the work has ended ({why}). Usually the memory of "
            "this machine was not enough, or someone has ended the process. Earlier results are "
            "unchanged; start it again, with shorter records if it happens again.",
        )

    def _advance(self, share: float, stage: str) -> None:
        if self.running:
            self.stage = stage or self.stage
            self.share = max(self.share, min(1.0, share))
            self._to_go.update(self.share)
            self._changed()

    def _end(self, state: State, message: str) -> None:
        """Sets the final state; the first one stays."""
        with self._lock:
            if not self.running:
                return
            self._ended = time.monotonic()
            self.message = message
            self.share = 1.0 if state is State.done else self.share
            self.state = state
        self._changed()


def _work(sender: Connection, task: Task, args: tuple[Any, ...], log: Path, parent: int) -> None:
    """Does the task in the new process and sends how it goes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that started it
    end_with(parent)

    def report(share: float, stage: str = "") -> None:
        sender.send(("share", (float(share), stage)))

    try:
        task(*args, report=report)
        sender.send((str(State.done), ""))
    except Exception as error:
        words = error_words(error)
        if words is None:
            with suppress(OSError), log.open("a", encoding="utf-8") as file:
                file.write(traceback.format_exc())
            words = (
                f"a fault of the program ({type(error).__name__}), which is not due to your data. "
                f"{log} has what its authors need to mend it."
            )
        with suppress(OSError):
            sender.send((str(State.failed), words))
    finally:
        end_workers()


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
    from ehsid.harness.show.rig_check import files_of, write_rig_check

    from .check_look import keep_speeds

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
    keep_speeds(session, checks)
    write_text(folder / REMARKS, json_text(remarks))
    report(1.0)


def gap_task(folder: Path, *, report: Report) -> None:
    """Diagnoses the gap, as `ehsid gap --out gap`, and keeps what is known so far."""
    from ehsid.harness.diagnosis import STAGES, Interim, diagnose
    from ehsid.harness.diagnosis.schema import RESULT_FILES
    from ehsid.harness.records.record import told_apart
    from ehsid.harness.show.gap_page import write_diagnosis

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
    keep_found(folder, diagnosis.runs)
    forget(folder)


def _inputs(session: Session) -> list[Path]:
    return [session.rig_file, *map(session.record_of, session.settings.records)]


def _read(session: Session, entry: Entry, rig: Rig) -> Record:
    path = session.record_of(entry)
    return read_record(path, columns=list(CHANNELS), required=REQUIRED, layout=rig.columns)
