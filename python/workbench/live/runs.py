# SPDX-License-Identifier: MIT
"""The runs of a workbench, each in a folder, and the one that goes on.

_live/run_1/settings.json     what the user chose
_live/run_1/told.json         what the run tells its pages
_live/run_1/samples.npy       its newest samples; only of the newest run
_live/run_1/hil/              the files of `ehsid hil`
_live/run_1/snapshots/        estimates that were stored
"""

from __future__ import annotations

import multiprocessing
import re
import shutil
import threading
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

from ehsid.harness.base.encoding import json_text, read_json
from ehsid.harness.base.files import free_folder, write_text
from ehsid.harness.rigs.published import published_text

from ..jobs import Job
from ..session import Session
from ..workbench import ERRORS, LIVE, Workbench
from .settings import LiveSettings, read_settings
from .task import RESULT, live_task
from .told import RING

SETTINGS = "settings.json"
# Files of a run that the page may fetch.
SERVED = re.compile(r"run_\d+/(hil/[\w.]+|snapshots/[\w.]+)")
LEAST_S = 1.0  # that a run has to end by itself when the program ends


class LiveRuns:
    """The runs; one at a time, which all pages show.

    Attributes
    ----------
    job
        the run that goes on, or ended last; None before the first one of this program.
    """

    def __init__(self, workbench: Workbench) -> None:
        self.workbench = workbench
        self.folder = workbench.folder / LIVE
        self.job: Job | None = None
        self._control: Connection | None = None
        self._lock = threading.Lock()

    @property
    def running(self) -> bool:
        """Whether a run goes on."""
        return self.job is not None and self.job.running

    def latest(self) -> Path | None:
        """Returns the folder of the newest run; None without any."""
        found = {
            int(path.name.removeprefix("run_")): path
            for path in self.folder.glob("run_*")
            if re.fullmatch(r"run_[1-9]\d*", path.name)
        }
        return found[max(found)] if found else None

    def settings(self) -> LiveSettings:
        """Returns the settings of the newest run; those of the form at first without any."""
        latest = self.latest()
        kept = None if latest is None else read_json(latest / SETTINGS, LiveSettings)
        return kept or LiveSettings()

    def start(self, settings: LiveSettings) -> None:
        """Starts a run; while one goes on, nothing happens.

        Raises
        ------
        ValueError
            a setting has no sense.
        """
        read_settings(settings)
        with self._lock:
            if self.running:
                return
            for ring in self.folder.glob(f"run_*/{RING}"):
                ring.unlink()
            folder = free_folder(self.folder, "run")
            write_text(folder / SETTINGS, json_text(settings))
            heard, self._control = multiprocessing.get_context("spawn").Pipe(duplex=False)
            self.job = Job(
                f"run {folder.name.removeprefix('run_')}",
                live_task,
                folder,
                settings,
                heard,
                log=self.folder / ERRORS,
                changed=lambda: None,  # pages look by themselves
            )
            heard.close()

    def wish(self, *words: str) -> None:
        """Sends a wish to the run that goes on; see `Wishes`."""
        control = self._control
        if self.running and control is not None:
            with suppress(OSError):  # it has just ended
                control.send(words)

    def stop(self, *, begun: bool) -> None:
        """Ends the run: with its samples as the result where it has begun, else at once."""
        job = self.job
        if begun:
            self.wish("stop")
        elif job is not None:
            job.cancel()

    def make_machine(self, name: str) -> Session:
        """Begins a session with the record and the rig of the newest run.

        Raises
        ------
        ValueError
            the run has no record.
        """
        latest = self.latest()
        record = None if latest is None else latest / RESULT / "record.csv"
        if latest is None or record is None or not record.exists():
            raise ValueError(
                "there is no record of a whole run: expected one that has ended; start a run, and "
                "wait for its end or stop it"
            )
        session = self.workbench.begun(name)
        logs = session.folder / "logs"
        logs.mkdir(exist_ok=True)
        log = logs / f"{latest.name}.csv"
        shutil.copyfile(record, log)
        session.rig_file.write_text(rig_text(self.settings().rig), encoding="utf-8")
        self.workbench.read(session, session.add(log))
        return session

    def close(self) -> None:
        """Ends the run, with its samples as the result where that takes only a moment."""
        job = self.job
        if job is not None and job.running:
            self.wish("stop")
            job.wait(LEAST_S)
            if job.running:
                job.cancel()


def rig_text(path: str) -> str:
    """Returns the text of a rig file; "" stands for the rig of the published experiment."""
    if path.strip():
        return Path(path.strip()).expanduser().read_text(encoding="utf-8")
    return published_text()
