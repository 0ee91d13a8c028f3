# SPDX-License-Identifier: MIT
"""`python -m ehsid.lab.reality` writes blind cases, and their answers elsewhere."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, cast

import typer
from rich.progress import Progress

from .batch import write_cases
from .case import COLUMNS, KINDS, Kind, Sensors
from .excitation import EXCITATION_SETS, ExcitationSet
from .nominal_rig import PLANTS, PlantKind
from .variants import GRADES, Grade


def _check_known(name: str, value: str | None, known: tuple[str, ...]) -> None:
    if value is not None and value not in known:
        raise typer.BadParameter(f"'{value}' is not one of {', '.join(known)}", param_hint=name)


def command(
    out: Annotated[Path, typer.Option(help="folder of the cases, one folder each")],
    answers: Annotated[Path, typer.Option(help="JSON file of the answers, outside of --out")],
    seed: Annotated[int, typer.Option(min=0, help="of the first case; the others count on")] = 1,
    count: Annotated[int, typer.Option(min=1, help="number of cases")] = 20,
    grade: Annotated[str, typer.Option(help=", ".join(GRADES))] = "plain",
    kind: Annotated[str | None, typer.Option(help=f"{', '.join(KINDS)}; a mix if left out")] = None,
    sensors: Annotated[
        str | None, typer.Option(help=f"{', '.join(COLUMNS)}; a mix if left out")
    ] = None,
    plant: Annotated[str, typer.Option(help=", ".join(PLANTS))] = "ehs",
    excitations: Annotated[
        str, typer.Option(help=f"of wide cases, of two disjoint sets: {', '.join(EXCITATION_SETS)}")
    ] = "all",
) -> None:
    """Write blind cases: rig.toml, train.csv and validate.csv of machines with withheld effects."""
    _check_known("--grade", grade, GRADES)
    _check_known("--kind", kind, KINDS)
    _check_known("--sensors", sensors, tuple(COLUMNS))
    _check_known("--plant", plant, PLANTS)
    _check_known("--excitations", excitations, tuple(EXCITATION_SETS))
    with Progress(transient=True) as bar:
        task = bar.add_task("cases", total=1.0)
        try:
            write_cases(
                out,
                answers,
                range(seed, seed + count),
                cast(Grade, grade),
                cast(Kind | None, kind),
                cast(Sensors | None, sensors),
                cast(PlantKind, plant),
                progress=lambda share: bar.update(task, completed=share),
                among=cast(ExcitationSet, excitations),
            )
        except (ValueError, OSError) as error:
            raise typer.BadParameter(str(error)) from error
    typer.echo(f"{count} cases in {out}, answers in {answers}")


app = typer.Typer(add_completion=False)
app.command()(command)

if __name__ == "__main__":
    app()
