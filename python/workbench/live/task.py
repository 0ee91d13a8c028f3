# SPDX-License-Identifier: MIT
"""The work of a run, in a process of its own: what `ehsid hil` does, watched and steered."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

import ehsid
from ehsid.harness.base.files import free_folder, result_folder
from ehsid.harness.signals.simulation.outputs import OUTPUTS_OF
from ehsid.hil.comparison import compare
from ehsid.hil.devices import EmulatedDevice, SocketDevice
from ehsid.hil.errors import HilError
from ehsid.hil.faults import OnRequest
from ehsid.hil.plan import Plan
from ehsid.hil.relay import relayed
from ehsid.hil.report_files import UNFINISHED, copy_samples, file_names, write_reports
from ehsid.hil.result_file import Provenance
from ehsid.hil.run import RunResult, run_plan
from ehsid.hil.session import Session
from ehsid.hil.transport import Line, open_line

from .settings import LiveSettings, Wanted, read_settings
from .told import Told, write_told
from .watching import Watch, throttled
from .wishes import Wishes

RESULT = "hil"
REPORT_EVERY_S = 0.2
HOLD_S = 1.0  # of a frame that is delayed: longer than the host waits, and than the watchdog


@dataclass(frozen=True)
class Target:
    """An open line, and what can be done to it; faults only where the line is not a serial port."""

    line: Line
    faults: OnRequest | None = None
    reset_board: Callable[[], None] | None = None


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
        brings the wishes of the user.
    report
        told the share of the samples that are done.
    """
    began = time.monotonic()
    told = Told(phase="The run is being prepared.")
    write_told(folder, told)
    wanted = read_settings(settings)
    plan = wanted.run.plan(wanted.rig)
    out = folder / RESULT
    with result_folder(out, "hil", file_names([""]), _inputs(settings, wanted)) as new:
        samples = free_folder(out, UNFINISHED)
        try:
            with _opened(wanted, settings.machine) as target:
                run, session = _run(folder, plan, settings, target, samples, told, control, report)
        finally:
            with suppress(OSError):  # has samples
                samples.rmdir()
        told.phase = "The report is being written."
        write_told(folder, told)
        assert session.identity is not None
        provenance = Provenance(
            ehsid_version=ehsid.__version__,
            rig=settings.rig.strip() or "published",
            actual=None,
            effects=dict(wanted.run.values),
            line=wanted.address or f"{wanted.image} in QEMU, {settings.machine}",
            loop="position" if settings.position_control else "open",
            seed=wanted.run.signal.seed,
            seconds=round(time.monotonic() - began, 1),
        )
        name = type(plan.configuration.estimator.forgetting).__name__
        write_reports(new, session.identity, [(name, run, compare(run))], provenance)
        copy_samples(samples, new)
    shutil.rmtree(samples, ignore_errors=True)
    told.phase = "The run has ended."
    write_told(folder, told)
    report(1.0)


def _inputs(settings: LiveSettings, wanted: Wanted) -> list[Path]:
    rig = [Path(settings.rig).expanduser()] if settings.rig.strip() else []
    return [*rig, *([] if wanted.image is None else [wanted.image])]


@contextmanager
def _opened(wanted: Wanted, machine: str) -> Iterator[Target]:
    """Opens the line to the target; between two sockets stands a relay that can disturb it."""
    address = wanted.address or ""
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
    told: Told,
    control: Connection,
    report: Callable[[float], None],
) -> tuple[RunResult, Session]:
    estimator = plan.configuration.estimator
    told.phase = "The target is asked who it is."
    told.rig, told.samples, told.dt_s = plan.rig.name, plan.samples, plan.dt_s
    told.parameters = list(estimator.orders.names)
    told.position_control = settings.position_control
    told.faults, told.board_reset = target.faults is not None, target.reset_board is not None
    write_told(folder, told)
    outputs = OUTPUTS_OF[plan.rig.plant]
    with Watch(folder, samples, outputs, plan, target.line) as watch:

        def event(words: str) -> None:
            told.event(watch.time_s, words)
            write_told(folder, told)

        session = Session(target.line, on_event=event)
        identity = session.hello()
        told.board, told.firmware = identity.board, ".".join(map(str, identity.firmware))
        told.phase = "The run goes on."
        write_told(folder, told)
        share = throttled(report, REPORT_EVERY_S)
        wishes = Wishes(folder, control, told, watch, estimator, target.faults, target.reset_board)
        try:
            run = run_plan(
                plan,
                session,
                watch,
                real_time=settings.real_time,
                progress=lambda done, *_: share(done / plan.samples),
                steer=wishes,
            )
        except HilError as error:
            if watch.samples == 0:
                raise
            raise HilError(
                f"{error}; {samples} holds the {watch.samples} samples before"
            ) from error
    return run, session
