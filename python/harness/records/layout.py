# SPDX-License-Identifier: MIT
"""Records with names and units of their own: which column of a file is which of the schema."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ehsid.harness.records.errors import RecordError, missing_column
from ehsid.harness.records.schema import COLUMNS

if TYPE_CHECKING:
    import pint

# pint calculates what it parses, and "m**9**9**9" would take for ever: one power, one digit.
_UNIT_TEXT = re.compile(r"(?!.*\d\d)(?!.*(\*\*|\^).*(\*\*|\^))[\w */^().°%-]{0,40}")


@dataclass(frozen=True)
class ColumnMap:
    """Where a column of the schema is found in a file, and in which unit.

    Attributes
    ----------
    name
        as written in the file.
    unit
        as pint writes it, e.g. "mm", "bar", "percent"; None is the unit of the schema.
    """

    name: str
    unit: str | None = None


Layout = Mapping[str, ColumnMap]
"""Name of the schema -> where the file has it."""


@cache
def _units() -> pint.UnitRegistry[Any]:
    # Imported where it is needed: it takes longer to load than most commands to run.
    import pint

    return pint.UnitRegistry()


def _parsable(schema_unit: str) -> str:
    return "" if schema_unit == "1" else schema_unit  # "1" is a number to pint, not a unit


def is_convertible(unit: object, schema_unit: str) -> bool:
    """Is `unit` the text of a unit that converts into `schema_unit`?"""
    if not isinstance(unit, str) or not _UNIT_TEXT.fullmatch(unit):
        return False
    try:
        return bool(_units().Unit(unit).is_compatible_with(_parsable(schema_unit)))
    except Exception:  # pint has no common exception for text that is no unit
        return False


def in_schema_unit(
    values: npt.NDArray[np.float64], column: ColumnMap, schema_unit: str
) -> npt.NDArray[np.float64]:
    """The values, shape (n,), converted from the unit of the file."""
    if column.unit is None:
        return values
    quantity = _units().Quantity(values, column.unit)
    with np.errstate(over="ignore"):  # the record refuses what becomes infinite
        return np.asarray(quantity.to(_parsable(schema_unit)).magnitude, dtype=np.float64)


def check_layout(layout: Layout, file: Path | str) -> None:
    """Every column is one of the schema, every unit converts.

    Raises
    ------
    RecordError
        one does not.
    """
    for target, column in layout.items():
        if target not in COLUMNS:
            raise missing_column(file, target, COLUMNS, "a column of the schema")
        if column.unit is not None and not is_convertible(column.unit, COLUMNS[target].unit):
            raise RecordError(
                file,
                f"'{column.unit}' is not a unit of '{target}'",
                column=column.name,
                expected=f"a unit that converts into {COLUMNS[target].unit}",
                mend="correct the unit in the layout ([columns] of the rig)",
            )


def layout_of(file_names: Sequence[str], layout: Layout) -> Layout:
    """The layout, or none for a file that has names of the schema where the layout has others.

    So a rig that maps the columns of its logger still reads the records of its simulator. Names of
    the schema stand for its units.
    """
    told = {column.name for column in layout.values()}
    return (
        {} if told.isdisjoint(file_names) and not layout.keys().isdisjoint(file_names) else layout
    )


def names_in_file(file_names: Sequence[str], layout: Layout, file: Path | str) -> dict[str, str]:
    """Name of the record -> name in the file, in the order of the file.

    Columns that the layout does not tell of keep their names; those it tells of and the file
    does not have are left out.

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
