# SPDX-License-Identifier: MIT
"""Reads and writes a rig file, which is TOML.

A file can be written with a comment on each value: what it is and where it comes from. Another
function says what differs between two rigs: values that moved, were added, or were left out.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import tomli_w

from ..base.error_words import printable
from ..base.files import write_text
from ..catalogue.channels import CHANNELS
from ..catalogue.parameters import PLANTS, effects, parameter_keys, plant_parameters
from ..catalogue.spellings import effect_values
from ..records import ColumnMap
from ..records.errors import nearest_name
from ..records.units import is_convertible, usual_units
from .carried import check_carried
from .checks import (
    RigError,
    check_complete,
    check_relations,
    check_sensors,
    check_uncertainty,
    check_values,
    parse_toml,
    read_text,
    unknown,
    unknown_effect,
    value_text,
)
from .rig import PlantName, Rig, parse_tables
from .simulator_file import SECTION as SIMULATOR
from .simulator_file import flat, parse_simulator, simulator_table
from .simulator_section import SimulatorSection, full_name, own_name

TABLES = ("uncertainty", "sensors", "effects", "columns", SIMULATOR)


def read_rig(path: str | os.PathLike[str]) -> Rig:
    """Reads and checks a rig file.

    Raises
    ------
    RigError
        the file has problems; the message lists all of them with key, value and what was expected.
    """
    path = Path(path)
    return parse_rig(read_text(path), source=path, folder=path.absolute().parent)


def parse_rig(text: str, *, source: object = "rig", folder: Path | None = None) -> Rig:
    """Reads and checks the text of a rig file.

    Parameters
    ----------
    text
        the text, TOML.
    source
        names the text in messages.
    folder
        what the paths of a user's simulator are relative to; None is the current folder.

    Raises
    ------
    RigError
        as in `read_rig`.
    """
    document = parse_toml(text, source)
    problems: list[str] = []
    name, plant = document.get("name", "rig"), document.get("plant")
    if not isinstance(name, str):
        problems.append(f"'name' = {value_text(name)}: expected text")
    if plant not in PLANTS:
        problems.append(_unknown_plant(plant))
    values = _values(document, problems)
    if plant in PLANTS:
        problems += check_complete(values, plant)
    problems += check_values(values) + check_relations(values)
    uncertainty = flat(_table(document, "uncertainty", problems))
    problems += check_uncertainty(uncertainty, values, plant)
    tables = parse_tables(_effects(document).get("table", {}), plant, problems)
    sensors = _table(document, "sensors", problems)
    problems += check_sensors(sensors)
    simulator = _simulator(document, plant, folder or Path.cwd(), values, problems)
    columns = _columns(_table(document, "columns", problems), problems)
    if problems:
        raise RigError(source, problems)
    own = {} if simulator is None else simulator.parameters
    values |= {full_name(name): one.value for name, one in own.items()}
    return Rig(
        name=str(name),
        plant=cast(PlantName, plant),
        values={key: float(value) for key, value in values.items()},
        uncertainty={key: float(value) for key, value in uncertainty.items()},
        sensors={key: float(value) for key, value in sensors.items()},
        columns=columns,
        tables=tables,
        simulator=simulator,
    )


def _simulator(
    document: Mapping[str, Any],
    plant: object,
    folder: Path,
    values: Mapping[str, object],
    problems: list[str],
) -> SimulatorSection | None:
    """Returns the user's simulator of a plant "simulator"; appends all problems."""
    given = document.get(SIMULATOR)
    if plant != SIMULATOR:
        if given is not None:
            problems.append(
                f"'{SIMULATOR}': a plant {value_text(plant)} has no such section; remove it, or "
                "correct 'plant'"
            )
        return None
    section, _ = parse_simulator(given, folder, problems)
    if "table" in _effects(document):
        problems.append(
            f"'effects.table': a table acts inside the plants of ehsid, and a plant "
            f'"{SIMULATOR}" has none; remove it'
        )
    if section is not None:
        problems += check_carried(section, values)
    return section


