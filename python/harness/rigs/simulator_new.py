# SPDX-License-Identifier: MIT
"""Makes the rig file of a user's simulator of what the simulator says of itself.

Nothing of it runs. What cannot be told stands in the file as a comment, with the names that may be
meant.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import tomli_w

from ..base.error_words import printable
from ..catalogue.parameters import plant_parameters
from ..records.units import is_convertible
from ..simulators.description import REAL, FmuError, read_description
from ..simulators.source import SourceError, read_place, read_source
from .checks import RigError
from .quantities import Quantity
from .rig_file import WIDTH, parse_rig
from .simulator_guess import (
    SUPPLY,
    Guess,
    Named,
    guess_signals,
    is_start,
    known_values,
    uncertain,
    unit_of,
)
from .simulator_section import COMMAND, OUTPUTS, PORTS, UNITS

POSITION = "position_m"
# Option of the command -> value of the rig file.
GIVEN = {
    "rated-command": "valve.rated_command_v",
    "stroke": "cylinder.stroke_m",
    "supply": "supply.pressure_pa",
    "tank": "supply.tank_pressure_pa",
}
USUAL_COMMAND_V = 10.0
# Of a Python simulator that does not state its inputs or outputs.
UNTOLD = "not told by the simulator: correct the name"
# What a value of the rig file is needed for.
NEEDED_FOR = {
    "cylinder.stroke_m": "for effects that are stated about a place of the stroke",
    "supply.pressure_pa": "for relief valves and a supply that droops",
    "supply.tank_pressure_pa": "for leaks to the tank",
}
EXAMPLES = {
    "cylinder.stroke_m": "0.3",
    "supply.pressure_pa": "1.4e7",
    "supply.tank_pressure_pa": "2e5",
}
# More values than this are not of one machine; a model of a whole vehicle has thousands.
MOST_COMMENTED = 200


@dataclass(frozen=True)
class NewRig:
    """A rig file as it is written for a simulator."""

    text: str
    taken: tuple[tuple[str, str, str], ...]
    """Key of the rig file, what it was set to, and why."""
    missing: tuple[str, ...]
    """What is to be filled in before the file is a rig, one sentence each."""


@dataclass(frozen=True)
class _Simulator:
    key: str
    stated: str
    inputs: Sequence[Named]
    outputs: Sequence[Named]
    values: Sequence[Named]
    start: str | None = None
    """Name of the value that states where a run begins."""
    remarks: Sequence[str] = ()


def new_simulator_rig(
    simulator: str, folder: Path, name: str, known: Mapping[str, Quantity]
) -> NewRig:
    """Returns the rig file of an FMU, or of a class or function in Python.

    Parameters
    ----------
    simulator
        path of an FMU, or FILE.py:NAME, or MODULE:NAME, from the current folder.
    folder
        where the rig file will stand; paths in it are relative to this folder.
    name
        of the machine.
    known
        what is known of the machine, by the keys of `GIVEN`.

    Raises
    ------
    RigError
        the simulator cannot be read.
    """
    found = _simulator(simulator, folder)
    guesses = guess_signals(found.inputs, found.outputs)
    ports = [key for key in PORTS if guesses[key].chosen is not None]
    taken: list[tuple[str, str, str]] = []
    lines = [
        "# Made by `ehsid rig new --simulator`, without running the simulator. Check what was",
        "# taken for what, and fill in what stands behind '#'. docs/rigs.md describes each key.",
        tomli_w.dumps({"name": name, "plant": "simulator"}).rstrip("\n"),
        *_machine(known_values(found.values), known, taken),
        "",
        "[simulator]",
        _line(found.key, found.stated, "relative to this file"),
        *(f"# {remark}" for remark in found.remarks),
        "",
        "# [simulator.scales]  # what the sizes of effects are compared with",
        "# force_n = 40000.0   # largest force: supply pressure times the larger area",
        "# flow_m3_s = 7e-4    # flow of the open valve at half of the supply pressure",
        *_signals("inputs", {COMMAND: guesses[COMMAND]}, COMMAND, taken),
        *_signals("outputs", {key: guesses[f"outputs.{key}"] for key in OUTPUTS}, POSITION, taken),
        *_signals("ports", {key: guesses[key] for key in PORTS}, None, taken),
        *_start(found.start, taken),
        *_parameters(found.values, "supply_pressure_pa" in ports, taken),
    ]
    text = "\n".join(lines) + "\n"
    return NewRig(text, tuple(taken), _missing(text, folder))


def _missing(text: str, folder: Path) -> tuple[str, ...]:
    try:
        parse_rig(text, source="rig new", folder=folder)
    except RigError as error:
        return error.problems
    return ()


def _simulator(stated: str, folder: Path) -> _Simulator:
    """Returns what a simulator says of itself."""
    if stated.endswith(".fmu") or ":" not in stated.removeprefix(Path(stated).drive):
        return _of_fmu(stated, folder)
    place = read_place(stated)
    if place is None:
        raise RigError(
            stated, ["expected an FMU, or FILE.py:NAME, or MODULE:NAME; check --simulator"]
        )
    if not place.is_file:
        return _Simulator("python", stated, *_of_python((), None, None))
    try:
        source = read_source(Path(place.where), place.name)
    except SourceError as error:
        raise RigError(stated, [str(error)]) from None
    values = [Named(name, start=value) for name, value in source.parameters.items()]
    return _Simulator(
        "python",
        f"{_from(folder, place.where)}:{place.name}",
        *_of_python(values, source.inputs, source.outputs),
        POSITION if POSITION in source.start_arguments else None,
    )


def _of_python(
    values: Sequence[Named], inputs: Sequence[str] | None, outputs: Sequence[str] | None
) -> tuple[list[Named], list[Named], Sequence[Named]]:
    """Returns inputs, outputs and values; what the text does not tell has the contract's name."""
    return (
        [Named(name) for name in inputs] if inputs else [Named(COMMAND, None, UNTOLD)],
        [Named(name) for name in outputs] if outputs else [Named(POSITION, None, UNTOLD)],
        values,
    )


