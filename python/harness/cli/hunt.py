# SPDX-License-Identifier: MIT
"""`ehsid hunt`: experiment after experiment on a machine, until one cause is left."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..base.files import result_folder
from ..base.parallel import workers as using
from .console import Console, note, print_blocks, refuse
from .gap import read_for, with_diagnosis_options
from .options import AsJson, Maps, SamplingTime, Workers, hints_of

if TYPE_CHECKING:
    from ..diagnosis.limits import Limits
    from ..diagnosis.options import DiagnosisOptions
    from ..hunt.hunting import Hunt
    from ..rigs import Rig


def limit(what: str, example: str) -> typer.models.OptionInfo:
    """Returns an option that is a limit."""
    found: typer.models.OptionInfo = typer.Option(
        metavar="QUANTITY", help=f"largest {what}, such as '{example}'", show_default=False
    )
    return found


@with_diagnosis_options
def hunt_command(
    rig_file: Annotated[
        Path, typer.Option("--rig", help="the machine as it is known: rig file, TOML")
    ],
    machine: Annotated[
        str,
        typer.Option(
            metavar="FILE|FILE.py:NAME",
            help="what the experiments run on: a class with reset and step, or a rig file whose "
            "plant plays the machine",
        ),
    ],
    out: Annotated[Path, typer.Option(help="folder of the results")],
    records: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[RECORD...]", help="records of the machine that there are"),
    ] = None,
    budget: Annotated[int, typer.Option(min=1, max=20, help="most experiments")] = 3,
    travel: Annotated[
        tuple[str, str] | None,
        typer.Option(
            metavar="LOW HIGH",
            help="positions between which the rod stays, such as '20 mm' '280 mm'; default: the "
            "stroke",
            show_default=False,
        ),
    ] = None,
    max_command: Annotated[str | None, limit("command; default: the rated one", "6 V")] = None,
    max_speed: Annotated[str | None, limit("speed; default: none", "200 mm/s")] = None,
    max_pressure: Annotated[
        str | None, limit("pressure of a chamber; default: 1.5 times that of the supply", "180 bar")
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, help="of the noise, where a rig file plays the machine")
    ] = 1,
    options: DiagnosisOptions = None,  # type: ignore[assignment]
    maps: Maps = None,
    sampling_time: SamplingTime = None,
    workers: Workers = None,
    as_json: AsJson = False,
) -> None:
    r"""Hunt a cause: diagnosis, the experiment that tells most, diagnosis, until one is left.

    An experiment lasts 8 s, with the sampling time of the records, else 1 ms. The limits are looked
    at before each command. Without RECORD the first one is a look at the whole machine.

    Writes hunt.html, hunt.json, the record of each experiment, and the last diagnosis. Exit code 0
    whatever is found, 2 for bad input.

    Examples: ehsid hunt --rig rig.toml --machine bench.py:Axis --max-speed '200 mm/s' --out hunt

    ehsid hunt run1.csv --rig rig.toml --machine secret.toml --out hunt
    """
    from dataclasses import replace

    from ..hunt.hunting import experiment_dt, hunt
    from ..hunt.machines import machine_of
    from ..records.record import told_apart
    from ..rigs import read_rig
    from ..show.hunt_page import FILES, write_hunt
    from .progress import progress_of

    inputs = [*(records or []), rig_file]
    with result_folder(out, "hunt", FILES, inputs) as folder:
        rig = read_rig(rig_file)
        known = told_apart(read_for(rig, records or [], hints_of(maps, sampling_time)))
        limits = limits_in(rig, travel, max_command, max_speed, max_pressure)
        on = machine_of(machine, dt_s=experiment_dt(known), seed=seed)
        with using(workers), progress_of(f"hunting on {on.name}") as progress:
            hunted = hunt(
                on,
                rig,
                known,
                budget=budget,
                options=replace(options, limits=limits),
                progress=progress,
                note=note,
            )
        write_hunt(hunted, folder, str(rig_file))
    if as_json:
        typer.echo((out / "hunt.json").read_text(encoding="utf-8"), nl=False)
    else:
        _print(hunted.told, out / "hunt.html", Console())


def limits_in(
    rig: Rig,
    travel: tuple[str, str] | None,
    command: str | None,
    speed: str | None,
    pressure: str | None,
) -> Limits | None:
    """Returns the limits of the rig file, with those of the options in their place."""
    from dataclasses import replace

    from ..diagnosis import Limits, limits_of
    from ..rigs.quantities import read_quantity

    def read(text: str, option: str, usual: str, si: str) -> float:
        return read_quantity(text, option, usual, si).value

    changed: dict[str, object] = {}
    if travel is not None:
        low, high = (read(text, "--travel", "mm", "m") for text in travel)
        if not low < high:
            refuse(f"--travel '{travel[0]}' '{travel[1]}': expected the smaller position first")
        changed["position_m"] = (low, high)
    for name, text, option, usual, si in (
        ("command_v", command, "--max-command", "V", "command"),
        ("speed_m_s", speed, "--max-speed", "mm/s", "m/s"),
        ("pressure_pa", pressure, "--max-pressure", "bar", "Pa"),
    ):
        if text is not None:
            value = changed[name] = read(text, option, usual, si)
            if not value > 0.0:
                refuse(f"{option} '{text}': expected a limit above 0")
    known = limits_of(rig)
    if known is not None:
        return replace(known, **changed)  # type: ignore[arg-type]
    if {"position_m", "command_v"} <= changed.keys():
        return Limits(**changed)  # type: ignore[arg-type]
    return None


def _print(hunt: Hunt, page: Path, console: Console) -> None:
    from ..show.hunt_page import EXPERIMENTS, experiment_rows, hunt_lead
    from ..show.page import Table

    for sentence in hunt_lead(hunt):
        console.print(sentence)
    print_blocks([Table("", EXPERIMENTS, experiment_rows(hunt))], console)
    console.print(f"\nreport: {page}", soft_wrap=True)
