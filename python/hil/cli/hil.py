# SPDX-License-Identifier: MIT
"""`ehsid hil`: runs the simulated servo and the real controller in one loop."""

from __future__ import annotations

import math
import shutil
import time
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

import ehsid
from ehsid.harness.base.files import free_folder, result_folder
from ehsid.harness.catalogue.parameters import TARGET_POLICY
from ehsid.harness.cli.console import Console
from ehsid.harness.cli.options import (
    AsJson,
    Delay,
    ForServo,
    HilLoop,
    PastInputs,
    PastOutputs,
    RigOrPublished,
    SignalName,
)
from ehsid.harness.cli.policy_option import (
    Lambda0,
    PolicyName,
    PolicySettings,
    make_policy,
    servo_settings,
)


def hil_command(
    rig_file: RigOrPublished = None,
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
    servo: ForServo = False,
    retune: Annotated[
        bool, typer.Option("--retune/--no-retune", help="let the gain follow the estimate")
    ] = True,
    forgetting: Annotated[
        PolicyName, typer.Option(help="forgetting policy, not for the experiment")
    ] = TARGET_POLICY,
    lambda0: Lambda0 = None,
    setting: PolicySettings = None,
    na: PastOutputs = 3,
    nb: PastInputs = 3,
    nk: Delay = 1,
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
    cycles: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=NUMBER",
            help="cycles as a PLC has them, not for the experiment: jitter (deviation of a cycle's "
            "time, share of the sampling time), lost and overrun (shares of the cycles); again for "
            "more",
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, help="of the test signal, the noise and the cycles")
    ] = 0,
    real_time: Annotated[
        bool, typer.Option("--real-time", help="at the sampling time, not as fast as it goes")
    ] = False,
    as_json: AsJson = False,
    out: Annotated[
        Path, typer.Option(help="folder of the records, the estimates and the report")
    ] = Path("hil"),
) -> None:
    """Simulate the servo here, control it and estimate it on the target, in lock step.

    The target runs examples/firmware/servo. Writes record.csv, estimates.csv, hil.html and
    hil.json; while it runs, the samples are in a folder unfinished_NUMBER, where they stay if the
    run breaks off. The record goes into `ehsid gap` and `ehsid experiment` as it is. Exit code 1
    where the target's estimates are not, bit for bit, those of the host.

    Example: ehsid hil --qemu build/firmware/servo_an386.elf

    Example: ehsid hil --port /dev/ttyACM0 --rig rig.toml --loop position --real-time

    Example: ehsid hil --qemu build/firmware/servo_an386.elf --loop position --servo
    """
    from ehsid.harness.base.encoding import json_text
    from ehsid.harness.models.identification import ArxOrders
    from ehsid.harness.rigs import read_rig
    from ehsid.harness.rigs.new import published_rig
    from ehsid.harness.signals.simulation import parse_settings
    from ehsid.harness.signals.simulation.settings import SignalOptions

    from ..cycles import CycleOptions
    from ..page import UNFINISHED, copy_samples, file_names
    from ..plan import WATCHDOG_MS, LoopRun
    from ..result_file import Provenance
    from ..session import Session
    from ..transport import open_line
    from .runs import HilOptions, run_all, show, target, write_all

    began = time.monotonic()
    if not 0.0 < dt < math.inf:
        raise ValueError(f"--dt {dt:g}: expected a finite number of seconds > 0")
    if cycles and loop is HilLoop.experiment:
        raise ValueError(
            "--cycles: the cycles of the experiment are regular; expected --loop open or position"
        )
    rig = published_rig() if rig_file is None else read_rig(rig_file)
    chosen = None
    if servo:
        arx = {
            "--forgetting": forgetting != TARGET_POLICY,
            "--lambda0": lambda0 is not None,
            **{f"--{name}": value != 3 for name, value in (("na", na), ("nb", nb))},
            "--nk": nk != 1,
        }
        chosen = servo_settings(setting, arx)
    options = HilOptions(
        loop,
        LoopRun(
            loop is HilLoop.position,
            SignalOptions(excitation, duration, dt, amplitude, seed),
            bandwidth,
            make_policy(forgetting, lambda0, None if servo else setting),
            ArxOrders(na, nb, nk, offset=True),
            retune,
            parse_settings(effect or []),
            WATCHDOG_MS + (round(2000.0 * dt) if real_time else 0),
            CycleOptions.parse(cycles) if cycles else None,
        ),
        chosen,
    )
    plans = options.plans(rig, rig if actual is None else read_rig(actual))
    console = Console(stderr=True)
    inputs = [path for path in (rig_file, actual, qemu) if path is not None]
    with result_folder(out, "hil", file_names(plans), inputs) as folder:
        samples = free_folder(out, UNFINISHED)
        try:
            with target(port, qemu, machine) as address, open_line(address, baud) as line:
                session = Session(line, on_event=console.print)
                identity = session.hello()
                runs = run_all(plans, session, samples, console, real_time)
        except KeyboardInterrupt:
            recorded = any(samples.rglob("*.csv"))
            there = f"; {samples} holds the samples so far" if recorded else ""
            typer.echo(f"ehsid: interrupted{there}", err=True)
            raise typer.Exit(130) from None
        finally:
            with suppress(OSError):  # has samples
                samples.rmdir()
        provenance = Provenance(
            ehsid_version=ehsid.__version__,
            rig="published" if rig_file is None else str(rig_file),
            actual=None if actual is None else str(actual),
            effects=dict(options.run.values),
            line=f"{qemu} in QEMU, {machine}" if port is None else port,
            loop=loop.value,
            seed=seed,
            seconds=round(time.monotonic() - began, 1),
        )
        file = write_all(folder, identity, runs, provenance)
        copy_samples(samples, folder)
    shutil.rmtree(samples, ignore_errors=True)
    if as_json:
        typer.echo(json_text(file), nl=False)
    else:
        show(identity, runs, file, out)
    if not file.equal_to_host:
        raise typer.Exit(1)