def _of_fmu(stated: str, folder: Path) -> _Simulator:
    try:
        description = read_description(Path(stated))
    except FmuError as error:
        raise RigError(stated, [str(error)]) from None
    real = [one for one in description.variables.values() if one.kind == REAL]
    named = {one.name: Named(one.name, one.unit, one.description, one.start) for one in real}
    values = [
        named[one.name]
        for one in real
        if one.causality == "parameter" and one.is_settable and one.start is not None
    ]
    return _Simulator(
        "fmu",
        _from(folder, stated),
        [named[one.name] for one in real if one.causality == "input"],
        [named[one.name] for one in real if one.causality == "output"],
        values,
        next((one.name for one in values if is_start(one)), None),
        description.remarks,
    )


def _from(folder: Path, path: str) -> str:
    """Returns a path relative to the folder of the rig file, with slashes."""
    try:
        relative = os.path.relpath(Path(path).absolute(), folder.absolute())
    except ValueError:  # on another drive
        return str(Path(path).absolute())
    return Path(relative).as_posix()


def _line(key: str, value: object, comment: str) -> str:
    text = tomli_w.dumps({key: value}).strip()
    if isinstance(value, dict):
        text = f"{key} = {{ {', '.join(tomli_w.dumps(value).strip().splitlines())} }}"
    return f"{text:<{WIDTH}} # {printable(comment)}"


