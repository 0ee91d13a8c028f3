# SPDX-License-Identifier: MIT
"""`ehsid gap-edit`: was a change of the machine what the diagnosis named?"""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import typer

from ..base.files import result_folder
from .console import Console, note, print_blocks
from .lazy import effect_ids
from .options import RECORD_HELP, AsJson, Maps, SamplingTime, hints_of
from .progress import progress_of


def gap_edit_command(
    folder: Annotated[
        Path,
        typer.Argument(metavar="DIAGNOSIS", help="folder of `ehsid gap --out`, from before"),
    ],
    records: Annotated[
        list[Path],
        typer.Argument(metavar="RECORD...", help=f"from after the change: {RECORD_HELP}"),
    ],
    effect: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ID[=SHARE]",
            help="named effect that was changed, with the share of its size that should be left; "
            "default 0, removed. Again for more. Without it: each named effect, then all of them",
            autocompletion=effect_ids,
        ),
    ] = None,
    maps: Maps = None,
    sampling_time: SamplingTime = None,
    as_json: AsJson = False,
    out: Annotated[
        Path | None,
        typer.Option(help="folder for edit.html, edit.json and simulation.csv"),
    ] = None,
) -> None:
    """Test whether a change of the machine was what the diagnosis named: was it that?

    Takes the named effect out of the simulator that the diagnosis found, without a fit, and
    compares it with records that were taken after the change. Tells how much of the effect is left.

    Examples: ehsid gap-edit diagnosis after.csv --out edit

    ehsid gap-edit diagnosis after.csv --effect valve_dead_band=0.5
    """
    from ..base.encoding import json_text
    from ..diagnosis.edits import edit_test, parse_edits, read_twin
    from ..diagnosis.user_simulator import engine_of
    from ..records.record import told_apart
    from ..show.edit_page import FILES, TITLES, edit_table, write_edit
    from .gap import read_for

    inputs = [*records, folder / "diagnosis.json", folder / "rig.augmented.toml"]
    placing = nullcontext() if out is None else result_folder(out, "gap-edit", FILES, inputs)
    with placing as place:
        twin = read_twin(folder)
        edits = parse_edits(effect or (), twin)
        used = told_apart(read_for(twin.rig, records, hints_of(maps, sampling_time)))
        with progress_of("editing the twin") as progress, engine_of(twin.rig) as engine:
            result, runs = edit_test(twin, used, edits, engine=engine, progress=progress)
        if place is not None:
            write_edit(place, result, runs)
    if as_json:
        typer.echo(json_text(result), nl=False)
        return
    console = Console()
    console.print(f"\n{TITLES[result.outcome]}", style="bold")
    console.print(result.sentence, style="bold")
    console.print()
    print_blocks([edit_table(result)], console)
    for line in result.notes:
        note(f"note: {line}")
    if out is not None:
        console.print(f"\npage: {out / 'edit.html'}", soft_wrap=True)
