# SPDX-License-Identifier: MIT
"""Schema of a record: columns with fixed names that end in their SI unit."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Column:
    """One column of the schema.

    Attributes
    ----------
    name
        name in the file; it ends in the unit, if the column has one.
    unit
        SI unit, or "degC"; "1" for a fraction.
    meaning
        the measured quantity, in words.
    """

    name: str
    unit: str
    meaning: str


COLUMNS: dict[str, Column] = {
    column.name: column
    for column in (
        Column("time_s", "s", "time of the sample, uniform within 1 %"),
        Column("command_v", "V", "what the controller sent to the valve amplifier"),
        Column("position_m", "m", "rod position from the cap end"),
        Column("pressure_a_pa", "Pa", "cap-side chamber pressure, absolute"),
        Column("pressure_b_pa", "Pa", "rod-side chamber pressure, absolute"),
        Column("supply_pressure_pa", "Pa", "pressure at the valve's P port, absolute"),
        Column("spool", "1", "spool position as a fraction of full travel"),
        Column("velocity_m_s", "m/s", "rod velocity"),
        Column("force_n", "N", "force on the rod"),
        Column("temperature_c", "degC", "oil temperature"),
    )
}

TIME_COLUMN = "time_s"

# Columns of every record of a servo. A plant with a position output also requires `position_m`.
REQUIRED_COLUMNS = (TIME_COLUMN, "command_v")
