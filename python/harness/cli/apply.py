# SPDX-License-Identifier: MIT
"""`ehsid apply`: writes valve tables, friction and loop gains for the controller of a machine."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import typer

from ..base.files import result_folder
from .console import Console, note, print_blocks
from .options import AsJson


def apply_command(
    sources: Annotated[
        list[Path],
        typer.Argument(
            metavar="DIAGNOSIS_OR_RIG...",
            help="folder of `ehsid gap --out`, or rig file; and, or alone, an estimate.json",
        ),
    ],
    speed: Annotated[
        float, typer.Option(help="of the loop, from 0, calm, to 1, fast (6 dB and 45 degrees)")
    ] = 0.5,
    cycle: Annotated[float, typer.Option(help="cycle time of the controller, s")] = 1e-3,
    name: Annotated[str, typer.Option(help="prefix of names in C and Structured Text")] = "axis",
    as_json: AsJson = False,
    out: Annotated[
        Path | None,
        typer.Option(help="folder for CSV, Structured Text, TwinCAT, C, TOML, JSON and apply.html"),
    ] = None,
) -> None:
    """Write valve tables, friction and loop gains of a machine for its controller.

    The tables say what the valve does, and which command makes up for dead band, null bias and
    saturation. The gains have margins over the whole interval of the model, from calm to fast.
    What the model cannot carry is refused with the reason.

    Examples: ehsid apply diagnosis --out controller

    ehsid apply rig.augmented.toml results/estimate.json --speed 0.8 --cycle 0.002 --out controller
    """
    from ..base.encoding import json_text
    from ..commissioning import FILES, design
    from ..firmware import check_name
    from ..show.apply_page import apply_table, told, write_apply

    check_name(name)
    inputs = [
        file for one in sources for file in ([one] if one.is_file() else sorted(one.glob("*")))
    ]
    placing = nullcontext() if out is None else result_folder(out, "apply", FILES, inputs)
    with placing as folder:
        made = design(sources, speed=speed, cycle_s=cycle)
        if folder is not None:
            write_apply(folder, made, name=name)
    if as_json:
        typer.echo(json_text(made.result), nl=False)
        return
    console = Console()
    print_blocks([apply_table(made.result, sources=False)], console)
    for line in told(made.result):
        note(f"note: {line}")
    if out is not None:
        console.print(f"page: {out / 'apply.html'}", soft_wrap=True)