def _machine(
    found: Mapping[str, Named],
    known: Mapping[str, Quantity],
    taken: list[tuple[str, str, str]],
) -> list[str]:
    """Returns the sections of the machine, with a comment on each value."""
    given = {GIVEN[option]: quantity for option, quantity in known.items()}
    lines: list[str] = []
    for full in ("valve.rated_command_v", *NEEDED_FOR):
        section, _, key = full.partition(".")
        if f"[{section}]" not in lines:
            lines += ["", f"[{section}]"]
        if full in given:
            value, why = given[full].value, f"given as {given[full].text}"
        elif full in found:
            start = found[full].start
            assert start is not None
            value, why = start, f"start value of {found[full].name}"
        elif full == "valve.rated_command_v":
            value, why = USUAL_COMMAND_V, "typical: at which the valve is fully open; check it"
        else:
            meaning = f"{plant_parameters()[full].meaning}, {NEEDED_FOR[full]}"
            lines.append(f"# {key} = {EXAMPLES[full]}  # fill in: {meaning}")
            continue
        lines.append(_line(key, value, why))
        taken.append((full, f"{value:g}", why))
    return lines


def _signals(
    table: str,
    guesses: Mapping[str, Guess],
    needed: str | None,
    taken: list[tuple[str, str, str]],
) -> list[str]:
    """Returns the lines of inputs, outputs or ports."""
    lines = ["", f"[simulator.{table}]"]
    if table == "ports":
        lines[-1] += "  # inputs through which effects may act"
    for key, guess in guesses.items():
        if guess.chosen is None:
            names = ", ".join(guess.candidates[:6])
            if key == needed or names:
                lines.append(printable(f'# {key} = ""  # fill in: it may be {names or "any"}'))
            continue
        value, why = _written(key, guess.chosen, guess.why)
        lines.append(_line(key, value, why))
        taken.append((f"simulator.{table}.{key}", guess.chosen.name, why))
    return lines


def _written(key: str, chosen: Named, guessed: str) -> tuple[object, str]:
    """Returns what the rig file says of an input or output, and why."""
    why = chosen.description or guessed
    unit = None if chosen.unit is None else unit_of(chosen.unit, key)
    if not is_convertible(unit, UNITS[key]):
        unit = None  # of a command in mA, whose numbers are kept
    entry: dict[str, object] = {"name": chosen.name}
    if unit not in (None, UNITS[key]):
        entry["unit"] = unit
        why += f", in {unit}"
    if key == "force_n":
        entry["positive"] = "extends"
        why += "; check the sign"
    return (entry if len(entry) > 1 else chosen.name), why


def _start(name: str | None, taken: list[tuple[str, str, str]]) -> list[str]:
    if name is None:
        return []
    taken.append(("simulator.start.position_m", name, "by its name"))
    return ["", "[simulator.start]", _line(POSITION, name, "where a run begins")]


def _parameters(
    values: Sequence[Named], supply_is_set: bool, taken: list[tuple[str, str, str]]
) -> list[str]:
    """Returns a table for each value: those that are usually not known well are active.

    A supply pressure that is set through an input in each step is no value that could be wrong.
    """
    active: list[str] = []
    commented: list[str] = []
    for one in values:
        rule = uncertain(one)
        if is_start(one) or one.start is None:
            continue
        header = tomli_w.dumps({"simulator": {"parameters": {one.name: {"value": one.start}}}})
        table = header.strip().splitlines()[0]
        meaning = one.description + (f" in {one.unit}" if one.unit else "")
        is_set = supply_is_set and rule is SUPPLY
        if rule is None or is_set or one.start <= 0.0:
            shown = printable(f"{table}  # value = {one.start!r}  {meaning}".rstrip())
            commented.append(f"# {shown}")
            continue
        of_value = meaning or "start value of the simulator"
        active += [
            "",
            table,
            _line("value", one.start, of_value),
            _line("sigma", rule.sigma, f"of the logarithm: {rule.why}"),
            "log = true",
        ]
        why = f"1-sigma {100.0 * rule.sigma:g} %: {rule.why}"
        taken.append((f"simulator.parameters.{one.name}", f"{one.start:g}", why))
    if commented:
        more = len(commented) - MOST_COMMENTED
        active += [
            "",
            "# Values that are taken as known. A value that may be wrong needs its table with",
            "# value, sigma and, for a sigma of the logarithm, log = true.",
            *commented[:MOST_COMMENTED],
            *([f"# and {more} more"] if more > 0 else []),
        ]
    return active
