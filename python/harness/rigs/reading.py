# SPDX-License-Identifier: MIT
"""Reads a rig from TOML."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from ..catalogue.channels import CHANNELS
from ..catalogue.parameters import PLANTS, effects, parameter_keys
from ..catalogue.spellings import effect_values
from ..records import ColumnMap
from ..records.errors import nearest_name
from ..records.layout import is_convertible, usual_units
from .checks import (
    check_complete,
    check_relations,
    check_sensors,
    check_uncertainty,
    check_values,
    unknown,
    unknown_effect,
    value_text,
)
from .errors import RigError, parse_toml, read_text
from .rig import PlantName, Rig, parse_tables

TABLES = ("uncertainty", "sensors", "effects", "columns")


def read_rig(path: str | os.PathLike[str]) -> Rig:
    """Reads and checks a rig file.

    Raises
    ------
    RigError
        the file has problems; the message lists all of them with key, value and what was expected.
    """
    path = Path(path)
    return parse_rig(read_text(path), source=path)


def parse_rig(text: str, *, source: object = "rig") -> Rig:
    """Reads and checks the text of a rig file; `source` names the text in messages.

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
    uncertainty = _flat(_table(document, "uncertainty", problems))
    problems += check_uncertainty(uncertainty, values, plant)
    tables = parse_tables(_effects(document).get("table", {}), plant, problems)
    sensors = _table(document, "sensors", problems)
    problems += check_sensors(sensors)
    columns = _columns(_table(document, "columns", problems), problems)
    if problems:
        raise RigError(source, problems)
    return Rig(
        name=str(name),
        plant=cast(PlantName, plant),
        values={key: float(value) for key, value in values.items()},
        uncertainty={key: float(value) for key, value in uncertainty.items()},
        sensors={key: float(value) for key, value in sensors.items()},
        columns=columns,
        tables=tables,
    )


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


def _flat(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Returns nested tables as one table with dotted names.

    Without quotes, TOML reads the key of fluid.bulk_modulus_pa = 0.3 as nested tables.
    """
    flat: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = value
    return flat


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
