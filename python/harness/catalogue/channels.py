# SPDX-License-Identifier: MIT
"""Channels of a record: one table, from which all rooms take what they need to know about them.

A further channel is a further row. What the simulator computes comes from `plant`; how a channel is
checked, compared, drawn and named comes from the other fields.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

from .spellings import SPELLINGS

TIME = "time_s"
COMMAND = "command_v"
POSITION = "position_m"
CHAMBER_PRESSURES = ("pressure_a_pa", "pressure_b_pa")
SUPPLY_PRESSURE = "supply_pressure_pa"
SPOOL = "spool"

EHS, AXIS, LINEAR = "ehs", "axis", "linear"


class Guess(NamedTuple):
    """A unit, and the range in which numbers of this unit usually lie."""

    unit: str
    lowest: float
    highest: float


@dataclass(frozen=True)
class Channel:
    """A column of a record."""

    name: str
    """Name in the file; it ends in the unit, if the channel has one."""
    unit: str
    """SI unit, or "degC"; "1" for a fraction."""
    meaning: str
    """The measured quantity, in words."""
    words: str
    """Short name in plots."""
    shown_unit: str = ""
    factor: float = 1.0
    """Unit in plots, and the factor from SI to it."""
    plants: tuple[str, ...] = ()
    """Plants of which the simulator computes the channel."""
    noise: str | None = None
    """Key in [sensors] of a rig file with the standard deviation of its noise; None if the channel
    is not simulated."""
    compared: bool = False
    """Whether the diagnosis compares it with the simulation. The velocity is not compared because
    it repeats the position. The measured supply pressure also determines the pressure at the valve.
    """
    moves: bool = True
    """Whether it follows the motion; the command is set, and the temperature is slow."""
    spellings: tuple[str, ...] = ()
    """How logs call the channel, in lower case, words separated by one space; the order of the
    words does not matter."""
    guesses: tuple[Guess, ...] = ()
    """Units in which a log may hold the channel without saying so, each with the range of the
    largest absolute value (of the travel, for the position) that is usual in it."""


# Ranges of machines with 20 to 420 bar. Where two ranges overlap, a number alone does not tell.
_PRESSURES = (
    Guess("Pa", 2e6, 4.2e7),
    Guess("kPa", 2e3, 4.2e4),
    Guess("MPa", 2.0, 42.0),
    Guess("bar", 20.0, 420.0),
    Guess("psi", 500.0, 6000.0),
)


CHANNELS = MappingProxyType(
    {
        channel.name: channel
        for channel in (
            Channel(
                TIME,
                "s",
                "time of the sample, uniform within 1 %",
                "time",
                "s",
                moves=False,
                spellings=SPELLINGS[TIME],
            ),
            Channel(
                COMMAND,
                "V",
                "what the controller sent to the valve amplifier",
                "command",
                "V",
                moves=False,
                spellings=SPELLINGS[COMMAND],
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
                spellings=SPELLINGS[POSITION],
                guesses=(Guess("m", 0.005, 2.0), Guess("mm", 5.0, 2000.0)),
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
                spellings=SPELLINGS[CHAMBER_PRESSURES[0]],
                guesses=_PRESSURES,
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
                spellings=SPELLINGS[CHAMBER_PRESSURES[1]],
                guesses=_PRESSURES,
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
                spellings=SPELLINGS[SUPPLY_PRESSURE],
                guesses=_PRESSURES,
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
                spellings=SPELLINGS[SPOOL],
                guesses=(Guess("1", 0.02, 1.2), Guess("percent", 2.0, 120.0)),
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
                spellings=SPELLINGS["velocity_m_s"],
                guesses=(Guess("m/s", 0.02, 3.0), Guess("mm/s", 5.0, 3000.0)),
            ),
            Channel(
                "force_n",
                "N",
                "force on the rod",
                "force",
                "N",
                spellings=SPELLINGS["force_n"],
                guesses=(Guess("N", 500.0, 5e6), Guess("kN", 0.5, 400.0)),
            ),
            Channel(
                "temperature_c",
                "degC",
                "oil temperature",
                "temperature",
                "degC",
                moves=False,
                spellings=SPELLINGS["temperature_c"],
                guesses=(Guess("degC", 5.0, 110.0), Guess("kelvin", 270.0, 390.0)),
            ),
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
