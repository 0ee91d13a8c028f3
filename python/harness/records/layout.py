# SPDX-License-Identifier: MIT
"""Maps columns of a file with other names and units to the columns of the schema."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from tokenize import TokenError
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..catalogue.channels import CHANNELS
from .errors import RecordError, misnamed_column

if TYPE_CHECKING:
    import pint

# pint evaluates the text that it parses, and "m**9**9**9" would never end. The text may therefore
# contain one power only, and no number of more than one digit.
_UNIT_TEXT = re.compile(r"(?!.*\d\d)(?!.*(\*\*|\^).*(\*\*|\^))[\w */^().°%-]{0,40}")
# A unit of a column may begin with a factor, as in "0.1 mm".
_FACTOR = re.compile(r"(\d{1,9}(?:\.\d{1,12})?(?:e[+-]?\d{1,2})?)\s+([^\W\d].*)")

# Pressures of the schema are absolute. A gauge reads zero at the standard atmosphere.
ATMOSPHERE_PA = 101325.0
# Gauge units, each with its size in pascals.
GAUGES = MappingProxyType(
    {
        "Pag": 1.0, "hPag": 1e2, "mbarg": 1e2, "kPag": 1e3, "barg": 1e5, "MPag": 1e6,
        "psig": 6894.757293168361, "ksig": 6894757.293168361, "atg": 98066.5,
    }
)  # fmt: skip


@dataclass(frozen=True)
class ColumnMap:
    """Name and unit that a column of the schema has in a file."""

    name: str
    """Name of the column as written in the file."""
    unit: str | None = None
    """Unit in the notation of pint, e.g. "mm", "bar", "percent", with a factor before it where the
    numbers are multiples, e.g. "0.1 mm"; None is the unit that the log states, or else, in a
    layout, that of the schema."""


# Units that messages name, by the unit of the schema; the first are examples, the others only words
# that a misspelt unit may have meant.
EXAMPLES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "m": ("mm", "cm", "m", "in"),
        "s": ("s", "ms", "us"),
        "V": ("V", "mV"),
        "Pa": ("bar", "kPa", "MPa", "psi"),
        "m/s": ("mm/s", "cm/s", "m/s"),
        "N": ("N", "kN", "lbf"),
        "degC": ("degC", "degF", "kelvin"),
        "1": ("percent",),
    }
)
FURTHER_UNITS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "m": ("millimeter", "centimeter", "micrometer", "meter", "inch"),
        "s": ("second", "millisecond", "microsecond", "minute"),
        "V": ("volt", "millivolt"),
        "Pa": ("pascal", "kilopascal", "megapascal", "millibar", "barg", "psig"),
        "m/s": ("meter/second", "millimeter/second"),
        "N": ("newton", "kilonewton", "kgf"),
        "degC": ("celsius", "fahrenheit"),
    }
)

Layout = Mapping[str, ColumnMap]
"""Maps a column name of the schema to name and unit in the file."""


@cache
def _units() -> pint.UnitRegistry[Any]:
    # pint is imported only where it is needed: its import takes longer than most commands run.
    import pint

    registry: pint.UnitRegistry[Any] = pint.UnitRegistry()
    define_gauges(registry)
    return registry


def define_gauges(registry: pint.UnitRegistry[Any]) -> None:
    """Adds the units of gauge pressures to those that pint knows."""
    for name, size_pa in GAUGES.items():
        registry.define(f"{name} = {size_pa!r} * pascal; offset: {ATMOSPHERE_PA:.0f}")


def _parsable(schema_unit: str) -> str:
    return "" if schema_unit == "1" else schema_unit  # "1" is a number to pint, not a unit


def is_unit(unit: object, schema_unit: str) -> bool:
    """Returns whether `unit` is the text of a unit, without a factor, of the same quantity."""
    if not isinstance(unit, str) or not _UNIT_TEXT.fullmatch(unit):
        return False
    units = _units()  # not below `try`: a pint that cannot be loaded is no unit that is unknown
    try:
        return bool(units.Unit(unit).is_compatible_with(_parsable(schema_unit)))
    except (
        ArithmeticError,
        AttributeError,
        ValueError,
        TypeError,
        AssertionError,
        TokenError,
    ):
        return False  # pint has no common exception for text that is not a unit


def split_factor(unit: str) -> tuple[float, str]:
    """Returns the factor before a unit, 1 without one, and the unit."""
    match = _FACTOR.fullmatch(unit)
    return (1.0, unit) if match is None else (float(match[1]), match[2])


def is_convertible(unit: object, schema_unit: str) -> bool:
    """Returns whether `unit` is the text of a unit, or of multiples of one, of this quantity."""
    if not isinstance(unit, str):
        return False
    factor, plain = split_factor(unit)
    return 0.0 < factor < math.inf and is_unit(plain, schema_unit)


def gauge_remarks(units: Mapping[str, str | None]) -> tuple[str, ...]:
    """Returns a remark on columns with gauge pressures, from the unit of each column."""
    gauges = [name for name, unit in units.items() if unit and split_factor(unit)[1] in GAUGES]
    if not gauges:
        return ()
    listed = ", ".join(f"'{name}'" for name in gauges)
    return (
        f"gauge pressures become absolute: one standard atmosphere, {ATMOSPHERE_PA:.0f} Pa, is "
        f"added to {listed}",
    )


def usual_units(unit: object, schema_unit: str) -> str:
    """Returns examples of units that convert into one of the schema, and what `unit` may mean."""
    *first, last = EXAMPLES[schema_unit]
    examples = f"{', '.join(first)} or {last}" if first else last
    words = (*EXAMPLES[schema_unit], *FURTHER_UNITS.get(schema_unit, ()))
    near = get_close_matches(str(unit).casefold(), [word.casefold() for word in words], n=1)
    found = next((word for word in words if near and word.casefold() == near[0]), None)
    return f"such as {examples}" + (f"; did you mean {found}?" if found else "")


def in_schema_unit(
    values: npt.NDArray[np.float64], column: ColumnMap, schema_unit: str
) -> npt.NDArray[np.float64]:
    """Returns the values, shape (n,), converted from the unit of the file to the schema unit."""
    if column.unit is None:
        return values
    factor, plain = split_factor(column.unit)
    quantity = _units().Quantity(values if factor == 1.0 else factor * values, plain)
    with np.errstate(over="ignore"):  # the record refuses infinite values
        return np.asarray(quantity.to(_parsable(schema_unit)).magnitude, dtype=np.float64)


def check_layout(layout: Layout, file: Path | str) -> None:
    """Checks that every target column is in the schema and that every unit converts.

    Raises
    ------
    RecordError
        a column is not in the schema, or a unit does not convert.
    """
    for target, column in layout.items():
        if target not in CHANNELS:
            raise misnamed_column(file, target, CHANNELS, "a column of the schema")
        if column.unit is not None and not is_convertible(column.unit, CHANNELS[target].unit):
            raise RecordError(
                file,
                f"'{column.unit}' is not a unit of '{target}'",
                column=column.name,
                expected=f"a unit that converts into {CHANNELS[target].unit}, "
                + usual_units(column.unit, CHANNELS[target].unit),
                mend="correct the unit in the layout ([columns] of the rig)",
            )


def layout_of(file_names: Sequence[str], layout: Layout) -> Layout:
    """Returns the layout, or an empty one for a file that has the column names of the schema.

    The layout is empty if the file has none of the names in the layout and at least one of the
    schema names that it maps. So a rig that maps the columns of its logger can also read records
    of its simulator. Columns with schema names have the units of the schema.
    """
    mapped = {column.name for column in layout.values()}
    return (
        {} if mapped.isdisjoint(file_names) and not layout.keys().isdisjoint(file_names) else layout
    )


def names_in_file(file_names: Sequence[str], layout: Layout, file: Path | str) -> dict[str, str]:
    """Maps the column names of the record to the names in the file, in the order of the file.

    Columns that are not in the layout keep their names. Columns that are in the layout but not in
    the file are left out.

    Raises
    ------
    RecordError
        two columns of the file would get the same name.
    """
    targets: dict[str, list[str]] = {}
    for target, column in layout.items():
        targets.setdefault(column.name, []).append(target)
    names: dict[str, str] = {}
    for name in file_names:
        for target in targets.get(name, [name]):
            if target in names:
                raise RecordError(
                    file,
                    f"both '{names[target]}' and '{name}' would be read as '{target}'",
                    column=target,
                    expected="one column of the file for each column of the record",
                    mend="correct the layout ([columns] of the rig), or rename the column",
                )
            names[target] = name
    return names
