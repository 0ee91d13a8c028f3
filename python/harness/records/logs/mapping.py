# SPDX-License-Identifier: MIT
"""What a user says about the columns of a log, as text: "position_m=Stroke [mm]"."""

from __future__ import annotations

import re
from collections.abc import Iterable

from ...catalogue.channels import CHANNELS
from ..errors import nearest_name
from ..layout import ColumnMap, is_convertible, usual_units
from .units import pint_unit

FORM = "CHANNEL=COLUMN or CHANNEL=COLUMN [UNIT], such as 'position_m=Stroke [mm]'"


def parse_maps(texts: Iterable[str], option: str = "--map") -> dict[str, ColumnMap]:
    """Returns the columns of a log by channel, from texts such as "position_m=Stroke [mm]".

    Units are those that engineers write: bar, psi, kN, t, °C, and all of pint.

    Raises
    ------
    ValueError
        a text has another form, an unknown channel or a unit of another kind, or a channel comes
        twice; the message begins with `option`.
    """
    maps: dict[str, ColumnMap] = {}
    for text in texts:
        channel, equals, column = (part.strip() for part in text.partition("="))
        if not equals or not column:
            raise ValueError(f"{option} {text!r}: expected {FORM}")
        if channel not in CHANNELS:
            near = nearest_name(channel, CHANNELS)
            hint = f"; did you mean '{near}'?" if near else ""
            raise ValueError(
                f"{option} {text!r}: there is no channel '{channel}'{hint} There are: "
                f"{', '.join(CHANNELS)}"
            )
        if channel in maps:
            raise ValueError(f"{option} {text!r}: '{channel}' is named twice; give it once")
        match = re.fullmatch(r"(?P<name>.*\S)\s*\[(?P<unit>[^\[\]]*)\]", column)
        if match is None:
            maps[channel] = ColumnMap(column)
            continue
        said = match["unit"].strip()
        unit = pint_unit(said, channel)
        if unit is None and is_convertible(said, CHANNELS[channel].unit):
            unit = said
        if unit is None:
            raise ValueError(
                f"{option} {text!r}: '{match['unit']}' is not a unit of '{channel}'; expected one "
                f"that converts into {CHANNELS[channel].unit}, "
                + usual_units(match["unit"], CHANNELS[channel].unit)
            )
        maps[channel] = ColumnMap(match["name"], unit)
    return maps
