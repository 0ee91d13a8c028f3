# SPDX-License-Identifier: MIT
"""`ehsid rig new`: writes a rig file of what is known, with typical values for the rest."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..base.files import result_files, write_text
from ..rigs.questions import EXAMPLES, QUESTIONS, Question, help_of
from .console import Console, print_blocks, refuse

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..rigs.curves import Bench
    from ..rigs.quantities import Quantity
    from ..rigs.rig_file import Entry


class PlantKind(StrEnum):
    """Machines that the command can describe."""

    ehs = "ehs"
    axis = "axis"


class DropOver(StrEnum):
    """Where a data sheet measures the drop of the rated flow."""

    edge = "edge"
    both = "both"


def _option(name: str) -> typer.models.OptionInfo:
    option: typer.models.OptionInfo = typer.Option(f"--{name}", help=help_of(name))
    return option


def _asked(question: Question, console: Console) -> Quantity | None:
    """Asks until the answer can be read; None for an empty one that is allowed."""
    from ..rigs.quantities import read_quantity

    console.print(f"\n{question.words}", style="bold", end="")
    console.print(f": {question.why}" if question.why else "")
    empty = "needed" if question.essential else "empty: not known"
    while True:
        answer = _answer(f"  such as {EXAMPLES[question.name]}; {empty}: ", console)
        if not answer and not question.essential:
            return None
        try:
            return read_quantity(answer, question.words, question.usual, question.si)
        except ValueError as error:
            console.print(f"  {error}")


def _on_a_terminal() -> bool:
    return sys.stdin is not None and sys.stdin.isatty()


def _yes(question: str, console: Console) -> bool:
    """Asks a question until the answer is yes or no; nothing is no."""
    while True:
        answer = _answer(f"\n{question} yes/no, empty: no: ", console).lower()
        if answer in ("", "n", "no", "y", "yes"):
            return answer.startswith("y")


def _answer(prompt: str, console: Console) -> str:
    console.print(prompt, end="", soft_wrap=True)
    try:
        return input().strip()
    except EOFError:
        refuse("the input has ended: expected an answer; give what is known by options instead")


def _known(
    plant: PlantKind, given: dict[str, str | None], console: Console
) -> tuple[dict[str, Quantity], bool]:
    """What the options give, and on a terminal the answers; and whether there were questions.

    Raises
    ------
    ValueError
        an option cannot be read or is of another plant, or one that is needed is missing.
    """
    from ..rigs.quantities import read_quantity

    questions = QUESTIONS[plant.value]
    known = {}
    for name, text in given.items():
        if text is None:
            continue
        question = next((q for q in questions if q.name == name), None)
        if question is None:
            raise ValueError(
                f'--{name}: a plant "{plant}" has no {name}: expected options of '
                f"{', '.join('--' + q.name for q in questions)}; leave it out, or correct --plant"
            )
        known[name] = read_quantity(text, f"--{name}", question.usual, question.si)
    missing = [q.name for q in questions if q.essential and q.name not in known]
    if not missing:
        return known, False
    if not _on_a_terminal():
        raise ValueError(
            f"{', '.join('--' + name for name in missing)}: missing: expected such as "
            + " ".join(f"--{name} '{EXAMPLES[name]}'" for name in missing)
            + "; give them, or start the command on a terminal, where it asks"
        )
    console.print("What is not known can be left empty; a typical value is then taken.")
    for question in questions:
        if question.name not in known:
            answer = _asked(question, console)
            if answer is not None:
                known[question.name] = answer
    return known, True


def _of_one_edge(
    known: dict[str, Quantity], over: DropOver | None, asked: bool, console: Console
) -> None:
    """Makes the rated drop that of one edge; asks, or says which was taken."""
    from ..rigs.questions import of_one_edge

    drop = known.get("rated-drop")
    if drop is None:
        if over is not None:
            raise ValueError("--drop-over: expected --rated-drop with it; give both, or neither")
        return
    if over is None and asked:
        both = _yes(f"Is the drop of {drop.text} that over both edges, P to A and B to T?", console)
        over = DropOver.both if both else DropOver.edge
    if over is DropOver.both:
        known["rated-drop"] = of_one_edge(drop)
    elif over is None:
        console.print(
            f"note: the rated drop of {drop.text} was taken for one edge, P to A; if the data "
            "sheet means both edges, which is usual for 70 and 10 bar, add --drop-over both",
            soft_wrap=True,
        )


def _bench(curves: Sequence[Path], given: dict[str, str | None], over: DropOver | None) -> Bench:
    """Reads test curves of the valve; puts the rated flow that they tell among what is given.

    Raises
    ------
    ValueError
        a curve cannot be used, or the rated flow is given twice.
    """
    from ..rigs.curves import bench_of, read_curve
    from ..rigs.quantities import rated_command, rated_drop, read_quantity, tank_pressure

    def known(name: str, usual: str, si: str, typical: float) -> float:
        text = given[name]
        return typical if text is None else read_quantity(text, f"--{name}", usual, si).value

    rated = known("rated-command", "V", "command", rated_command().value)
    drop = known("rated-drop", "bar", "Pa", rated_drop().value)
    if over is DropOver.both:
        drop *= 0.5
    tank = known("tank", "bar", "Pa", tank_pressure().value)
    supply = known("supply", "bar", "Pa", 2.0 * drop + tank)
    bench = bench_of([read_curve(path, rated) for path in curves], drop, supply - tank)
    if bench.rated_flow is not None:
        if given["rated-flow"] is not None:
            raise ValueError(
                f"--rated-flow {given['rated-flow']}: the curve of the flow tells "
                f"{bench.rated_flow}: expected one of them; leave out the option, or the curve"
            )
        given["rated-flow"] = bench.rated_flow
    return bench


def _print(entries: Sequence[Entry], out: Path, console: Console) -> None:
    from ..show.page import Table

    rows = [
        (
            entry.key,
            entry.shown,
            "given" if entry.given else "typical",
            "" if entry.sigma is None else f"{100.0 * entry.sigma:g} %",
        )
        for entry in entries
    ]
    print_blocks([Table("", ("value", "is", "origin", "1-sigma"), rows)], console)
    console.print("Typical values, and why:")
    reasons: dict[str, list[str]] = {}
    for entry in entries:
        if not entry.given and entry.sigma is not None:
            reasons.setdefault(entry.why, []).append(f"{entry.key} {entry.shown}")
    for why, values in reasons.items():
        console.print(f"  {', '.join(values)}: {why}", soft_wrap=True)
    console.print(f"rig: {out}", soft_wrap=True)
    console.print(f"next: ehsid rig check {out} RECORD", soft_wrap=True)


def _of_simulator(
    simulator: str, out: Path, name: str, given: dict[str, str | None], console: Console
) -> None:
    """Writes the rig file of a user's simulator, and prints what was taken for what."""
    from ..rigs.quantities import read_quantity
    from ..rigs.simulator_new import GIVEN, new_simulator_rig

    stated = {name: text for name, text in given.items() if text is not None}
    others = [f"--{name}" for name in stated if name not in GIVEN]
    if others:
        raise ValueError(
            f"{', '.join(others)}: a simulator has this itself: expected only "
            f"{', '.join(f'--{name}' for name in GIVEN)} with --simulator; leave it out"
        )
    asked = {question.name: question for question in QUESTIONS["ehs"]}
    known = {
        name: read_quantity(text, f"--{name}", asked[name].usual, asked[name].si)
        for name, text in stated.items()
    }
    with result_files(out, "rig-new") as folder:
        made = new_simulator_rig(simulator, out.absolute().parent, name or out.stem, known)
        write_text(folder / out.name, made.text)
    from ..show.page import Table

    print_blocks([Table("", ("value", "is", "why"), list(made.taken))], console)
    if made.missing:
        console.print("to be filled in before it is a rig:")
        for problem in made.missing:
            console.print(f"  {problem}", soft_wrap=True)
    console.print(f"rig: {out}; fill in its lines with '# ...  # fill in'", soft_wrap=True)
    console.print(f"next: ehsid rig check {out} RECORD", soft_wrap=True)


