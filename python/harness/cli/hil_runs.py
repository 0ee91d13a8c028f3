# SPDX-License-Identifier: MIT
"""Runs the plans of `ehsid hil` on the target, and shows and writes their results."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

import ehsid
from ehsid.harness.cli.common import make_table
from ehsid.harness.cli.hil_progress import live
from ehsid.harness.cli.options import HilLoop
from ehsid.harness.cli.signal_options import SignalOptions, as_command, as_reference
from ehsid.harness.deploy.hil.answers import Identity
from ehsid.harness.deploy.hil.comparison import compare
from ehsid.harness.deploy.hil.emulator import emulated
from ehsid.harness.deploy.hil.errors import HilError
from ehsid.harness.deploy.hil.plan import Plan, open_plan, position_plan
from ehsid.harness.deploy.hil.recording import Recording
from ehsid.harness.deploy.hil.run import run_plan
from ehsid.harness.deploy.hil.session import Session
from ehsid.harness.encoding import to_plain
from ehsid.harness.files import write_text
from ehsid.harness.identification import ArxOrders
from ehsid.harness.report.hil_files import plain_identity, plain_run, run_row
from ehsid.harness.report.hil_page import Runs, hil_page, lead
from ehsid.harness.report.page import write_page
from ehsid.harness.rigs import Rig
from ehsid.harness.simulation import draw_noise, suggested_controller
from ehsid.harness.simulation.outputs import OUTPUTS_OF
from ehsid.harness.studies.pages.recursive_sections import published_table
from ehsid.harness.studies.published import SOURCE
from ehsid.harness.studies.target_plans import experiment_plans

REPORTS = ("hil.html", "hil.json")


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
    """Runs each plan, writes its records into its folder below `out`, and shows the progress."""
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


def write_reports(out: Path, identity: Identity, runs: Runs, provenance: Mapping[str, Any]) -> str:
    """Writes hil.html and hil.json, each under a temporary name first.

    Returns the text of hil.json.
    """
    if len(runs) > 1:  # Only the experiment has several runs.
        page = hil_page(identity, runs, beside=published_table(), sources=[SOURCE])
    else:
        page = hil_page(identity, runs)
    write_page(out / REPORTS[0], page)
    results = {
        "schema_version": 1,
        "target": plain_identity(identity),
        "equal_to_host": all(agreement.equal for *_, agreement in runs),
        "runs": [plain_run(*run) for run in runs],
        "provenance": dict(provenance),
    }
    text = json.dumps(to_plain(results), indent=2, allow_nan=False) + "\n"
    write_text(out / REPORTS[1], text)
    return text


def show(identity: Identity, runs: Runs, out: Path) -> None:
    """Prints the result in a few sentences and a table."""
    console = Console()
    for sentence in lead(identity, runs):
        console.print(f"- {sentence}", highlight=False)
    rows = [run_row(*run) for run in runs]
    console.print(make_table(list(rows[0]), [list(row.values()) for row in rows]))
    console.print(f"report: {out / REPORTS[0]}", soft_wrap=True)
