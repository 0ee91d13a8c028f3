# SPDX-License-Identifier: MIT
"""`ehsid identify`: identifies an ARX model offline, with its order and delay."""

from __future__ import annotations

import json
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import typer

from ..base.files import result_folder
from ..show.model_file_names import IDENTIFICATION_FILES
from .console import Console, about, print_blocks
from .next_command import Given, estimate_line, print_next
from .options import (
    AsJson,
    InputColumn,
    Maps,
    OutputColumn,
    RecordFile,
    SamplingTime,
    hints_of,
    read_io,
)


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
    from ..models.identification import identify
    from ..models.identification.selection import MOST_DELAY, MOST_ORDER, parse_range
    from ..records.record import with_reading
    from ..show.model_blocks import model_told

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
        given = Given(record, input_name, output_name, maps or (), sampling_time)
        following = estimate_line(given, result.chosen.orders)
        blocks = model_told(result, input_name, output_name).blocks()
        if folder is not None:
            from ..show.model_figures import write_identification

            blocks.append(write_identification(folder, result, data, origin))
    if as_json:
        plain = {**with_reading(result.to_dict(), origin), "next_command": following or None}
        typer.echo(json.dumps(plain, allow_nan=False))
        return
    console = Console()
    print_blocks(blocks, console)
    print_next(following, console)
