# SPDX-License-Identifier: MIT
"""The runs of a workbench, each in a folder, and the one that goes on.

_live/run_1/settings.json     what the user chose
_live/run_1/status.json       what the run tells its pages
_live/run_1/samples.npy       its newest samples; only of the newest run
_live/run_1/hil/              the files of `ehsid hil`
_live/run_1/snapshots/        estimates that were stored

What the user requests during a run, as it comes through the pipe from the page.

The work of a run, in a process of its own: what `ehsid hil` does, watched and steered.
"""

from __future__ import annotations

import multiprocessing
import re
import shutil
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import ehsid
from ehsid.harness.base.encoding import json_text, read_json
from ehsid.harness.base.files import free_folder, result_folder, write_text
from ehsid.harness.firmware.configuration import EstimatorConfiguration
from ehsid.harness.rigs.new import published_text
from ehsid.harness.signals.simulation.run import OUTPUTS_OF, prepare
from ehsid.hil.comparison import compare
from ehsid.hil.configuration import ENDING, read_snapshot, restored, write_snapshot
from ehsid.hil.faults import OnRequest, relayed
from ehsid.hil.frames import HilError
from ehsid.hil.host_target import HostTarget
from ehsid.hil.messages import Stopped
from ehsid.hil.page import UNFINISHED, copy_samples, file_names, write_reports
from ehsid.hil.plan import Plan
from ehsid.hil.result_file import Provenance
from ehsid.hil.run import RunResult, run_plan
from ehsid.hil.session import Session as HilSession
from ehsid.hil.transport import EmulatedDevice, Line, SocketDevice, open_line

from ..jobs import Job
from ..session import Session
from ..workbench import ERRORS, LIVE, Workbench
from .effects import machine_words
from .settings import HERE, TARGETS, LiveSettings, Wanted, read_settings
from .watching import FAULTS, RING, RunStatus, Watch, throttled, write_status

SNAPSHOTS = "snapshots"


@dataclass(frozen=True)
class Target:
    """A target, and what can be done to it; faults only where the line is not a serial port."""

    line: Line | None = None
    """Open line to it; None for this computer."""
    faults: OnRequest | None = None
    reset_board: Callable[[], None] | None = None


class Requests:
    """Carries out requests between two samples; see `Steer`.

    A request that cannot be carried out is told among the events, and the run goes on.
    """

    def __init__(
        self,
        folder: Path,
        control: Connection,
        status: RunStatus,
        watch: Watch,
        plan: Plan,
        target: Target,
    ) -> None:
        self._folder, self._control, self._status = folder, control, status
        self._watch, self._plan, self._target = watch, plan, target

    def __call__(self, number: int) -> EstimatorConfiguration | Mapping[str, float] | None:
        """Carries out what has come before a sample.

        What stands behind a request for this sample waits for the next one, so that all that the
        events tell has happened.
        """
        del number
        request = None
        while request is None and self._control.poll():
            kind, *values = self._control.recv()
            if kind == "stop":
                raise Stopped
            try:
                request = self._carry_out(kind, values)
            except (ValueError, OSError) as error:
                self._tell(str(error))
        if isinstance(request, EstimatorConfiguration):
            self._watch.begin(request)
        return request

    def _tell(self, words: str) -> None:
        self._status.event(self._watch.time_s, words)
        write_status(self._folder, self._status)

    def _carry_out(
        self, kind: str, values: list[Any]
    ) -> EstimatorConfiguration | Mapping[str, float] | None:
        start, faults = self._plan.configuration.estimator, self._target.faults
        match kind, values:
            case "reset", []:
                self._tell("The estimator begins anew.")
                return start
            case "machine", [sizes]:
                changed: dict[str, float] = sizes
                prepare(self._plan.rig, dt_s=self._plan.dt_s, values=changed)  # may refuse them
                self._status.machine = changed
                self._tell(f"The machine: {machine_words(changed)}.")
                return changed
            case "snapshot", []:
                self._store()
            case "restore", [name]:
                request = restored(read_snapshot(self._folder / SNAPSHOTS / name), start)
                self._tell(f"The estimator goes on from {name}.")
                return request
            case "fault", [fault, direction] if faults is not None:
                faults.ask(fault, direction)
                self._tell(f"Fault: {FAULTS[fault]}, on the way {direction}.")
            case "reset board", [] if self._target.reset_board is not None:
                self._target.reset_board()
                self._tell("The board was reset.")
        return None

    def _store(self) -> None:
        if self._watch.samples == 0:
            raise HilError("no snapshot: there is no sample yet; wait for the first one")
        folder = self._folder / SNAPSHOTS
        folder.mkdir(exist_ok=True)
        name = f"{len(self._status.snapshots) + 1}_at_{self._watch.time_s:.2f}_s{ENDING}"
        write_snapshot(folder / name, self._watch.snapshot())
        self._status.snapshots = [*self._status.snapshots, name]
        self._tell(f"The estimate is stored as snapshots/{name}.")


RESULT = "hil"
REPORT_EVERY_S = 0.2
HOLD_S = 1.0  # of a frame that is delayed: longer than the host waits, and than the watchdog


