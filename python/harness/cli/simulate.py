# SPDX-License-Identifier: MIT
"""`ehsid simulate`: simulates a rig on a command or in a closed loop."""

from __future__ import annotations

import json
from contextlib import AbstractContextManager, nullcontext
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..base.files import result_files
from .console import Console, check_ending, print_blocks
from .lazy import effect_sizes
from .options import AsJson, Maps, SignalName, hints_of, show_read
from .progress import progress_of

if TYPE_CHECKING:
    from ..rigs import Rig
    from ..signals.simulation import PositionController


class LoopName(StrEnum):
    """Source of the command: open loop, P controller or PI controller."""

    open = "open"
    p = "p"
    pi = "pi"


def _controller(rig: Rig, loop: LoopName, bandwidth: float | None) -> PositionController:
    from ..signals.simulation import suggested_controller, with_integral

    controller = suggested_controller(rig, bandwidth)
    return with_integral(controller) if loop is LoopName.pi else controller


def simulate_command(
    rig_file: Annotated[Path, typer.Argument(metavar="RIG", help="rig file, TOML")],
    command: Annotated[
        Path | None, typer.Option(help="record whose command_v drives the rig")
    ] = None,
    excitation: Annotated[SignalName | None, typer.Option(help="or a test signal")] = None,
    duration: Annotated[float, typer.Option(help="of the test signal, s")] = 10.0,
    dt: Annotated[
        float | None,
        typer.Option(
            help="sampling time of the test signal, s, default 0.001; or of a logged command "
            "without time",
            show_default=False,
        ),
    ] = None,
    maps: Maps = None,
    amplitude: Annotated[
        float | None,
        typer.Option(
            help="peak of the test signal: V, default a tenth of rated command; in a closed loop "
            "m, default 3 % of the stroke",
            show_default=False,
        ),
    ] = None,
    loop: Annotated[
        LoopName,
        typer.Option(
            help="open: the test signal is the command; p, pi: it is the position reference of a "
            "controller with velocity feed-forward"
        ),
    ] = LoopName.open,
    bandwidth: Annotated[
        float | None, typer.Option(help="of the closed loop, Hz; default at most 2")
    ] = None,
    noise: Annotated[
        bool, typer.Option("--noise", help="add the noise of the sensors that the rig file gives")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="of the test signal and the noise")] = 0,
    effect: Annotated[
        list[str] | None,
        typer.Option(help="EFFECT.PARAMETER=NUMBER, again for more", autocompletion=effect_sizes),
    ] = None,
    position0: Annotated[float | None, typer.Option(help="start, m; default mid-stroke")] = None,
    as_json: AsJson = False,
    out: Annotated[
        Path | None, typer.Option(help="record to write (csv, parquet, mat, npz), beside it a .png")
    ] = None,
) -> None:
    """Simulate a rig on a logged command or on a test signal.

    Examples: ehsid simulate rig.toml --command rec.csv --effect coulomb_friction.force_n=400
    --out sim.csv

    ehsid simulate rig.toml --excitation multisine --loop pi --noise --out sim.csv
    """
    import numpy as np

    from ..records import read_record
    from ..records.record import record_bytes
    from ..rigs import read_rig
    from ..show.model_blocks import run_table
    from ..signals.simulation import draw_noise, parse_settings, simulate, simulate_closed_loop
    from ..signals.simulation.outside import opened_outside, simulate_outside
    from ..signals.simulation.run import logged_command
    from ..signals.simulation.settings import SignalOptions, as_command, as_reference, check_start

    if (command is None) == (excitation is None):
        raise ValueError(
            "expected either --command RECORD or --excitation NAME; name one source of the command"
        )
    if command is not None and loop is not LoopName.open:
        raise ValueError("--loop: a logged command drives the rig as it is; use --excitation")
    placing: AbstractContextManager[Path | None] = nullcontext()
    if out is not None:
        check_ending(out)
        picture = out.with_suffix(".png").name
        inputs = [rig_file] if command is None else [rig_file, command]
        placing = result_files(out, "simulate", [picture], inputs)
    step = 1e-3 if dt is None else dt
    with placing as folder:
        values = parse_settings(effect or [])
        rig = read_rig(rig_file)
        check_start(rig, position0)
        volts, signal, limited = None, None, None
        if command is not None:
            record = read_record(
                command,
                columns=["command_v"],
                required=["time_s", "command_v"],
                layout=rig.columns,
                hints=hints_of(maps, dt),
            )
            volts, step = logged_command(record, rig)
            show_read(record, command)
            samples = volts.size
        else:
            assert excitation is not None
            signal = SignalOptions(excitation, duration, step, amplitude, seed)
            samples = signal.samples
        with progress_of(f"simulating {rig.name}") as progress:
            settings: dict[str, Any] = {"values": values}
            if noise:
                if not any(rig.sensors.values()):
                    raise ValueError(
                        f"--noise: {rig_file} gives no sensor noise; add position_noise_m to its "
                        "section [sensors]"
                    )
                # The noise has another random stream than the test signal.
                settings["noise"] = draw_noise(rig, samples, np.random.default_rng([seed, 1]))
            if signal is not None and loop is not LoopName.open:
                controller = _controller(rig, loop, bandwidth)
                reference = as_reference(rig, signal, controller, position0)
                closed = simulate_closed_loop(
                    rig, reference, controller, dt_s=step, progress=progress, **settings
                )
                run, limited = closed.run, float(np.mean(closed.limited))
            else:
                settings |= {"dt_s": step, "position0_m": position0}
                settings["keep_inside"] = signal is not None
                with opened_outside(rig, position0) as runs:
                    if signal is not None:
                        speed = None if runs is None else runs.measured.speed_per_volt
                        volts = as_command(rig, signal, position0, speed)
                    assert volts is not None
                    if runs is None:
                        run = simulate(rig, volts, progress=progress, **settings)
                    else:
                        run = simulate_outside(runs, volts, **settings)
        if out is not None and folder is not None:
            from ..show.plotting import write_figure
            from ..show.record_figure import record_figure

            (folder / out.name).write_bytes(record_bytes(run.record, out.name))
            write_figure(folder / picture, record_figure(run.record))
    if as_json:
        result = {"samples": len(run.record), "dt_s": step, "substeps": run.substeps}
        if limited is not None:
            result["share_at_limit"] = limited
        typer.echo(json.dumps({**result, "error": dict(run.error)}))
        return
    console = Console()
    each = "1 step each" if run.substeps == 1 else f"{run.substeps} steps each"
    console.print(f"{rig.name}: {len(run.record)} samples at {step:g} s, {each}")
    if not run.error:
        console.print("the error of integration is not known: the simulator is not that of ehsid")
    if limited:
        console.print(f"the command is at its limit for {100.0 * limited:.1f} % of the time")
    print_blocks([run_table(run)], console)
