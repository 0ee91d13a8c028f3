# SPDX-License-Identifier: MIT
"""Runs the plans of `ehsid hil` on the target, and shows and writes their results."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import ehsid
from ehsid.harness.cli.common import make_table
from ehsid.harness.cli.console import Console
from ehsid.harness.cli.hil_progress import live
from ehsid.harness.cli.options import HilLoop
from ehsid.harness.cli.signal_options import SignalOptions, as_command, as_reference
from ehsid.harness.deploy.hil.answers import Identity
from ehsid.harness.deploy.hil.comparison import compare
from ehsid.harness.deploy.hil.emulator import emulated
from ehsid.harness.deploy.hil.errors import HilError
from ehsid.harness.deploy.hil.plan import Plan, open_plan, position_plan
from ehsid.harness.deploy.hil.recording import ESTIMATES, RECORD, Recording
from ehsid.harness.deploy.hil.result_file import HilFile, Provenance, Run, Runs, hil_file
from ehsid.harness.deploy.hil.run import run_plan
from ehsid.harness.deploy.hil.session import Session
from ehsid.harness.encoding import json_text
from ehsid.harness.files import write_text
from ehsid.harness.identification import ArxOrders
from ehsid.harness.report.hil_page import hil_page, lead
from ehsid.harness.report.page import write_page
from ehsid.harness.rigs import Rig
from ehsid.harness.simulation import draw_noise, suggested_controller
from ehsid.harness.simulation.outputs import OUTPUTS_OF
from ehsid.harness.studies.pages.recursive_sections import published_table
from ehsid.harness.studies.published import SOURCE
from ehsid.harness.studies.target_plans import experiment_plans

REPORTS = ("hil.html", "hil.json")
# First part of the name of the folder that holds the samples of a run that is not finished.
UNFINISHED = "unfinished"


@dataclass(frozen=True)
class HilOptions:
    """The options of `ehsid hil` that determine the plans."""

    loop: HilLoop
    signal: SignalOptions
    bandwidth: float | None
    forgetting: ehsid.Forgetting
    orders: ArxOrders
    retune: bool
    values: Mapping[str, float]
    watchdog_ms: int

    def plans(self, rig: Rig, actual: Rig) -> dict[str, Plan]:
        """Returns the plans by folder below --out; the name "" stands for --out itself.

        The settings come from `rig`; the simulated machine is `actual`.
        """
        if actual.plant != rig.plant:
            raise ValueError(
                f'--actual: a plant "{actual.plant}", the rig is "{rig.plant}": expected the same'
            )
        return {name: replace(plan, rig=actual) for name, plan in self._plans(rig).items()}

    def _plans(self, rig: Rig) -> dict[str, Plan]:
        controller = suggested_controller(rig, self.bandwidth)
        settings: dict[str, Any] = {"values": self.values, "watchdog_ms": self.watchdog_ms}
        if self.loop is HilLoop.experiment:
            return experiment_plans(rig, controller, self.signal.seed, **settings)
        # As in `ehsid simulate --noise`, the noise has another random stream than the test signal.
        rng = np.random.default_rng([self.signal.seed, 1])
        settings |= {
            "dt_s": self.signal.dt,
            "noise": draw_noise(rig, self.signal.samples, rng),
            "orders": self.orders,
            "forgetting": self.forgetting,
        }
        if self.loop is HilLoop.open:
            return {"": open_plan(rig, as_command(rig, self.signal), controller, **settings)}
        reference = as_reference(rig, self.signal, controller)
        return {"": position_plan(rig, reference, controller, retune=self.retune, **settings)}


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
    with live(console) as stage:
        for folder, plan in plans.items():
            estimator = plan.configuration.estimator
            with Recording(out / folder, OUTPUTS_OF[plan.rig.plant], estimator.orders) as recording:
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
            runs.append((folder or type(estimator.forgetting).__name__, run, compare(run)))
    return runs


def file_names(plans: Mapping[str, Plan]) -> list[str]:
    """Returns the names of all files of the result, relative to --out."""
    samples = [str(Path(folder, name)) for folder in plans for name in (RECORD, ESTIMATES)]
    return [*samples, *REPORTS]


def copy_samples(samples: Path, folder: Path) -> None:
    """Copies the files of all runs, each in the folder of its run, into another folder."""
    for path in sorted(samples.rglob("*.csv")):
        copy = folder / path.relative_to(samples)
        copy.parent.mkdir(exist_ok=True)
        shutil.copyfile(path, copy)


def write_reports(out: Path, identity: Identity, runs: Runs, provenance: Provenance) -> HilFile:
    """Writes hil.html and hil.json; returns the content of both."""
    if len(runs) > 1:  # Only the experiment has several runs.
        page = hil_page(identity, runs, beside=published_table(), sources=[SOURCE])
    else:
        page = hil_page(identity, runs)
    write_page(out / REPORTS[0], page)
    file = hil_file(identity, runs, provenance)
    write_text(out / REPORTS[1], json_text(file))
    return file


def show(identity: Identity, runs: Runs, file: HilFile, out: Path) -> None:
    """Prints the result in a few sentences and a table."""
    console = Console()
    for sentence in lead(identity, runs):
        console.print(f"- {sentence}")
    rows = [_row(run) for run in file.runs]
    console.print(make_table(list(rows[0]), [list(row.values()) for row in rows]))
    console.print(f"report: {out / REPORTS[0]}", soft_wrap=True)


def _row(run: Run) -> dict[str, str]:
    """Returns the row of a run: its cells by heading."""
    return {
        "run": run.name,
        "RMSE, mm": f"{1e3 * run.rmse_m:.4g}",
        "fit, %": f"{run.fit_percent:.1f}",
        "lambda": f"{run.forgetting_factor:.4f}",
        "resets": str(run.resets),
        "converged": "yes" if run.converged else "no",
        "bits": "same" if run.equal_to_host else f"{run.samples_that_differ} other",
    }
