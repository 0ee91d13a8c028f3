# SPDX-License-Identifier: MIT
"""Channels of a record: one table, from which all rooms take what they need to know about them.

A further channel is a further row. What the simulator computes comes from `plant`; how a channel is
checked, compared, drawn and named comes from the other fields.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

TIME = "time_s"
COMMAND = "command_v"
POSITION = "position_m"
CHAMBER_PRESSURES = ("pressure_a_pa", "pressure_b_pa")
SUPPLY_PRESSURE = "supply_pressure_pa"
SPOOL = "spool"

EHS, AXIS, LINEAR = "ehs", "axis", "linear"


@dataclass(frozen=True)
class Channel:
    """A column of a record.

    Attributes
    ----------
    name
        name in the file; it ends in the unit, if the channel has one.
    unit
        SI unit, or "degC"; "1" for a fraction.
    meaning
        the measured quantity, in words.
    words
        short name in plots.
    shown_unit, factor
        unit in plots, and the factor from SI to it.
    plants
        plants of which the simulator computes the channel.
    noise
        key in [sensors] of a rig file with the standard deviation of its noise; None if the
        channel is not simulated.
    compared
        whether the diagnosis compares it with the simulation. The velocity is not compared because
        it repeats the position. The measured supply pressure also determines the pressure at the
        valve.
    moves
        whether it follows the motion; the command is set, and the temperature is slow.
    """

    name: str
    unit: str
    meaning: str
    words: str
    shown_unit: str = ""
    factor: float = 1.0
    plants: tuple[str, ...] = ()
    noise: str | None = None
    compared: bool = False
    moves: bool = True


CHANNELS = MappingProxyType(
    {
        channel.name: channel
        for channel in (
            Channel(TIME, "s", "time of the sample, uniform within 1 %", "time", "s", moves=False),
            Channel(
                COMMAND,
                "V",
                "what the controller sent to the valve amplifier",
                "command",
                "V",
                moves=False,
            ),
            Channel(
                POSITION,
                "m",
                "rod position from the cap end",
                "position",
                "mm",
                1e3,
                (EHS, AXIS, LINEAR),
                "position_noise_m",
                compared=True,
            ),
            Channel(
                CHAMBER_PRESSURES[0],
                "Pa",
                "cap-side chamber pressure, absolute",
                "pressure A",
                "bar",
                1e-5,
                (EHS,),
                "pressure_a_noise_pa",
                compared=True,
            ),
            Channel(
                CHAMBER_PRESSURES[1],
                "Pa",
                "rod-side chamber pressure, absolute",
                "pressure B",
                "bar",
                1e-5,
                (EHS,),
                "pressure_b_noise_pa",
                compared=True,
            ),
            Channel(
                SUPPLY_PRESSURE,
                "Pa",
                "pressure at the valve's P port, absolute",
                "supply pressure",
                "bar",
                1e-5,
                (EHS,),
                "supply_pressure_noise_pa",
                compared=True,
            ),
            Channel(
                SPOOL,
                "1",
                "spool position as a fraction of full travel",
                "spool",
                "% of travel",
                100.0,
                (EHS, LINEAR),
                "spool_noise",
                compared=True,
            ),
            Channel(
                "velocity_m_s",
                "m/s",
                "rod velocity",
                "velocity",
                "mm/s",
                1e3,
                (EHS, AXIS, LINEAR),
                "velocity_noise_m_s",
            ),
            Channel("force_n", "N", "force on the rod", "force", "N"),
            Channel("temperature_c", "degC", "oil temperature", "temperature", "degC", moves=False),
        )
    }
)

# Columns of every record of a servo. A plant with a position output also requires the position.
REQUIRED_COLUMNS = (TIME, COMMAND)


def shown_channel(name: str) -> tuple[str, float, str]:
    """Returns words, factor from SI and unit of a column; its own name if it is not known."""
    channel = CHANNELS.get(name)
    return (
        (name, 1.0, "") if channel is None else (channel.words, channel.factor, channel.shown_unit)
    )