def rig_new_command(
    out: Annotated[Path, typer.Option(help="rig file to write, TOML")],
    plant: Annotated[
        PlantKind, typer.Option(help="ehs: valve and cylinder; axis: motor-driven, by force")
    ] = PlantKind.ehs,
    name: Annotated[str, typer.Option(help="of the machine; default: that of the file")] = "",
    bore: Annotated[str | None, _option("bore")] = None,
    rod: Annotated[str | None, _option("rod")] = None,
    double_rod: Annotated[
        bool, typer.Option("--double-rod", help="the rod is on both sides of the piston")
    ] = False,
    stroke: Annotated[str | None, _option("stroke")] = None,
    supply: Annotated[str | None, _option("supply")] = None,
    tank: Annotated[str | None, _option("tank")] = None,
    mass: Annotated[str | None, _option("mass")] = None,
    rated_flow: Annotated[str | None, _option("rated-flow")] = None,
    rated_drop: Annotated[str | None, _option("rated-drop")] = None,
    drop_over: Annotated[
        DropOver | None, typer.Option(help="edges over which the rated drop is measured")
    ] = None,
    rated_command: Annotated[str | None, _option("rated-command")] = None,
    valve_bandwidth: Annotated[str | None, _option("valve-bandwidth")] = None,
    bulk_modulus: Annotated[str | None, _option("bulk-modulus")] = None,
    hoses: Annotated[
        bool, typer.Option("--hoses", help="flexible hoses between valve and cylinder")
    ] = False,
    oil: Annotated[str | None, _option("oil")] = None,
    accumulator_volume: Annotated[str | None, _option("accumulator-volume")] = None,
    accumulator_precharge: Annotated[str | None, _option("accumulator-precharge")] = None,
    dead_volume: Annotated[str | None, _option("dead-volume")] = None,
    line_length: Annotated[str | None, _option("line-length")] = None,
    line_bore: Annotated[str | None, _option("line-bore")] = None,
    friction: Annotated[str | None, _option("friction")] = None,
    viscous_friction: Annotated[str | None, _option("viscous-friction")] = None,
    force_gain: Annotated[str | None, _option("force-gain")] = None,
    position_noise: Annotated[str | None, _option("position-noise")] = None,
    pressure_noise: Annotated[str | None, _option("pressure-noise")] = None,
    curves: Annotated[
        list[Path] | None,
        typer.Option(
            help="test curves of the valve, ISO 10770-1: flow, load pressure at blocked ports, "
            "leakage, each over the signal"
        ),
    ] = None,
    simulator: Annotated[
        str | None,
        typer.Option(help="your own simulator instead: model.fmu, or FILE.py:NAME; never run"),
    ] = None,
) -> None:
    """Write a rig file from what is known of a machine, and fill in the rest.

    Numbers have units: '63 mm', '120 bar', '38 l/min', '120 kg +- 20 %'. On a terminal the command
    asks for what is missing. Typical values have a reason and an honest uncertainty, in the file,
    too.

    Example: ehsid rig new --bore "63 mm" --rod "35 mm" --stroke "300 mm" --supply "120 bar"
    --rated-flow "38 l/min" --mass "120 kg" --out rig.toml

    ehsid rig new --simulator model.fmu --stroke "300 mm" --out rig.toml

    ehsid rig new --curves flow_gain.csv pressure_gain.csv leakage.csv --out rig.toml
    """
    console = Console()
    given = {
        "bore": bore,
        "rod": rod,
        "stroke": stroke,
        "supply": supply,
        "tank": tank,
        "mass": mass,
        "rated-flow": rated_flow,
        "rated-drop": rated_drop,
        "rated-command": rated_command,
        "valve-bandwidth": valve_bandwidth,
        "bulk-modulus": bulk_modulus,
        "oil": oil,
        "accumulator-volume": accumulator_volume,
        "accumulator-precharge": accumulator_precharge,
        "dead-volume": dead_volume,
        "line-length": line_length,
        "line-bore": line_bore,
        "friction": friction,
        "viscous-friction": viscous_friction,
        "force-gain": force_gain,
        "position-noise": position_noise,
        "pressure-noise": pressure_noise,
    }
    if curves and (simulator is not None or plant is PlantKind.axis):
        raise ValueError(
            "--curves: expected a plant ehs, whose valve they describe; leave them out"
        )
    if simulator is not None:
        _of_simulator(simulator, out, name, given, console)
        return
    with result_files(out, "rig-new", inputs=curves or []) as folder:
        from ..rigs.new import axis_entries, ehs_entries
        from ..rigs.questions import check_pairs, rig_file_text

        bench = _bench(curves, given, drop_over) if curves else None
        known, asked = _known(plant, given, console)
        assumed = [
            f"{quantity.text} for --{one}" for one, quantity in known.items() if quantity.assumed
        ]
        if assumed:
            console.print(f"note: taken as {', '.join(assumed)}, since no unit was given")
        if plant is PlantKind.axis:
            entries = axis_entries(known)
        else:
            _of_one_edge(known, drop_over, asked, console)
            if asked:
                double_rod = double_rod or _yes("Is the rod on both sides of the piston?", console)
                hoses = hoses or _yes("Do hoses connect valve and cylinder?", console)
            check_pairs(known)
            entries = ehs_entries(known, double_rod=double_rod, hoses=hoses)
        if bench is not None:
            entries += bench.entries
            for note in bench.notes:
                console.print(f"curves: {note}", soft_wrap=True)
        write_text(folder / out.name, rig_file_text(name or out.stem, plant.value, entries))
    _print(entries, out, console)
