# SPDX-License-Identifier: MIT
"""`ehsid experiment`: redoes the published experiment, or runs it on a record of the user."""

from __future__ import annotations

import time
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

import ehsid
from ehsid.harness.base.files import result_folder
from ehsid.harness.cli.console import Console, print_points, refuse
from ehsid.harness.cli.options import (
    AsJson,
    InputColumn,
    Maps,
    OutputColumn,
    RigOrPublished,
    SamplingTime,
    hints_of,
)
from ehsid.harness.cli.progress import stages


class TrendName(StrEnum):
    """Trend that the preprocessing removes from input and output."""

    none = "none"
    mean = "mean"
    linear = "linear"


def experiment_command(
    record: Annotated[
        Path | None, typer.Option(help="a record of your own, in place of the simulated rig")
    ] = None,
    rig_file: RigOrPublished = None,
    input_name: InputColumn = "command_v",
    output_name: OutputColumn = "position_m",
    orders: Annotated[str, typer.Option(help="orders na = nb to try first")] = "2-5",
    delays: Annotated[str, typer.Option(help="delays nk to try first, in samples")] = "1-5",
    trend: Annotated[
        TrendName, typer.Option(help="what is taken off both signals before the first attempt")
    ] = TrendName.none,
    outliers: Annotated[
        bool, typer.Option("--outliers/--no-outliers", help="replace spikes of the output")
    ] = True,
    scaling: Annotated[
        bool, typer.Option("--scaling/--no-scaling", help="divide by standard deviations")
    ] = False,
    runs: Annotated[
        int, typer.Option(min=20, help="Monte Carlo runs of each comparison; not with --record")
    ] = 200,
    maps: Maps = None,
    sampling_time: SamplingTime = None,
    as_json: AsJson = False,
    out: Annotated[Path, typer.Option(help="folder of the report")] = Path("experiment"),
) -> None:
    """Redo the published experiment end to end, and say where its claims hold.

    Writes experiment.html, experiment.json, CSV tables and figures. With --record: the offline
    and the recursive half on that record. Exit code 2 where the record allows no sound model; the
    report says why.

    Example: ehsid experiment --out experiment

    Example: ehsid experiment --record rec.csv --rig rig.toml --out results
    """
    from ehsid.harness.models.identification import Preprocessing
    from ehsid.harness.models.identification.selection import MOST_DELAY, MOST_ORDER, parse_range
    from ehsid.harness.rigs import read_rig
    from ehsid.harness.rigs.new import published_rig

    from .experiment_report import FILES, OFFLINE_SEED, Offline, on_record, redo, write_report

    began = time.monotonic()
    offline = Offline(
        parse_range(orders, "--orders", MOST_ORDER),
        parse_range(delays, "--delays", MOST_DELAY),
        Preprocessing(trend.value, outliers, scaling),
    )
    inputs = [path for path in (record, rig_file) if path is not None]
    with result_folder(out, "experiment", FILES, inputs) as folder:
        rig = None if rig_file is None else read_rig(rig_file)
        if record is not None:
            report = on_record(
                record, rig, offline, input_name, output_name, hints_of(maps, sampling_time)
            )
        else:
            rig = rig or published_rig()
            if rig.plant != "ehs":
                raise ValueError(
                    f'{rig_file}: the experiment needs a plant "ehs", this is "{rig.plant}"; give '
                    "a record of it with --record"
                )
            with stages() as progress:
                report = redo(rig, offline, runs, progress)
        provenance = {
            "ehsid_version": ehsid.__version__,
            "record": None if record is None else str(record),
            "rig": "published" if rig_file is None else str(rig_file),
            "orders": orders,
            "delays": delays,
            "preprocessing": str(offline.preprocessing),
            "runs": runs,
            "offline_seed": OFFLINE_SEED,
            "seconds": round(time.monotonic() - began, 1),
        }
        write_report(folder, report, provenance)
    if as_json:
        typer.echo((out / "experiment.json").read_text(encoding="utf-8"))
    else:
        console = Console()
        print_points(report.lead, console, indent=0)
        console.print(f"report: {out / 'experiment.html'}", soft_wrap=True)
    if report.problems:
        source = record or rig_file or "the published rig"
        why = report.problems[0].rstrip(".")
        refuse(f"{source}: there is no sound model: {why}; see {out / 'experiment.html'}")
