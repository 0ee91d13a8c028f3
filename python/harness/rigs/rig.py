# SPDX-License-Identifier: MIT
"""A rig: values by full name, their uncertainty, the sensors, and the layout of the records.

Laws without a name: terms of the plant's equations that a table gives over a variable.

Equations and variables of tables in words, and in units for people.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Literal, TypeVar

import numpy as np
import numpy.typing as npt

import ehsid

from ..catalogue.parameters import (
    parameter_keys,
    plant_parameters,
)
from ..catalogue.spellings import ParameterKey
from ..records import ColumnMap
from .checks import RigError, not_a_number, unknown, value_text
from .simulator_section import PREFIX, SimulatorSection, own_name

EQUATIONS, VARIABLES = ehsid.plant_tables()
# Section of the rig file below which each table has a section with its name.
SECTION = "effects.table"

# What a plant has that is no hydraulic servo: on an axis there is no oil, and a motor has no spool;
# in the linear model the spool moves, but pressures are not told apart.
PLANTS = {
    "axis": (("force", "sensor", "delay", "mass"), ("velocity_m_s", "position_m", "time_s")),
    "linear": (
        ("spool", "force", "sensor", "delay", "mass"),
        ("velocity_m_s", "position_m", "spool", "time_s"),
    ),
}
KEYS = ("adds_to", "of", "knots", "values")
# More knots than a law over one variable can need. A longer table is a record.
MOST_KNOTS = 100
NAME = re.compile(r"[A-Za-z0-9_-]+")


@dataclass(frozen=True)
class TableLaw:
    """Term of an equation: linear between the knots of a variable, constant beyond them."""

    adds_to: str
    """Equation, one of `EQUATIONS`: "spool" (opening, fraction of rated command), "flow_a" and
    "flow_b" (flow into a chamber, m^3/s), "force" (against extension, N), "sensor" (reading of the
    position, m), "delay" (of the command path, s), "mass" (what moves with the rod, kg, over
    "position_m" only)."""
    of: str
    """Variable, one of `VARIABLES`."""
    knots: tuple[float, ...]
    """Values of the variable, rising, at least two."""
    values: tuple[float, ...]
    """Term at each knot."""

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
    if section["adds_to"] == "mass" and section["of"] != "position_m":
        return [f"'{path}.of' = '{section['of']}': a mass is given over position_m"]
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
    narrowest = min(float(b) - float(a) for a, b in itertools.pairwise(knots))
    if not math.isfinite(max(abs(value) for value in values) / narrowest):
        return [f"'{path}': its slope is not finite: expected knots further apart"]
    return []


# A value of the machine is within this many of its stated standard deviations: a fit moves it by no
# more.
MOST_SIGMAS = 4.0
# Relative 1-sigma of a nuisance whose value a rig file states.
STATED_NUISANCE = 0.3

Value = TypeVar("Value")


def _split(values: Mapping[str, Value]) -> tuple[dict[str, Value], dict[str, Value]]:
    """Returns the values of the plant by full name, and those of a simulator by its own names."""
    own = {name: of for name in values if (of := own_name(name)) is not None}
    return (
        {name: value for name, value in values.items() if name not in own},
        {of: values[name] for name, of in own.items()},
    )


PlantName = Literal["ehs", "axis", "linear", "simulator"]


@dataclass(frozen=True, eq=False)
class Rig:
    """Description of a machine for the simulator."""

    name: str
    """Name of the machine."""
    plant: PlantName
    """Type of the plant: "ehs", "axis" or "linear", or "simulator", a program of the user."""
    values: Mapping[str, float]
    """Values in SI units by full name, e.g. "load.mass_kg" or "effects.valve_lag.bandwidth_hz". An
    effect without values is off."""
    uncertainty: Mapping[str, float] = field(default_factory=dict)
    """Relative 1-sigma of values, by full name; `sigma` gives the default for other values."""
    sensors: Mapping[str, float] = field(default_factory=dict)
    """Standard deviations of the sensor noise by name, e.g. "position_noise_m"."""
    columns: Mapping[str, ColumnMap] = field(default_factory=dict)
    """Layout of the records by column name of the schema, for the `layout` of `read_record`."""
    tables: Mapping[str, TableLaw] = field(default_factory=dict)
    """Terms of the equations that have no name in the catalogue, by their own names."""
    simulator: SimulatorSection | None = None
    """The program of the user, of a plant "simulator" only."""

    def __post_init__(self) -> None:
        for name in ("values", "uncertainty", "sensors", "columns", "tables"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    def __reduce__(self) -> tuple[type[Rig], tuple[Any, ...]]:
        # A mapping proxy cannot be pickled. Another process receives plain dictionaries.
        mappings = (self.values, self.uncertainty, self.sensors, self.columns, self.tables)
        plain = (dict(mapping) for mapping in mappings)
        return Rig, (self.name, self.plant, *plain, self.simulator)

    def with_values(self, values: Mapping[str, float]) -> Rig:
        """Returns the rig with some values replaced or added, by full name.

        Raises
        ------
        RigError
            the plant does not have a name, a value is outside its range, or values contradict
            each other.
        """
        from .checks import check_complete, check_relations, check_values

        all_values = {**self.values, **values}
        plain, own = _split(values)
        problems = check_values(plain) + check_complete(all_values, self.plant)
        problems += check_relations(all_values)
        if self.simulator is not None:
            from .carried import check_carried
            from .simulator_file import check_own_values

            problems += check_own_values(self.simulator, own)
            problems += check_carried(self.simulator, all_values)
        elif own:
            problems += [f"'{PREFIX}{name}': the rig has no simulator" for name in own]
        if problems:
            raise RigError(self.name, problems)
        return replace(self, values={name: float(value) for name, value in all_values.items()})

    def sigma(self, name: str) -> float:
        """Returns the relative 1-sigma of a value; a default if the rig file gives none.

        For a value of the user's simulator it is that of the rig file: of the logarithm where the
        file says so, else in the unit of the simulator.
        """
        own = own_name(name)
        if own is not None and self.simulator is not None:
            return self.simulator.parameters[own].sigma
        if name in self.uncertainty:
            return self.uncertainty[name]
        return STATED_NUISANCE if ParameterKey(name).is_nuisance else plant_parameters()[name].sigma

    def effects(self) -> tuple[str, ...]:
        """Returns the ids of the effects that are on."""
        ids = (ParameterKey(name).effect for name, value in self.values.items() if value != 0.0)
        return tuple(dict.fromkeys(effect for effect in ids if effect is not None))

    def plant_values(self, overrides: Mapping[str, float] | None = None) -> npt.NDArray[np.float64]:
        """Returns all values in the order of `ehsid.plant_parameters()`, shape (P,).

        For values that the rig does not contain, effects are off and all other values are typical
        ones, except that the start position is mid-stroke. `overrides` has values by full name
        that replace those of the rig. Values of a user's simulator are left out.
        """
        start = 0.5 * self.values.get("cylinder.stroke_m", 0.0)
        values, _ = _split({**self.values, **(overrides or {})})
        values = {ParameterKey.of_initial("position_m"): start, **values}
        unknown = sorted(values.keys() - plant_parameters().keys())
        if unknown:
            raise KeyError(unknown[0])
        return np.array(
            [
                values.get(key, plant_parameters()[key].typical if key.effect is None else 0.0)
                for key in parameter_keys()
            ]
        )

    def table_shapes(self) -> list[tuple[str, str, tuple[float, ...]]]:
        """Returns the tables but for their values, as `ehsid.simulate_plant` takes them."""
        return [law.shape for law in self.tables.values()]

    def table_values(self) -> npt.NDArray[np.float64]:
        """Returns the values of all tables, one after the other, shape (T,)."""
        return np.array([value for law in self.tables.values() for value in law.values])

    def nuisances(self) -> tuple[str, ...]:
        """Returns the full names of the nuisance parameters, which no data sheet gives."""
        return tuple(key for key in parameter_keys() if key.is_nuisance)


# Units for people: name, and how many there are in the SI unit.
OF_TERM: Mapping[str, tuple[str, float]] = MappingProxyType(
    {
        "force": ("N", 1.0),
        "flow_a": ("l/min", 6e4),
        "flow_b": ("l/min", 6e4),
        "spool": ("%", 100.0),
        "sensor": ("mm", 1e3),
        "delay": ("ms", 1e3),
        "mass": ("kg", 1.0),
    }
)
OF_VARIABLE: Mapping[str, tuple[str, float]] = MappingProxyType(
    {
        "velocity_m_s": ("mm/s", 1e3),
        "position_m": ("mm", 1e3),
        "spool": ("%", 100.0),
        "pressure_a_pa": ("bar", 1e-5),
        "pressure_b_pa": ("bar", 1e-5),
        "supply_pressure_pa": ("bar", 1e-5),
        "time_s": ("s", 1.0),
    }
)
TERM_WORDS: Mapping[str, str] = MappingProxyType(
    {
        "force": "force against extension",
        "flow_a": "flow into the cap side",
        "flow_b": "flow into the rod side",
        "spool": "opening of the valve",
        "sensor": "error of the position sensor",
        "delay": "delay of the command",
        "mass": "moving mass",
    }
)
VARIABLE_WORDS: Mapping[str, str] = MappingProxyType(
    {
        "velocity_m_s": "velocity",
        "position_m": "position",
        "spool": "spool position",
        "pressure_a_pa": "cap-side pressure",
        "pressure_b_pa": "rod-side pressure",
        "supply_pressure_pa": "supply pressure",
        "time_s": "time",
    }
)


def table_words(adds_to: str, of: str) -> str:
    """Returns what a table gives, such as "force against extension over the velocity"."""
    return f"{TERM_WORDS[adds_to]} over the {VARIABLE_WORDS[of]}"


def table_subsystem(adds_to: str, of: str) -> str:
    """Returns the subsystem to which a table belongs; flow over the spool is that of its edges."""
    if adds_to in ("flow_a", "flow_b"):
        return "valve" if of == "spool" else "hydraulics"
    return _SUBSYSTEM[adds_to]


_SUBSYSTEM = MappingProxyType(
    {
        "force": "mechanics",
        "mass": "mechanics",
        "spool": "valve",
        "sensor": "sensor",
        "delay": "timing",
    }
)
