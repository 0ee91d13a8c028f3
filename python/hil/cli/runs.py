# SPDX-License-Identifier: MIT
"""Runs the plans of `ehsid hil` on the target, shows their progress, and writes their results."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.progress import BarColumn, MofNCompleteColumn, Progress

import ehsid
from ehsid.harness.base.time_to_go import TimeToGo
from ehsid.harness.cli.console import Console, PlainColumn, print_blocks, print_points
from ehsid.harness.cli.options import HilLoop
from ehsid.harness.cli.progress import LeftColumn, left_words
from ehsid.harness.rigs import Rig
from ehsid.harness.show.page import Table
from ehsid.harness.signals.simulation import suggested_controller
from ehsid.harness.signals.simulation.run import OUTPUTS_OF

from ..answers import Identity, Result, SampleAnswer
from ..comparison import compare
from ..emulator import emulated
from ..frames import HilError
from ..page import REPORTS, lead, write_reports
from ..plan import LoopRun, Plan, offered_loop, with_machine, with_servo
from ..recording import Recording
from ..result_file import HilFile, Provenance, Run, Runs
from ..run import run_plan
from ..session import Counters, Session

LINE_EVERY_S = 10.0
BAR_EVERY_S = 0.1

Update = Callable[[int, SampleAnswer, Counters], None]


def state_text(rate: float, result: SampleAnswer, counters: Counters) -> str:
    """Returns sample rate, fit and lambda or K, status, and the errors on the line, as text."""
    if isinstance(result, Result):
        told = f"fit {result.fit_percent:.1f} %, lambda {result.forgetting_factor:.4f}"
    else:
        reason = ehsid.TrustReason(result.velocity_gain_reason).name.replace("_", " ")
        value = result.velocity_gain_m_s_v
        told = f"K: {reason}" if math.isnan(value) else f"K {value:.4g} m/s per V ({reason})"
    text = f"{rate:.0f}/s, {told}, {ehsid.Status(result.status).name}"
    troubles = {
        "sent again": counters.asked_again,
        "damaged": counters.bad_frames,
        "late": counters.late,
        "watchdog": counters.resumed,
    }
    return text + "".join(f", {name} {count}" for name, count in troubles.items() if count)


@contextmanager
def live(
    console: Console, all_samples: int, clock: Callable[[], float] = time.monotonic
) -> Iterator[Callable[[str, int], Update]]:
    """Yields a function that opens a run with a number of samples.

    That function returns another one, which the caller calls after each sample.

    Parameters
    ----------
    console
        where the progress is shown.
    all_samples
        number of samples of all runs together.
    clock
        tells the time in seconds.
    """
    bar = Progress(
        PlainColumn("{task.description}"),
        BarColumn(bar_width=24),
        MofNCompleteColumn(),
        PlainColumn("{task.fields[state]}"),
        LeftColumn(),
        console=console,
        transient=True,
    )
    to_go = TimeToGo(clock)
    opened = 0  # samples of the runs that were opened so far

    def stage(name: str, samples: int) -> Update:
        nonlocal opened
        before, opened = opened, opened + samples
        began = last = clock()
        task = None
        if console.is_terminal:
            task = bar.add_task(name, total=samples, state="", to_go=to_go)

        def update(done: int, result: SampleAnswer, counters: Counters) -> None:
            nonlocal last
            now = clock()
            if now - last < (LINE_EVERY_S if task is None else BAR_EVERY_S) and done < samples:
                return
            last = now
            to_go.update((before + done) / all_samples)
            state = state_text(done / max(now - began, 1e-9), result, counters)
            if task is not None:
                bar.update(task, completed=done, state=state)
                return
            left = left_words(to_go)
            parts = [f"{name}: {done} of {samples}", state, *([left] if left else [])]
            console.print(", ".join(parts), soft_wrap=True)

        return update

    if console.is_terminal:
        with bar:
            yield stage
    else:
        yield stage


@dataclass(frozen=True)
class HilOptions:
    """The options of `ehsid hil` that determine the plans."""

    loop: HilLoop
    run: LoopRun
    servo: Mapping[str, float] | None = None
    """Chosen settings of a ServoEstimator; None for an ARX model."""

    def plans(self, rig: Rig, actual: Rig) -> dict[str, Plan]:
        """Returns the plans by folder below --out; the name "" stands for --out itself.

        The settings come from `rig`; the simulated machine is `actual`.
        """
        return {name: with_machine(plan, actual) for name, plan in self._plans(rig).items()}

    def _plans(self, rig: Rig) -> dict[str, Plan]:
        if self.loop is not HilLoop.experiment:
            plan = self.run.plan(rig)
            return {"": plan if self.servo is None else with_servo(plan, self.servo)}
        run = self.run
        return offered_loop(self.loop.value).plans(
            rig,
            suggested_controller(rig, run.bandwidth_hz),
            run.signal.seed,
            values=run.values,
            watchdog_ms=run.watchdog_ms,
            servo=self.servo,
        )


@contextmanager
def target(port: str | None, image: Path | None, machine: str) -> Iterator[str]:
    """Yields the address of the target: `port`, or that of an emulator that runs meanwhile."""
    if (port is None) == (image is None):
        raise ValueError(
            "give either --port (as socket://localhost:4444 or /dev/ttyACM0) or --qemu FIRMWARE"
        )
    if image is None:
        assert port is not None
        yield port
    else:
        with emulated(image, machine) as address:
            yield address


def run_all(
    plans: Mapping[str, Plan], session: Session, out: Path, console: Console, real_time: bool
) -> Runs:
    """Runs each plan, writes its samples into its folder below `out`, and shows the progress."""
    runs = []
    with live(console, sum(plan.samples for plan in plans.values())) as stage:
        for folder, plan in plans.items():
            estimator, servo = plan.configuration.estimator, plan.configuration.servo
            orders = estimator.orders if servo is None else None
            measured = OUTPUTS_OF[plan.rig.plant]
            with Recording(out / folder, measured, orders, plan.cycles) as recording:
                try:
                    run = run_plan(
                        plan,
                        session,
                        recording,
                        real_time=real_time,
                        progress=stage(plan.name, plan.samples),
                    )
                except HilError as error:
                    if recording.samples == 0:
                        raise
                    raise HilError(
                        f"{error}; {out / folder} holds the {recording.samples} samples before"
                    ) from error
            kind = type(estimator.forgetting).__name__ if servo is None else "servo"
            runs.append((folder or kind, run, compare(run)))
    return runs


def write_all(out: Path, identity: Identity, runs: Runs, provenance: Provenance) -> HilFile:
    """Writes hil.html and hil.json; the experiment is shown beside the published numbers.

    These are of ARX models.
    """
    if provenance.loop == HilLoop.experiment.value and runs[0][2].servo is None:
        offered = offered_loop(provenance.loop)
        return write_reports(
            out, identity, runs, provenance, beside=offered.beside, sources=offered.sources
        )
    return write_reports(out, identity, runs, provenance)


def show(identity: Identity, runs: Runs, file: HilFile, out: Path) -> None:
    """Prints the result in a few sentences and a table."""
    console = Console()
    print_points(lead(identity, runs), console, indent=0)
    rows = [_row(run) for run in file.runs]
    print_blocks([Table("", list(rows[0]), [list(row.values()) for row in rows])], console)
    console.print(f"report: {out / REPORTS[0]}", soft_wrap=True)


def _row(run: Run) -> dict[str, str]:
    """Returns the row of a run: its cells by heading."""
    if run.servo is not None:
        told = (run.servo.gain, run.servo.omega_n, run.servo.xi)
        values = ["-" if one.value is None else f"{one.value:.4g}" for one in told]
        return {
            "run": run.name,
            **dict(zip(("K, m/s per V", "omega_n, rad/s", "xi"), values, strict=True)),
            "trusted, %": "/".join(f"{100.0 * one.trusted_share:.0f}" for one in told),
            "resets": str(run.resets),
            "bits": _bits(run),
        }
    return {
        "run": run.name,
        "RMSE, mm": f"{1e3 * run.rmse_m:.4g}",
        "fit, %": f"{run.fit_percent:.1f}",
        "lambda": f"{run.forgetting_factor:.4f}",
        "resets": str(run.resets),
        "converged": "yes" if run.converged else "no",
        "bits": _bits(run),
    }


def _bits(run: Run) -> str:
    return "same" if run.equal_to_host else f"{run.samples_that_differ} other"
