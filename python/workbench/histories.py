# SPDX-License-Identifier: MIT
"""Histories of machines over months: what `ehsid watch` makes of a folder of dated logs.

_histories/press7.json   what the user chose
_histories/press7/       the history, where none was named
"""

from __future__ import annotations

import functools
import multiprocessing
import signal
import sys
import threading
import warnings
from collections.abc import Iterator
from contextlib import closing, contextmanager
from multiprocessing.synchronize import Event
from pathlib import Path

import msgspec

from ehsid.harness.base.encoding import json_text, read_json
from ehsid.harness.base.files import result_folder, write_text
from ehsid.harness.records import CHANNELS, NO_HINTS, Hints, Record, read_record
from ehsid.harness.rigs import Rig
from ehsid.harness.watch.store import FILE
from ehsid.harness.watch.watching import Watch, logs_in

from .jobs import REQUIRED, Job, Report
from .reading import hints_of
from .session import Entry, free_name, safe_name
from .workbench import ERRORS, HISTORIES, Workbench

PAGE, NUMBERS = "watch.html", "watch.json"


class HistoryChoice(msgspec.Struct, frozen=True):
    """What a history is made of."""

    logs: str = ""
    """Folder of the dated logs; "" where the history is only shown."""
    machine: str = ""
    """Session whose rig file and columns are taken; "" takes the rig.toml beside the logs."""
    out: str = ""
    """Folder of a history that is somewhere else; "" keeps it with the workbench."""


class Histories:
    """The histories of a workbench, and the one that is at work."""

    def __init__(self, workbench: Workbench) -> None:
        self.workbench = workbench
        self.folder = workbench.folder / HISTORIES
        self._jobs: dict[str, tuple[Job, Event]] = {}
        self._lock = threading.Lock()

    def names(self) -> list[str]:
        """Returns the names, that of the history that was chosen last in front."""
        files = self.folder.glob("*.json")
        return [path.stem for path in sorted(files, key=_changed_at, reverse=True)]

    def choice(self, name: str) -> HistoryChoice:
        """Returns what a history is made of."""
        return read_json(self.folder / f"{name}.json", HistoryChoice) or HistoryChoice()

    def result(self, name: str) -> Path:
        """Returns the folder with the files of a history."""
        out = self.choice(name).out
        return Path(out) if out else self.folder / name

    def told(self, name: str) -> Watch | None:
        """Returns what a history tells; None before it was told for the first time."""
        return read_json(self.result(name) / NUMBERS, Watch)

    def job(self, name: str) -> Job | None:
        """Returns the work for a history that goes on, or ended last."""
        return self._jobs[name][0] if name in self._jobs else None

    def show(self, out: str) -> str:
        """Adds a history that `ehsid watch` has made, and returns its name.

        Raises
        ------
        ValueError
            there is none in the folder.
        """
        place = _folder(
            out, "folder of the history", "the folder that --out of 'ehsid watch' named"
        )
        watch = read_json(place / NUMBERS, Watch)
        if watch is None or not (place / PAGE).is_file():
            raise ValueError(
                f"{place}: has no history: expected {PAGE} and {NUMBERS} of this version of ehsid; "
                "name the folder that --out of 'ehsid watch' named, or give the folder of the logs "
                "to make one"
            )
        name = watch.machines[0].name if len(watch.machines) == 1 else place.name
        return self._kept(HistoryChoice(out=str(place)), name)

    def start(self, choice: HistoryChoice) -> str:
        """Starts to fit the logs that are new, and returns the name of the history.

        Raises
        ------
        ValueError
            the logs, the rig or the history cannot be used, or another history is at work.
        """
        logs = _folder(choice.logs, "folder of dated logs", "one with logs such as 2026-03-17.csv")
        place = str(Path(choice.out).expanduser().resolve()) if choice.out.strip() else ""
        rig, entry = self._machine(choice.machine)
        logs_in(logs, rig_file=rig)  # before anything is written
        if place and Path(place).is_relative_to(logs):
            raise ValueError(
                f"{place}: lies in the folder of the logs: expected one outside of it; name "
                "another folder, or leave it empty"
            )
        with self._lock:
            for name, (job, _) in self._jobs.items():
                if job.running:
                    raise ValueError(
                        f"{name}: its logs are being fitted: expected one history at work; stop "
                        "it, or wait for its end"
                    )
            made = HistoryChoice(str(logs), choice.machine, place)
            name = self._kept(made, logs.name)
            out = self.result(name)
            out.mkdir(parents=True, exist_ok=True)
            stop = multiprocessing.get_context("spawn").Event()
            job = Job(
                f"fitting the logs of {name}",
                history_task,
                *(logs, rig, entry, out, stop),
                log=self.workbench.folder / ERRORS,
                changed=lambda: None,  # pages look by themselves
            )
            self._jobs[name] = job, stop
        return name

    def stop(self, name: str) -> None:
        """Ends the work for a history behind the log that is done next; what is fitted stays."""
        if name in self._jobs:
            self._jobs[name][1].set()

    def close(self) -> None:
        """Ends the work at once; what is fitted stays."""
        for job, _ in self._jobs.values():
            if job.running:
                job.cancel()

    def _machine(self, name: str) -> tuple[Path | None, Entry | None]:
        """Returns the rig file of a session, and a record that says how its logs are read."""
        if not name:
            return None, None
        session = self.workbench.opened(name)
        return session.rig_file, next(iter(session.settings.records), None)

    def _kept(self, choice: HistoryChoice, name: str) -> str:
        """Writes a choice down, in place of an earlier one of the same folders."""
        self.folder.mkdir(exist_ok=True)
        known = {one: self.choice(one) for one in self.names()}
        same = [
            one
            for one, other in known.items()
            if other.out == choice.out and (choice.out or other.logs == choice.logs)
        ]
        if same and not choice.logs:
            choice = known[same[0]]
        kept = same[0] if same else free_name(safe_name(name), set(known))
        write_text(self.folder / f"{kept}.json", json_text(choice))
        return kept


