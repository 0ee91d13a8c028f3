# SPDX-License-Identifier: MIT
"""`ehsid start`: from logs and a name plate to a diagnosis, by the commands that do it alone."""

from __future__ import annotations

import os
import shlex
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..catalogue.channels import COMMAND, POSITION
from ..rigs.quantities import read_quantity
from ..rigs.questions import (
    EHS,
    EXAMPLES,
    FULL,
    FULL_PERCENT,
    PERCENT,
    answered,
    help_of,
    rig_file_text,
)
from .console import Console, note, refuse
from .importing import imported, print_record
from .options import Maps, SamplingTime
from .rig_new import _asked, _on_a_terminal

if TYPE_CHECKING:
    pass

# The values of a name plate that have no typical value; mass and drop are better than guessed.
PLATE = tuple(question for question in EHS if question.essential)
RECORD, RIG, DIAGNOSIS = "{}.npz", "rig.toml", "diagnosis"


def _plate(name: str) -> typer.models.OptionInfo:
    needed, _, _ = help_of(name).partition("; needed")  # of the plants of `rig new`
    option: typer.models.OptionInfo = typer.Option(f"--{name}", help=needed, show_default=False)
    return option


def start_command(
    logs: Annotated[
        list[Path], typer.Argument(metavar="LOG...", help="logs of the machine, of any kind")
    ],
    out: Annotated[Path, typer.Option(help="folder of the results")] = Path("start"),
    bore: Annotated[str | None, _plate("bore")] = None,
    rod: Annotated[str | None, _plate("rod")] = None,
    stroke: Annotated[str | None, _plate("stroke")] = None,
    supply: Annotated[str | None, _plate("supply")] = None,
    rated_flow: Annotated[str | None, _plate("rated-flow")] = None,
    rated_drop: Annotated[str | None, _plate("rated-drop")] = None,
    rated_command: Annotated[str | None, _plate("rated-command")] = None,
    mass: Annotated[str | None, _plate("mass")] = None,
    maps: Maps = None,
    sampling_time: SamplingTime = None,
    show: Annotated[
        bool, typer.Option("--open/--no-open", help="open the report in the browser at the end")
    ] = True,
) -> None:
    """Go from logs and the name plate of a machine to a diagnosis, and say what did it.

    Imports the logs, asks on a terminal for the five values of the name plate, writes a rig file,
    checks it against the records, and diagnoses the gap. A rig file that is in the folder already
    is taken as it is: correct it, and start again.

    Examples: ehsid start run1.csv

    ehsid start run1.csv run2.csv --bore "63 mm" --rod "35 mm" --stroke "300 mm"
    --supply "120 bar" --rated-flow "38 l/min" --mass "120 kg" --out press
    """
    names = [log.name.partition(".")[0] for log in logs]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        refuse(f"two logs are named '{twice[0]}': expected each name once; rename one of them")
    missing = [log for log in logs if not log.is_file()]
    if missing:
        refuse(f"{missing[0]}: there is no such file: expected a log; check the path")
    given = {
        "bore": bore,
        "rod": rod,
        "stroke": stroke,
        "supply": supply,
        "rated-flow": rated_flow,
        "rated-drop": rated_drop,
        "rated-command": rated_command,
        "mass": mass,
    }
    rig = out / RIG
    new = not rig.is_file()
    if new:
        _check(given)
    reading = [word for one in maps or () for word in ("--map", one)]
    if sampling_time is not None:
        reading += ["--dt", f"{sampling_time:.12g}"]
    out.mkdir(parents=True, exist_ok=True)
    records = [out / RECORD.format(name) for name in names]
    lines: list[list[str]] = []
    units: set[str] = set()
    for log, record in zip(logs, records, strict=True):
        lines.append(["import", os.fspath(log), *reading, "--out", os.fspath(record)])
        _say(lines[-1])
        try:
            made = imported(log, maps, sampling_time, record, required=(COMMAND, POSITION))
        except ValueError:
            with suppress(OSError):  # nothing is left where it is empty
                out.rmdir()
            raise
        print_record(made, record, Console())
        units.add(made.own_unit(COMMAND) or "V")
    first = len(lines)
    if new:
        plate = _plate_words(given, units)
        lines.append(["rig", "new", *plate, "--name", out.absolute().name, "--out", os.fspath(rig)])
    else:
        unused = ", ".join(f"--{name}" for name, text in given.items() if text is not None)
        end = f"; not used: {unused}. Edit this file, or name another --out" if unused else ""
        note(f"the rig file {rig} is taken as it is{end}")
    used = list(map(os.fspath, records))
    lines.append(["rig", "check", os.fspath(rig), *used])
    diagnosis = os.fspath(out / DIAGNOSIS)
    lines.append(["gap", *used, "--rig", os.fspath(rig), "--out", diagnosis])
    for line in lines[first:]:
        _run(line)
    console = Console()
    console.print("\nThese commands did it; each has --help:")
    for line in lines:
        console.print(f"  {_shown(line)}", soft_wrap=True)
    report = (out / DIAGNOSIS / "report.html").absolute()
    if show and _on_a_terminal():
        typer.launch(report.as_uri())


def _check(given: Mapping[str, str | None]) -> None:
    """Refuses values that cannot be read, or that are missing where nobody can be asked."""
    missing = [question for question in PLATE if given[question.name] is None]
    if missing and not _on_a_terminal():
        options = " ".join(f"--{one.name} '{EXAMPLES[one.name]}'" for one in missing)
        refuse(
            f"{', '.join(f'--{one.name}' for one in missing)}: missing: expected such as "
            f"{options}; give them, or start the command on a terminal, where it asks"
        )
    texts = {name: text for name, text in given.items() if text}
    try:
        for question in EHS:
            if text := texts.get(question.name):
                read_quantity(text, f"--{question.name}", question.usual, question.si)
        if not missing:
            rig_file_text("start", "ehs", answered("ehs", texts))
    except ValueError as error:
        refuse(str(error))


def _plate_words(given: Mapping[str, str | None], units: Collection[str]) -> list[str]:
    """The options of `ehsid rig new`; asks on a terminal for what is needed and not given."""
    texts = {name: text for name, text in given.items() if text}
    needed = [*PLATE]
    if PERCENT in units:
        texts.setdefault(FULL, FULL_PERCENT)
    elif "mA" in units and FULL not in texts:
        if not _on_a_terminal():
            refuse(
                f"--{FULL}: missing, and the command of the logs is in mA: expected the command "
                f"at full opening, such as --{FULL} '20 mA'; the data sheet of the valve has it"
            )
        needed.append(next(one for one in EHS if one.name == FULL))
    console = Console()
    for question in needed:
        if question.name not in texts:
            answer = _asked(question, console)
            if answer is not None:
                texts[question.name] = answer.text
    _check({question.name: texts.get(question.name) for question in EHS})
    return [word for name, text in texts.items() for word in (f"--{name}", text)]


def _run(line: Sequence[str]) -> None:
    """Runs one of our commands, as if it were typed; ends where it ends with an error."""
    from . import cli

    _say(line)
    code = cli(list(line), prog_name="ehsid", standalone_mode=False)
    if code:
        raise typer.Exit(int(code))


def _say(line: Sequence[str]) -> None:
    Console().print(f"\n$ {_shown(line)}", style="bold", soft_wrap=True)


def _shown(line: Sequence[str]) -> str:
    return shlex.join(["ehsid", *line])
