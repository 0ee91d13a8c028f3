# SPDX-License-Identifier: MIT
"""`ehsid hil`: the simulated servo and the real controller in one loop."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

import ehsid
from ehsid.harness.cli.asked_signal import AskedSignal, as_command, as_reference
from ehsid.harness.cli.common import clear_errors
from ehsid.harness.cli.estimate import ForgettingName, make_policy
from ehsid.harness.cli.hil_progress import live
from ehsid.harness.cli.signals import SignalName
from ehsid.harness.experiment.published import published_rig
from ehsid.harness.hil.answers import Identity
from ehsid.harness.hil.comparison import compare
from ehsid.harness.hil.emulator import emulated
from ehsid.harness.hil.errors import HilError
from ehsid.harness.hil.plan import (
    WATCHDOG_MS,
    Plan,
    experiment_plans,
    open_plan,
    position_plan,
)
from ehsid.harness.hil.recording import Recording
from ehsid.harness.hil.run import run_plan
from ehsid.harness.hil.session import Session
from ehsid.harness.hil.transport import open_line
from ehsid.harness.identification import ArxOrders
from ehsid.harness.identification.serialise import to_plain
from ehsid.harness.report import write_page
from ehsid.harness.report.hil_files import plain_identity, plain_run, run_row
from ehsid.harness.report.hil_page import Runs, hil_page, lead
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.simulation import draw_noise, parse_settings, suggested_controller
from ehsid.harness.simulation.outputs import OUTPUTS_OF

REPORTS = ("hil.html", "hil.json")


class HilLoop(StrEnum):
    """What runs."""

    experiment = "experiment"
    open = "open"
    position = "position"


@dataclass(frozen=True)
class Asked:
    """The options that make the plans."""

    loop: HilLoop
    signal: AskedSignal
    bandwidth: float | None
    forgetting: ehsid.Forgetting
    orders: ArxOrders
    retune: bool
    values: Mapping[str, float]
    watchdog_ms: int

    def plans(self, rig: Rig, actual: Rig) -> dict[str, Plan]:
        """By folder below --out, "" for itself; settings come from `rig`, `actual` is what runs."""
        if actual.plant != rig.plant:
            raise ValueError(
                f'--actual: a plant "{actual.plant}", the rig is "{rig.plant}": expected the same'
            )
        return {name: replace(plan, rig=actual) for name, plan in self._told(rig).items()}

    def _told(self, rig: Rig) -> dict[str, Plan]:
        controller = suggested_controller(rig, self.bandwidth)
        more: dict[str, Any] = {"values": self.values, "watchdog_ms": self.watchdog_ms}
        if self.loop is HilLoop.experiment:
            return experiment_plans(rig, controller, self.signal.seed, **more)
        # Another stream than that of the signal, as `ehsid simulate --noise` has it.
        rng = np.random.default_rng([self.signal.seed, 1])
        more |= {
            "dt_s": self.signal.dt,
            "noise": draw_noise(rig, self.signal.samples, rng),
            "orders": self.orders,
            "forgetting": self.forgetting,
        }
        if self.loop is HilLoop.open:
            return {"": open_plan(rig, as_command(rig, self.signal), controller, **more)}
        reference = as_reference(rig, self.signal, controller)
        return {"": position_plan(rig, reference, controller, retune=self.retune, **more)}


@contextmanager
def _port(port: str | None, image: Path | None, machine: str) -> Iterator[str]:
    """The address of the target: as told, or that of an emulator that runs meanwhile."""
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


def _run_all(
    plans: Mapping[str, Plan], session: Session, out: Path, console: Console, real_time: bool
) -> Runs:
    runs = []
    with live(console) as stage:
        for folder, plan in plans.items():
            told = plan.configuration.estimator
            with Recording(out / folder, OUTPUTS_OF[plan.rig.plant], told.orders) as recording:
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
            runs.append((folder or type(told.forgetting).__name__, run, compare(run)))
    return runs


def _write(out: Path, identity: Identity, runs: Runs, provenance: Mapping[str, Any]) -> str:
    """hil.html and hil.json, each under a temporary name first; the text of the latter."""
    write_page(out / REPORTS[0], hil_page(identity, runs, published=len(runs) > 1))
    findings = {
        "schema_version": 1,
        "target": plain_identity(identity),
        "equal_to_host": all(agreement.equal for *_, agreement in runs),
        "runs": [plain_run(*run) for run in runs],
        "provenance": dict(provenance),
    }
    text = json.dumps(to_plain(findings), indent=2, allow_nan=False) + "\n"
    unfinished = out / f".{REPORTS[1]}.part"
    unfinished.write_text(text, encoding="utf-8")
    unfinished.replace(out / REPORTS[1])
    return text


def _show(identity: Identity, runs: Runs, out: Path) -> None:
    console = Console()
    for sentence in lead(identity, runs):
        console.print(f"- {sentence}", highlight=False)
    table = Table()
    rows = [run_row(*run) for run in runs]
    for heading in rows[0]:
        table.add_column(heading, justify="right")
    for row in rows:
        table.add_row(*row.values())
    console.print(table)
    console.print(f"report: {out / REPORTS[0]}", soft_wrap=True)


def hil_command(
    rig_file: Annotated[
        Path | None, typer.Option("--rig", help="rig file, TOML; default: the published rig")
    ] = None,
    port: Annotated[
        str | None,
        typer.Option(help="line to the target: /dev/ttyACM0, socket://HOST:PORT, as pyserial"),
    ] = None,
    qemu: Annotated[
        Path | None,
        typer.Option(metavar="FIRMWARE", help="or a firmware image (ELF) to run in QEMU"),
    ] = None,
    machine: Annotated[
        str, typer.Option(help="QEMU's: mps2-an386 (Cortex-M4F), mps2-an500 (Cortex-M7)")
    ] = "mps2-an386",
    baud: Annotated[int, typer.Option(min=1, help="of a serial port")] = 115200,
    loop: Annotated[
        HilLoop,
        typer.Option(
            help="experiment: the published one, 100 s at 50 ms, a run for each forgetting factor; "
            "open: a test signal is the command; position: it is the reference of the controller "
            "on the target"
        ),
    ] = HilLoop.experiment,
    excitation: Annotated[
        SignalName, typer.Option(help="test signal, not for the experiment")
    ] = SignalName.multisine,
    duration: Annotated[float, typer.Option(help="of the test signal, s")] = 20.0,
    dt: Annotated[float, typer.Option(help="sampling time of the test signal, s")] = 0.02,
    amplitude: Annotated[
        float | None,
        typer.Option(
            help="peak of the test signal: V, default a tenth of rated command; with --loop "
            "position m, default 3 % of the stroke",
            show_default=False,
        ),
    ] = None,
    bandwidth: Annotated[
        float | None, typer.Option(help="of the position loop, Hz; default at most 2")
    ] = None,
    retune: Annotated[
        bool, typer.Option("--retune/--no-retune", help="let the gain follow the estimate")
    ] = True,
    forgetting: Annotated[
        ForgettingName, typer.Option(help="forgetting policy, not for the experiment")
    ] = ForgettingName.f_ratio,
    lambda0: Annotated[
        float | None, typer.Option(help="factor (constant) or rate (exponential)")
    ] = None,
    na: Annotated[int, typer.Option(help="past outputs")] = 3,
    nb: Annotated[int, typer.Option(help="past commands")] = 3,
    nk: Annotated[int, typer.Option(help="delay in samples")] = 1,
    actual: Annotated[
        Path | None,
        typer.Option(
            metavar="RIG",
            help="the machine that is simulated, where it is another than the one that the "
            "controller is tuned for",
        ),
    ] = None,
    effect: Annotated[
        list[str] | None,
        typer.Option(help="EFFECT.PARAMETER=NUMBER in the simulated machine; again for more"),
    ] = None,
    seed: Annotated[int, typer.Option(help="of the test signal and the noise")] = 0,
    real_time: Annotated[
        bool, typer.Option("--real-time", help="at the sampling time, not as fast as it goes")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="print the JSON file, too")] = False,
    out: Annotated[
        Path, typer.Option(help="folder of the records, the estimates and the report")
    ] = Path("hil"),
) -> None:
    """Simulate the servo here, control it and estimate it on the target, in lock step.

    The target runs examples/firmware/servo. Writes record.csv and estimates.csv while it runs, then
    hil.html and hil.json. The record goes into `ehsid gap` and `ehsid experiment` as it is. Exit
    code 1 where the target's estimates are not, bit for bit, those of the host.

    Example: ehsid hil --qemu build/firmware/servo_an386.elf

    Example: ehsid hil --port /dev/ttyACM0 --rig rig.toml --loop position --real-time
    """
    began = time.monotonic()
    with clear_errors():
        if not dt > 0.0:
            raise ValueError(f"--dt {dt:g}: expected > 0")
        if out.exists() and not out.is_dir():
            raise ValueError(f"--out {out}: this is a file; give the name of a folder")
        rig = published_rig() if rig_file is None else read_rig(rig_file)
        asked = Asked(
            loop,
            AskedSignal(excitation, duration, dt, amplitude, seed),
            bandwidth,
            make_policy(forgetting, lambda0),
            ArxOrders(na, nb, nk, offset=True),
            retune,
            parse_settings(effect or []),
            WATCHDOG_MS + (round(2000.0 * dt) if real_time else 0),
        )
        plans = asked.plans(rig, rig if actual is None else read_rig(actual))
        console = Console(stderr=True)
        try:
            with _port(port, qemu, machine) as address, open_line(address, baud) as line:
                session = Session(line, on_event=lambda text: console.print(text, highlight=False))
                identity = session.hello()
                for name in REPORTS:  # of an earlier run: they would not be those of these records
                    (out / name).unlink(missing_ok=True)
                runs = _run_all(plans, session, out, console, real_time)
        except KeyboardInterrupt:
            typer.echo(f"ehsid: interrupted; {out} holds the samples so far", err=True)
            raise typer.Exit(130) from None
        provenance = {
            "ehsid_version": ehsid.__version__,
            "rig": "published" if rig_file is None else str(rig_file),
            "actual": None if actual is None else str(actual),
            "effects": dict(asked.values),
            "line": port if qemu is None else f"{qemu} in QEMU, {machine}",
            "loop": loop.value,
            "seed": seed,
            "seconds": round(time.monotonic() - began, 1),
        }
        text = _write(out, identity, runs, provenance)
    if as_json:
        typer.echo(text, nl=False)
    else:
        _show(identity, runs, out)
    if not all(agreement.equal for *_, agreement in runs):
        raise typer.Exit(1)
