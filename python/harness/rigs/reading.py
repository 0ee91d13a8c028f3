# SPDX-License-Identifier: MIT
"""Reading a rig from TOML."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import pint

from ehsid.harness.records import COLUMNS
from ehsid.harness.rigs.checks import (
    SENSORS,
    check_complete,
    check_together,
    check_values,
    not_a_number,
    unknown,
)
from ehsid.harness.rigs.errors import RigError
from ehsid.harness.rigs.parameters import (
    EFFECT_PREFIX,
    INITIAL_PREFIX,
    NUISANCE_PREFIX,
    effects,
    is_rig_value,
    plant_parameters,
)
from ehsid.harness.rigs.rig import ColumnMap, Rig

PLANTS = ("ehs", "axis")
TABLES = ("uncertainty", "sensors", "effects", "columns")


def read_rig(path: str | os.PathLike[str]) -> Rig:
    """Read and check a rig file.

    Raises
    ------
    RigError
        everything that is wrong with it, with keys, values and what was expected.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise RigError(path, ["there is no such file"]) from None
    except IsADirectoryError:
        raise RigError(path, ["this is a directory; name a rig file (TOML) in it"]) from None
    except UnicodeDecodeError as error:
        raise RigError(path, [f"not UTF-8 text (byte {error.start}); save it as UTF-8"]) from None
    except OSError as error:
        raise RigError(path, [f"cannot be read ({error.strerror})"]) from None
    return parse_rig(text, source=path)


def parse_rig(text: str, *, source: object = "rig") -> Rig:
    """Read and check the text of a rig file; `source` names it in messages.

    Raises
    ------
    RigError
        as read_rig.
    """
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise RigError(source, [f"not TOML: {error}"]) from None
    problems: list[str] = []
    name, plant = document.get("name", "rig"), document.get("plant")
    if not isinstance(name, str):
        problems.append(f"'name' = {name!r}: expected text")
    if plant not in PLANTS:
        shown = "is missing" if plant is None else f"= {plant!r}"
        problems.append(f'\'plant\' {shown}: expected "ehs" or "axis"')
    values = _values(document, problems)
    if plant in PLANTS:
        problems += check_complete(values, plant)
    problems += check_values(values) + check_together(values)
    uncertainty = _flat(_table(document, "uncertainty", problems))
    for key, sigma in uncertainty.items():
        if key not in plant_parameters():
            problems.append(f"uncertainty: {unknown(key, plant_parameters())}")
        elif not_a_number(key, sigma) or not 0.0 < sigma <= 10.0:
            problems.append(
                f"uncertainty.'{key}' = {sigma!r}: expected a relative 1-sigma, 0 to 10"
            )
    sensors = _table(document, "sensors", problems)
    for key, noise in sensors.items():
        if key not in SENSORS:
            problems.append(f"sensors: {unknown(key, SENSORS)}")
        elif not_a_number(key, noise) or noise < 0.0:
            problems.append(f"'sensors.{key}' = {noise!r}: expected a standard deviation, >= 0")
    columns = _columns(_table(document, "columns", problems), problems)
    if problems:
        raise RigError(source, problems)
    return Rig(
        name=str(name),
        plant="axis" if plant == "axis" else "ehs",
        values={key: float(value) for key, value in values.items()},
        uncertainty={key: float(value) for key, value in uncertainty.items()},
        sensors={key: float(value) for key, value in sensors.items()},
        columns=columns,
    )


def _values(document: Mapping[str, Any], problems: list[str]) -> dict[str, Any]:
    """Numbers of the machine and its effects by full name; what is no table is a problem."""
    sections = {
        name.split(".")[0]
        for name in plant_parameters()
        if is_rig_value(name) or name.startswith((NUISANCE_PREFIX, INITIAL_PREFIX))
    }
    values: dict[str, Any] = {}
    for key, section in document.items():
        if key in ("name", "plant", *TABLES):
            continue
        if key not in sections:
            problems.append(unknown(key, sections | {"name", "plant", *TABLES}))
        elif not isinstance(section, dict):
            problems.append(f"'{key}' = {section!r}: expected a section [{key}]")
        else:
            values |= {f"{key}.{inner}": value for inner, value in section.items()}
    for effect, section in _table(document, "effects", problems).items():
        if not isinstance(section, dict):
            problems.append(f"'effects.{effect}' = {section!r}: expected [effects.{effect}]")
        elif effect not in effects() and not section:
            problems.append(f"effects: {unknown(effect, effects())}")
        else:
            values |= {f"{EFFECT_PREFIX}{effect}.{k}": value for k, value in section.items()}
    return values


def _table(document: Mapping[str, Any], key: str, problems: list[str]) -> dict[str, Any]:
    table = document.get(key, {})
    if not isinstance(table, dict):
        problems.append(f"'{key}' = {table!r}: expected a section [{key}]")
        return {}
    return table


def _flat(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested tables with dotted names: fluid.bulk_modulus_pa = 0.3 without quotes is the same."""
    flat: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = value
    return flat


def _columns(table: Mapping[str, Any], problems: list[str]) -> dict[str, ColumnMap]:
    columns = {}
    for key, told in table.items():
        if key not in COLUMNS:
            problems.append(f"columns: {unknown(key, COLUMNS)}")
            continue
        entry = {"name": told} if isinstance(told, str) else told
        if not isinstance(entry, dict) or not isinstance(entry.get("name"), str):
            problems.append(
                f'\'columns.{key}\' = {told!r}: expected {{ name = "Stroke", unit = "mm" }}'
            )
            continue
        problems += [
            f"columns.{key}: {unknown(k, ('name', 'unit'))}"
            for k in entry.keys() - {"name", "unit"}
        ]
        unit = entry.get("unit")
        if unit is not None and not _converts(unit, COLUMNS[key].unit):
            problems.append(
                f"'columns.{key}.unit' = {unit!r}: expected a unit of the same kind as "
                f"{COLUMNS[key].unit}"
            )
            continue
        columns[key] = ColumnMap(entry["name"], unit)
    return columns


@cache
def _units() -> Any:  # pint's own types are partly untyped
    return pint.UnitRegistry()


def _converts(unit: object, schema_unit: str) -> bool:
    if not isinstance(unit, str):
        return False
    try:
        return bool(
            _units().Unit(unit).is_compatible_with("" if schema_unit == "1" else schema_unit)
        )
    except Exception:  # for text that is no unit, pint raises kinds of errors it does not document
        return False