def _folder(text: str, what: str, expected: str) -> Path:
    if not text.strip():
        raise ValueError(f"{what}: nothing is given: expected {expected}; fill it in")
    return Path(text.strip()).expanduser().resolve()


def _changed_at(path: Path) -> float:
    return path.stat().st_mtime


@contextmanager
def _ended_in_order() -> Iterator[None]:
    """Lets a cancel reach the ends of blocks: workers without a parent leave warnings behind."""
    before = signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@_ended_in_order()
def history_task(
    logs: Path, rig: Path | None, entry: Entry | None, out: Path, stop: Event, *, report: Report
) -> None:
    """Fits the logs that are new and tells the history, as `ehsid watch LOGS --out OUT`.

    Parameters
    ----------
    logs
        folder of the dated logs.
    rig
        rig file; None: that beside the logs.
    entry
        record as which the logs are read; None: as the rig file says.
    out
        folder of the history.
    stop
        set where no further log is to be fitted; the history is told all the same.
    """
    from ehsid.harness.show.watch_page import FILES, write_watch
    from ehsid.harness.watch.store import opened
    from ehsid.harness.watch.watching import fit_and_keep, new_logs, told_of

    machines = logs_in(logs, rig_file=rig)
    hints = NO_HINTS if entry is None else hints_of(entry)
    # Said by joblib of a stop, in the terminal of the workbench.
    warnings.filterwarnings("ignore", r"\d+ tasks which were", UserWarning)
    words = "No log was new."
    with opened(out / FILE) as history:
        new = new_logs(machines, history)
        with closing(fit_and_keep(new, history, functools.partial(_read, hints=hints))) as fits:
            for count, fitted in enumerate(fits, 1):
                words = f"{count} of {len(new)} new logs fitted and kept"
                report(count / len(new), f"{words}; the last one was {fitted.log.path.name}")
                if stop.is_set() and count < len(new):
                    words = f"Stopped: {words}; a new start goes on with the others"
                    break
            words = words.rstrip(".") + "."
        watch = told_of(machines, history)
    with result_folder(out, "watch", FILES) as made:
        write_watch(watch, made)
    report(1.0, words)


def _read(path: Path, rig: Rig, hints: Hints) -> Record:
    return read_record(
        path, columns=list(CHANNELS), required=REQUIRED, layout=rig.columns, hints=hints
    )