def live_task(
    folder: Path,
    settings: LiveSettings,
    control: Connection,
    *,
    report: Callable[[float], None],
) -> None:
    """Carries out a run in a folder, as `ehsid hil --out hil`.

    Parameters
    ----------
    folder
        folder of the run.
    settings
        what the user has chosen.
    control
        brings the requests of the user.
    report
        told the share of the samples that are done.
    """
    began = time.monotonic()
    status = RunStatus(phase="The run is being prepared.")
    write_status(folder, status)
    wanted = read_settings(settings)
    plan = wanted.run.plan(wanted.rig)
    status.machine = dict(plan.values)
    out = folder / RESULT
    with result_folder(out, "hil", file_names([""]), _inputs(settings, wanted)) as new:
        samples = free_folder(out, UNFINISHED)
        try:
            with _opened(wanted, settings.machine) as target:
                run, session = _run(
                    folder, plan, settings, target, samples, status, control, report
                )
        finally:
            with suppress(OSError):  # has samples
                samples.rmdir()
        status.phase = "The report is being written."
        write_status(folder, status)
        assert session.identity is not None
        provenance = Provenance(
            ehsid_version=ehsid.__version__,
            rig=settings.rig.strip() or "published",
            actual=None,
            effects=dict(wanted.run.values),
            line=_line_words(settings, wanted),
            loop="position" if settings.position_control else "open",
            seed=wanted.run.signal.seed,
            seconds=round(time.monotonic() - began, 1),
        )
        name = type(plan.configuration.estimator.forgetting).__name__
        write_reports(new, session.identity, [(name, run, compare(run))], provenance)
        copy_samples(samples, new)
    shutil.rmtree(samples, ignore_errors=True)
    status.phase = "The run has ended."
    write_status(folder, status)
    report(1.0)


def _line_words(settings: LiveSettings, wanted: Wanted) -> str:
    image = f"{wanted.image} in QEMU, {settings.machine}"
    return wanted.address or (TARGETS[HERE] if settings.target == HERE else image)


def _inputs(settings: LiveSettings, wanted: Wanted) -> list[Path]:
    rig = [Path(settings.rig).expanduser()] if settings.rig.strip() else []
    return [*rig, *([] if wanted.image is None else [wanted.image])]


@contextmanager
def _opened(wanted: Wanted, machine: str) -> Iterator[Target]:
    """Opens the line to the target; between two sockets stands a relay that can disturb it."""
    address = wanted.address or ""
    if wanted.image is None and not address:
        yield Target()
        return
    if wanted.image is None and not address.lower().startswith("socket://"):
        with open_line(address, wanted.baud) as line:
            yield Target(line)
        return
    emulated = None if wanted.image is None else EmulatedDevice(wanted.image, machine)
    faults = OnRequest(HOLD_S)
    with relayed(emulated or SocketDevice(address)) as relay:
        relay.disturb(faults)
        try:
            with open_line(relay.port) as line:
                yield Target(line, faults, None if emulated is None else emulated.reset)
        except HilError as error:
            # The user knows the address of the target, and not that of the relay.
            words = str(error).replace(relay.port, address or "the emulator")
            why = "" if emulated is None else emulated.why_gone()
            raise HilError(f"{why} ({words})" if why else words) from error


def _run(
    folder: Path,
    plan: Plan,
    settings: LiveSettings,
    target: Target,
    samples: Path,
    status: RunStatus,
    control: Connection,
    report: Callable[[float], None],
) -> tuple[RunResult, HilSession]:
    estimator = plan.configuration.estimator
    status.phase = "The target is asked who it is."
    status.rig, status.samples, status.dt_s = plan.rig.name, plan.samples, plan.dt_s
    status.parameters = list(estimator.orders.names)
    status.position_control = settings.position_control
    status.faults, status.board_reset = target.faults is not None, target.reset_board is not None
    write_status(folder, status)
    outputs = OUTPUTS_OF[plan.rig.plant]
    with Watch(folder, samples, outputs, plan, target.line) as watch:

        def event(words: str) -> None:
            status.event(watch.time_s, words)
            write_status(folder, status)

        session = HostTarget() if target.line is None else HilSession(target.line, on_event=event)
        identity = session.hello()
        status.board, status.firmware = identity.board, ".".join(map(str, identity.firmware))
        status.phase = "The run goes on."
        write_status(folder, status)
        share = throttled(report, REPORT_EVERY_S)
        requests = Requests(folder, control, status, watch, plan, target)
        try:
            run = run_plan(
                plan,
                session,
                watch,
                real_time=settings.real_time,
                progress=lambda done, *_: share(done / plan.samples),
                steer=requests,
            )
        except HilError as error:
            if watch.samples == 0:
                raise
            raise HilError(
                f"{error}; {samples} holds the {watch.samples} samples before"
            ) from error
    return run, session


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

    def request(self, *words: object) -> None:
        """Sends a request to the run that goes on; see `Requests`."""
        control = self._control
        if self.running and control is not None:
            with suppress(OSError):  # it has just ended
                control.send(words)

    def stop(self, *, begun: bool) -> None:
        """Ends the run: with its samples as the result where it has begun, else at once."""
        job = self.job
        if begun:
            self.request("stop")
        elif job is not None:
            job.cancel()

    def make_machine(self) -> Session:
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
        session = self.workbench.begun("")
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
            self.request("stop")
            job.wait(LEAST_S)
            if job.running:
                job.cancel()


def rig_text(path: str) -> str:
    """Returns the text of a rig file; "" stands for the rig of the published experiment."""
    if path.strip():
        return Path(path.strip()).expanduser().read_text(encoding="utf-8")
    return published_text()
