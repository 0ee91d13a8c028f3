# SPDX-License-Identifier: MIT
"""Laws without a name: terms of the plant's equations that a table gives over a variable."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import ehsid

from .checks import not_a_number, unknown, value_text

EQUATIONS, VARIABLES = ehsid.plant_tables()
# Section of the rig file below which each table has a section with its name.
SECTION = "effects.table"

# What a plant has that is no hydraulic servo: on an axis there is no oil, and a motor has no spool;
# in the linear model the spool moves, but pressures are not told apart.
PLANTS = {
    "axis": (("force", "sensor", "delay"), ("velocity_m_s", "position_m", "time_s")),
    "linear": (
        ("spool", "force", "sensor", "delay"),
        ("velocity_m_s", "position_m", "spool", "time_s"),
    ),
}
KEYS = ("adds_to", "of", "knots", "values")
# More knots than a law over one variable can need. A longer table is a record.
MOST_KNOTS = 100
NAME = re.compile(r"[A-Za-z0-9_-]+")


@dataclass(frozen=True)
class TableLaw:
    """Term of an equation: linear between the knots of a variable, constant beyond them.

    Attributes
    ----------
    adds_to
        equation, one of `EQUATIONS`: "spool" (opening, fraction of rated command), "flow_a" and
        "flow_b" (flow into a chamber, m^3/s), "force" (against extension, N), "sensor" (reading of
        the position, m), "delay" (of the command path, s).
    of
        variable, one of `VARIABLES`.
    knots
        values of the variable, rising, at least two.
    values
        term at each knot.
    """

    adds_to: str
    of: str
    knots: tuple[float, ...]
    values: tuple[float, ...]

    @property
    def shape(self) -> tuple[str, str, tuple[float, ...]]:
        """The table but for its values, as `ehsid.simulate_plant` takes it."""
        return self.adds_to, self.of, self.knots


def parse_tables(document: object, plant: object, problems: list[str]) -> dict[str, TableLaw]:
    """Returns the tables of the section `effects.table` of a rig file; appends all problems."""
    if not isinstance(document, dict):
        problems.append(
            f"'{SECTION}' = {value_text(document)}: expected a section [{SECTION}.NAME] for each "
            "table"
        )
        return {}
    tables = {}
    for name, section in document.items():
        found = _problems(name, section, plant)
        problems += found
        if not found:
            tables[name] = TableLaw(
                section["adds_to"],
                section["of"],
                tuple(float(knot) for knot in section["knots"]),
                tuple(float(value) for value in section["values"]),
            )
    return tables


def _problems(name: str, section: Any, plant: object) -> list[str]:
    """Returns all problems of the section of one table."""
    path = f"{SECTION}.{name}"
    if not isinstance(section, dict):
        return [f"'{path}' = {value_text(section)}: expected [{path}] with {', '.join(KEYS)}"]
    if not NAME.fullmatch(name):
        return [f"'{path}': expected a name of letters, digits, '_' and '-'"]
    problems = [f"{path}: {unknown(key, KEYS)}" for key in section if key not in KEYS]
    missing = [key for key in KEYS if key not in section]
    if missing:
        return [*problems, f"'{path}' has no {', '.join(missing)}: expected {', '.join(KEYS)}"]
    equations, variables = PLANTS.get(str(plant), (EQUATIONS, VARIABLES))
    for key, names in (("adds_to", equations), ("of", variables)):
        if section[key] not in names:
            problems.append(
                f"'{path}.{key}' = {value_text(section[key])}: expected one of {', '.join(names)}"
            )
    for key in ("knots", "values"):
        problems += _not_numbers(f"{path}.{key}", section[key])
    if problems:
        return problems
    return _contradictions(path, section)


def _not_numbers(key: str, given: object) -> list[str]:
    if not isinstance(given, list):
        return [f"'{key}' = {value_text(given)}: expected a list of numbers"]
    found = (not_a_number(f"{key}[{i}]", each) for i, each in enumerate(given))
    return [problem for problem in found if problem is not None][:1]


def _contradictions(path: str, section: Mapping[str, Any]) -> list[str]:
    knots, values = section["knots"], section["values"]
    if not 2 <= len(knots) <= MOST_KNOTS:
        return [f"'{path}.knots' has {len(knots)} numbers: expected 2 to {MOST_KNOTS}"]
    if len(values) != len(knots):
        return [
            f"'{path}.values' has {len(values)} numbers for {len(knots)} knots: expected one value "
            "for each knot"
        ]
    for i in range(1, len(knots)):
        if not knots[i - 1] < knots[i]:
            return [
                f"'{path}.knots[{i}]' = {knots[i]:g} after {knots[i - 1]:g}: expected knots that "
                "rise"
            ]
    if not math.isfinite(max(abs(value) for value in values) / min(_widths(knots))):
        return [f"'{path}': its slope is not finite: expected knots further apart"]
    return []


def _widths(knots: list[float]) -> list[float]:
    return [float(b) - float(a) for a, b in itertools.pairwise(knots)]
