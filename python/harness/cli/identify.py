# SPDX-License-Identifier: MIT
"""`ehsid identify`: identifies an ARX model offline, with its order and delay."""

from __future__ import annotations

import json
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from ehsid.harness.cli.common import (
    about,
    make_table,
    read_io,
)
from ehsid.harness.cli.console import Console
from ehsid.harness.cli.log_options import Maps, SamplingTime, hints_of
from ehsid.harness.cli.options import AsJson, InputColumn, OutputColumn, RecordFile
from ehsid.harness.files import result_folder
from ehsid.harness.report.model_file_names import IDENTIFICATION_FILES

if TYPE_CHECKING:
    from ehsid.harness.identification import IdentificationResult


def _table(result: IdentificationResult) -> Table:
    rows = [
        (
            f"{candidate.orders.na}{' *' * (candidate.orders == result.chosen.orders)}",
            str(candidate.orders.nk),
            f"{candidate.one_step_fit_percent:.2f}",
            f"{candidate.simulation_fit_percent:.2f}",
            f"{candidate.validation.fpe:.5g}",
            f"{candidate.validation.loss:.5g}",
            f"{candidate.validation.aic:.4g}",
            f"{candidate.validation.mdl:.4g}",
        )
        for candidate in result.by_order
    ]
    headings = ("order", "nk", "one-step %", "simulated %", "FPE", "loss", "AIC", "MDL")
    title = "fit on the validation half; the chosen order is marked"
    return make_table(headings, rows, title=title)


def identify_command(
    record: RecordFile,
    input_name: InputColumn = "command_v",
    output_name: OutputColumn = "position_m",
    orders: Annotated[str, typer.Option(help="orders na = nb to try, e.g. 2-5")] = "2-5",
    delays: Annotated[str, typer.Option(help="delays nk to try, in samples")] = "1-5",
    maps: Maps = None,
    sampling_time: SamplingTime = None,
    as_json: AsJson = False,
    out: Annotated[
        Path | None, typer.Option(help="folder for identify.json, .png and _bode.png")
    ] = None,
) -> None:
    r"""Choose order and delay of an ARX model on one half of a record, judged on the other.

    Examples: ehsid identify rec.csv --input u --output y --orders 2-5

    ehsid identify log.mf4 --map "command_v=Valve" --map "position_m=Stroke \[mm]"
    """
    from ehsid.harness.identification import identify
    from ehsid.harness.identification.search_range import MOST_DELAY, MOST_ORDER, parse_range
    from ehsid.harness.records.origin import with_reading

    with (
        nullcontext()
        if out is None
        else result_folder(out, "identify", IDENTIFICATION_FILES, [record]) as folder
    ):
        wanted_orders = parse_range(orders, "--orders", MOST_ORDER)
        wanted_delays = parse_range(delays, "--delays", MOST_DELAY)
        hints = hints_of(maps, sampling_time)
        data, origin = read_io(record, input_name, output_name, hints)
        with about(record):
            result = identify(data, orders=wanted_orders, delays=wanted_delays)
        lines = [
            result.reason,
            result.delay_reason,
            result.whiteness.verdict,
            result.independence.verdict,
            *result.advice,
        ]
        if folder is not None:
            from ehsid.harness.report.model_files import write_identification

            lines.append(write_identification(folder, result, data, origin))
    if as_json:
        typer.echo(json.dumps(with_reading(result.to_dict(), origin), allow_nan=False))
        return
    console = Console()
    console.print(_table(result))
    for line in lines:
        console.print(line)
