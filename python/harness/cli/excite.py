# SPDX-License-Identifier: MIT
"""`ehsid excite`: chooses the signal that shows an effect best."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from ..base.encoding import to_plain
from ..base.files import result_files
from .console import Console, check_ending, print_blocks
from .lazy import effect_ids
from .options import AsJson
from .progress import progress_of

# Signals that are listed; the others are worse.
LISTED = 5


def excite_command(
    rig_file: Annotated[Path, typer.Argument(metavar="RIG", help="rig file, TOML")],
    effect: Annotated[
        str,
        typer.Option(
            "--for",
            metavar="EFFECT",
            help="id of the effect that the record shall show; `ehsid effects` lists them",
            autocompletion=effect_ids,
        ),
    ],
    out: Annotated[
        Path, typer.Option(help="record to write, with the command to send: csv, parquet, mat, npz")
    ],
    dt: Annotated[float, typer.Option(help="sampling time, s")] = 1e-3,
    pressures: Annotated[
        bool, typer.Option("--pressures", help="the chamber pressures are logged, too")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Choose the signal that shows an effect best, and say from which size on it would be seen.

    The signals keep inside stroke, command and pressure of the rig, and last 8 s. The record has
    the command, to be sent as it stands, and the position that the rig predicts.

    Example: ehsid excite rig.toml --for internal_leakage --pressures --out leak.csv
    """
    from ..catalogue.parameters import effects, plain_name
    from ..diagnosis import signals_for
    from ..records.record import record_bytes
    from ..rigs import read_rig
    from ..rigs.checks import unknown
    from ..show.page import Table
    from ..show.seen_words import seen_from

    check_ending(out)
    if effect not in effects():
        raise ValueError(f"--for {unknown(effect, effects())}")
    if not 0.0 < dt <= 0.1:
        raise ValueError(f"--dt {dt:g}: expected a sampling time of 0.1 s at most, above 0")
    with result_files(out, "excite", [], [rig_file]) as folder:
        rig = read_rig(rig_file)
        with progress_of(f"trying signals on {rig.name}") as progress:
            shown = signals_for(rig, effect, dt_s=dt, pressures=pressures, progress=progress)
        (folder / out.name).write_bytes(record_bytes(shown[0].record, out.name))
    if as_json:
        found = [{"description": one.description, "seen": to_plain(one.seen)} for one in shown]
        typer.echo(json.dumps(found))
        return
    console = Console()
    rows = [(one.description, seen_from(one.seen)) for one in shown[:LISTED]]
    print_blocks([Table("", ("signal", f"shows {plain_name(effect)}"), rows)], console)
    best = shown[0]
    if best.seen.limit == "none":
        console.print("no signal shows it at a size that a servo has; log more sensors")
    console.print(f"{best.description}: {out}", soft_wrap=True)
