# SPDX-License-Identifier: MIT
"""The columns of a record: fixed names, SI units, the unit in the name."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Column:
    """One column of the schema.

    Attributes
    ----------
    name
        as written in the file, ending in its unit where it has one.
    unit
        SI unit, "1" for a fraction.
    meaning
        what was measured, in words.
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

# What every record of a servo has; a plant with a position output asks for `position_m` as well.
REQUIRED_COLUMNS = (TIME_COLUMN, "command_v")
