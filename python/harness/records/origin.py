# SPDX-License-Identifier: MIT
"""What was taken for what in a log that does not follow the schema of records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..catalogue.channels import CHANNELS
from .layout import is_convertible

MOST_LISTED = 12  # names of columns in a remark
DATES = "dates or times in the log"  # begins the reason of a time that has no unit


@dataclass(frozen=True)
class Taken:
    """A column of a log and what it was taken for: value in the record = factor x + offset.

    Attributes
    ----------
    channel
        column of the record.
    column
        column of the log, or "" where the time comes from elsewhere.
    unit
        unit of the log in the notation of `ColumnMap`; None is the unit of the record.
    factor, offset
        the conversion.
    why
        the reason, in words.
    """

    channel: str
    column: str
    unit: str | None
    factor: float
    offset: float
    why: str


@dataclass(frozen=True)
class Origin:
    """How a log became a record.

    Attributes
    ----------
    kind
        what the file was taken for, such as "text, columns separated by ';', decimal comma".
    taken
        the columns that are in the record.
    remarks
        sentences on what was changed, left out or guessed.
    """

    kind: str
    taken: tuple[Taken, ...]
    remarks: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Returns the origin as plain values for JSON."""
        return {
            "kind": self.kind,
            "columns": [vars(one).copy() for one in self.taken],
            "remarks": list(self.remarks),
        }

    def rows(self) -> list[tuple[str, str, str, str, str]]:
        """Returns the table of columns as text: column, taken for, unit, factor, why."""
        return [
            (
                one.column or "-",
                one.channel,
                one.unit or unit_of(one.channel),
                f"{one.factor:.6g}" + (f" {one.offset:+.6g}" if one.offset else ""),
                one.why,
            )
            for one in self.taken
        ]

    def columns_block(self) -> str:
        """Returns the columns of the schema as a [columns] block of a rig file; "" without any."""
        lines = [
            f"{one.channel} = {{ {_pairs(one)} }}"
            for one in self.taken
            if one.channel in CHANNELS and one.column
        ]
        return "\n".join(["[columns]", *lines]) + "\n" if lines else ""


def without_numbers(names: Sequence[str]) -> tuple[str, ...]:
    """Returns one remark on all columns that are left out because they hold text; none of none."""
    if not names:
        return ()
    listed = ", ".join(f"'{name}'" for name in names[:MOST_LISTED])
    more = f" and {len(names) - MOST_LISTED} more" if len(names) > MOST_LISTED else ""
    return (f"columns without numbers are left out: {listed}{more}",)


def unit_of(name: str) -> str:
    """Returns the unit of a column of a record in words, "as logged" for one of no channel."""
    return CHANNELS[name].unit if name in CHANNELS else "as logged"


def _pairs(taken: Taken) -> str:
    """Returns name and unit; no unit of dates and of a command that keeps its numbers, as in mA."""
    name = f"name = {toml_string(taken.column)}"
    schema_unit = CHANNELS[taken.channel].unit
    unit = taken.unit or schema_unit
    counted = taken.unit is None and (taken.offset != 0.0 or taken.why.startswith(DATES))
    if counted or not is_convertible(unit, schema_unit):
        return name
    return f"{name}, unit = {toml_string(unit)}"


def toml_string(text: str) -> str:
    """Returns a text as a basic string of TOML."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in escaped) + '"'


def with_reading(results: dict[str, Any], origin: Origin | None) -> dict[str, Any]:
    """Returns results as JSON has them, with what was taken for what in a log as "reading"."""
    return results if origin is None else {**results, "reading": origin.to_dict()}
