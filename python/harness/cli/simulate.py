# SPDX-License-Identifier: MIT
"""`ehsid simulate`: a rig on a command."""

from __future__ import annotations

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import numpy as np
import numpy.typing as npt
import typer
from rich.console import Console
from rich.table import Table

from ehsid.harness.cli.common import clear_errors, write_figure
from ehsid.harness.excitation import chirp, odd_multisine, prbs, random_steps, triangle
from ehsid.harness.records import Layout, read_record, write_record
from ehsid.harness.report import record_figure
from ehsid.harness.rigs import read_rig
from ehsid.harness.simulation import SimulationRun, parse_settings, simulate


class ExcitationName(StrEnum):
    """Test signals by name."""

    multisine = "multisine"
    prbs = "prbs"
    steps = "steps"
    chirp = "chirp"
    triangle = "triangle"


def _excitation(
    name: ExcitationName, n: int, dt_s: float, amplitude: float, seed: int
) -> npt.NDArray[np.float64]:
    """A signal of about this size: peak, for the multisine half of it as rms."""
    rng = np.random.default_rng(seed)
    duration = n * dt_s
    match name:
        case ExcitationName.multisine:
            band = (max(0.1, 2.0 / duration), min(20.0, 0.2 / dt_s))
            return odd_multisine(n, dt_s, band_hz=band, rms=0.5 * amplitude, rng=rng).samples
        case ExcitationName.prbs:
            return prbs(n, amplitude=amplitude, hold=max(1, round(0.02 / dt_s)))
        case ExcitationName.steps:
            hold = (max(1, round(0.05 / dt_s)), max(1, round(0.5 / dt_s)))
            return random_steps(n, amplitude=amplitude, hold=hold, rng=rng)
        case ExcitationName.chirp:
            band = (max(0.1, 1.0 / duration), min(30.0, 0.2 / dt_s))
            return chirp(n, dt_s, amplitude=amplitude, band_hz=band)
        case ExcitationName.triangle:
            return triangle(n, dt_s, amplitude=amplitude, period_s=duration / 4.0)


def _command(path: Path, layout: Layout) -> tuple[npt.NDArray[np.float64], float]:
    record = read_record(
        path, columns=["command_v"], required=["time_s", "command_v"], layout=layout
    )
    if len(record.segments) > 1 or record.dt_s is None:
        raise ValueError(f"{path}: a command with gaps cannot drive a rig; give one stretch of it")
    return record.column("command_v"), record.dt_s


def _table(run: SimulationRun) -> Table:
    table = Table()
    for heading in ("output", "lowest", "highest", "error of integration, % of range"):
        table.add_column(heading, justify="right")
    for name, error in run.error.items():
        values = run.record.column(name)
        table.add_row(name, f"{values.min():.5g}", f"{values.max():.5g}", f"{100.0 * error:.2g}")
    return table


def simulate_command(
    rig_file: Annotated[Path, typer.Argument(metavar="RIG", help="rig file, TOML")],
    command: Annotated[
        Path | None, typer.Option(help="record whose command_v drives the rig")
    ] = None,
    excitation: Annotated[ExcitationName | None, typer.Option(help="or a test signal")] = None,
    duration: Annotated[float, typer.Option(help="of the test signal, s")] = 10.0,
    dt: Annotated[float, typer.Option(help="sampling time of the test signal, s")] = 1e-3,
    amplitude: Annotated[float, typer.Option(help="of the test signal, V")] = 1.0,
    seed: Annotated[int, typer.Option(help="of the test signal")] = 0,
    effect: Annotated[
        list[str] | None, typer.Option(help="EFFECT.PARAMETER=NUMBER, again for more")
    ] = None,
    position0: Annotated[float | None, typer.Option(help="start, m; default mid-stroke")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="print JSON instead of a table")] = False,
    out: Annotated[
        Path | None, typer.Option(help="record to write (csv, parquet, mat, npz), beside it a .png")
    ] = None,
) -> None:
    """Simulate a rig on a logged command or on a test signal.

    Example: ehsid simulate rig.toml --command rec.csv --effect coulomb_friction.force_n=400
    --out sim.csv
    """
    with clear_errors():
        if (command is None) == (excitation is None):
            raise ValueError("give either --command REC or --excitation NAME")
        values = parse_settings(effect or [])
        rig = read_rig(rig_file)
        if command is not None:
            volts, dt = _command(command, rig.columns)
        else:
            assert excitation is not None
            if not (duration > 0.0 and dt > 0.0 and duration >= 2.0 * dt):
                raise ValueError(
                    f"--duration {duration:g}, --dt {dt:g}: expected 0 < 2 dt <= duration"
                )
            volts = _excitation(excitation, round(duration / dt), dt, amplitude, seed)
        run = simulate(
            rig,
            volts,
            dt_s=dt,
            position0_m=position0,
            values=values,
            keep_inside=excitation is not None,
        )
        if out is not None:
            write_record(run.record, out)
            write_figure(out.with_suffix(".png"), record_figure(run.record))
    if as_json:
        findings = {"samples": len(run.record), "dt_s": dt, "substeps": run.substeps}
        typer.echo(json.dumps({**findings, "error": dict(run.error)}))
        return
    console = Console()
    console.print(f"{rig.name}: {len(run.record)} samples at {dt:g} s, {run.substeps} steps each")
    console.print(_table(run))