def _effects(document: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the section of the effects; `_values` tells where it is none."""
    effects = document.get("effects", {})
    return effects if isinstance(effects, dict) else {}


def _unknown_plant(plant: object) -> str:
    expected = " or ".join(f'"{name}"' for name in PLANTS)
    if plant is None:
        return f"'plant' is missing: expected {expected}"
    nearest = nearest_name(plant, PLANTS) if isinstance(plant, str) else None
    hint = f"; did you mean '{nearest}'?" if nearest else ""
    return f"'plant' = {value_text(plant)}: expected {expected}{hint}"


def _values(document: Mapping[str, Any], problems: list[str]) -> dict[str, Any]:
    """Returns the values of machine and effects by full name; appends all problems."""
    sections = {key.section for key in parameter_keys() if key.effect is None}
    values: dict[str, Any] = {}
    for key, section in document.items():
        if key in ("name", "plant", *TABLES):
            continue
        if key not in sections:
            problems.append(unknown(key, sections | {"name", "plant", *TABLES}))
        elif not isinstance(section, dict):
            problems.append(f"'{key}' = {value_text(section)}: expected a section [{key}]")
        else:
            values |= {f"{key}.{name}": value for name, value in section.items()}
    for effect, section in _table(document, "effects", problems).items():
        if effect == "table":
            continue
        if not isinstance(section, dict):
            problems.append(
                f"'effects.{effect}' = {value_text(section)}: expected [effects.{effect}]"
            )
        elif effect not in effects():
            problems.append(unknown_effect(effect))
        elif not section:
            expected = ", ".join(parameter.name for parameter in effects()[effect].parameters)
            problems.append(f"'effects.{effect}' is empty: expected {expected}")
        else:
            values |= effect_values(effect, section)
    return values


def _table(document: Mapping[str, Any], key: str, problems: list[str]) -> dict[str, Any]:
    table = document.get(key, {})
    if not isinstance(table, dict):
        problems.append(f"'{key}' = {value_text(table)}: expected a section [{key}]")
        return {}
    return table


def _columns(table: Mapping[str, Any], problems: list[str]) -> dict[str, ColumnMap]:
    columns = {}
    for key, given in table.items():
        if key not in CHANNELS:
            problems.append(f"columns: {unknown(key, CHANNELS)}")
            continue
        entry = {"name": given} if isinstance(given, str) else given
        if not isinstance(entry, dict) or not isinstance(entry.get("name"), str):
            problems.append(
                f"'columns.{key}' = {value_text(given)}: "
                'expected { name = "Stroke", unit = "mm" }'
            )
            continue
        problems += [
            f"columns.{key}: {unknown(unknown_key, ('name', 'unit'))}"
            for unknown_key in entry.keys() - {"name", "unit"}
        ]
        unit = entry.get("unit")
        if unit is not None and not is_convertible(unit, CHANNELS[key].unit):
            problems.append(
                f"'columns.{key}.unit' = {value_text(unit)}: expected a unit of the same kind as "
                f"{CHANNELS[key].unit}, {usual_units(unit, CHANNELS[key].unit)}"
            )
            continue
        columns[key] = ColumnMap(entry["name"], unit)
    return columns


def rig_text(rig: Rig, folder: Path | None = None) -> str:
    """Returns the rig as TOML text; reading this text gives exactly the same rig.

    The paths of a user's simulator stay as they were stated where `folder`, in which the file will
    stand, is that of the file they were read from; else they become absolute.
    """
    document: dict[str, Any] = {"name": rig.name, "plant": rig.plant}
    for name, value in rig.values.items():
        if own_name(name) is not None:
            continue
        *sections, key = name.split(".")
        table = document
        for section in sections:
            table = table.setdefault(section, {})
        table[key] = value
    for name, law in rig.tables.items():
        tables = document.setdefault("effects", {}).setdefault("table", {})
        tables[name] = {
            "adds_to": law.adds_to,
            "of": law.of,
            "knots": list(law.knots),
            "values": list(law.values),
        }
    if rig.simulator is not None:
        document[SIMULATOR] = simulator_table(rig.simulator, rig.values, folder)
    if rig.uncertainty:
        document["uncertainty"] = dict(rig.uncertainty)
    if rig.sensors:
        document["sensors"] = dict(rig.sensors)
    if rig.columns:
        document["columns"] = {
            key: {"name": column.name} | ({"unit": column.unit} if column.unit else {})
            for key, column in rig.columns.items()
        }
    return tomli_w.dumps(document)


def write_rig(rig: Rig, path: str | os.PathLike[str]) -> None:
    """Writes the rig to a file under a temporary name, then renames the file.

    Raises
    ------
    RigError
        the file cannot be written.
    """
    path = Path(path)
    try:
        write_text(path, rig_text(rig, path.parent))
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the path
        reason = error.strerror if isinstance(error, OSError) else error
        raise RigError(path, [f"cannot be written ({reason})"]) from None


WIDTH = 43


@dataclass(frozen=True)
class Entry:
    """A value of a rig with its origin."""

    key: str
    """Full name, such as "cylinder.bore_m" or "sensors.spool_noise"."""
    value: float
    """In the unit of the rig file."""
    sigma: float | None
    """Relative 1-sigma; None for a sensor."""
    given: bool
    """Whether the user gave it; else it is typical."""
    shown: str
    """The value in the units of engineers."""
    why: str
    """Reason of the value or of its uncertainty, in plain words."""


def commented_text(name: str, plant: str, entries: Sequence[Entry]) -> str:
    """Returns the rig as TOML text with comments; reading it gives exactly these values."""
    lines = [
        "# Made by `ehsid rig new`. Pressures are absolute, and everything is in SI units.",
        "# Each value says whether it was given or is typical; better values make a better rig.",
        tomli_w.dumps({"name": name, "plant": plant}).rstrip("\n"),
    ]
    section = ""
    for entry in sorted(entries, key=lambda entry: _place(entry.key)):
        *sections, key = entry.key.split(".")
        if ".".join(sections) != section:
            section = ".".join(sections)
            lines += ["", f"[{section}]"]
            if section == "sensors":
                lines[-1] += "  # standard deviations of the noise"
        lines.append(f"{f'{key} = {entry.value!r}':<{WIDTH}} # {_comment(entry)}")
    lines += ["", "[uncertainty]  # relative 1-sigma"]
    for entry in entries:
        if entry.sigma is not None:
            reason = entry.why if entry.given else "typical value"
            text = f'"{entry.key}" = {entry.sigma!r}'
            lines.append(f"{text:<{WIDTH}} # {printable(reason)}")
    return "\n".join(lines) + "\n"


def _place(key: str) -> tuple[int, str]:
    """Order of the sections in the file."""
    order = (
        *("cylinder", "load", "valve", "supply", "fluid", "axis", "effects", "nuisance", "sensors"),
    )
    section = key.rpartition(".")[0]
    return order.index(section.split(".")[0]), section


def _comment(entry: Entry) -> str:
    parameter = plant_parameters().get(entry.key)
    meaning = "" if parameter is None else f"{parameter.meaning}: "
    origin = f"given as {entry.shown}" if entry.given else f"{entry.shown}, typical: {entry.why}"
    if entry.given and entry.sigma is not None and " has this area" in entry.why:
        origin = f"{entry.shown}: {entry.why}"
    return printable(meaning + origin)


@dataclass(frozen=True)
class Change:
    """A value that differs, by its full name, in SI; None where a rig does not have it."""

    key: str
    before: float | None
    after: float | None

    @property
    def share(self) -> float | None:
        """Change as a share of the value before; None where there is no such share."""
        if self.before is None or self.after is None or self.before == 0.0:
            return None
        return (self.after - self.before) / abs(self.before)


def changes(before: Rig, after: Rig, *, least: float = 0.0) -> list[Change]:
    """Returns what differs: first the values of `before` in their order, then those added.

    Parameters
    ----------
    before, after
        the two rigs.
    least
        share of a value below which its change is left out.
    """
    found = [
        Change(key, before.values.get(key), after.values.get(key))
        for key in {**before.values, **after.values}
    ]
    return [one for one in found if not _same(one, least)]


def _same(change: Change, least: float) -> bool:
    if change.before is None or change.after is None:
        return False
    return math.isclose(change.before, change.after, rel_tol=least)
