# SPDX-License-Identifier: MIT
"""Columns of a record and coefficients of a model in the units that the page shows."""

from __future__ import annotations

from dataclasses import dataclass

from ehsid.harness.catalogue.channels import CHANNELS


@dataclass(frozen=True)
class Shown:
    """Name and unit of a quantity on the page, and the factor to this unit; the unit may be ""."""

    words: str
    unit: str
    factor: float

    @property
    def label(self) -> str:
        """Name with the unit, for an axis."""
        return f"{self.words} in {self.unit}" if self.unit else self.words

    def text(self, value: float) -> str:
        """Returns a value in SI with the unit that is shown."""
        return f"{self.factor * value:.4g} {self.unit}".rstrip()


def column(name: str) -> Shown:
    """Returns how a column of a record is shown; one of no channel has its own name."""
    channel = CHANNELS.get(name)
    if channel is None:
        return Shown(name, "", 1.0)
    unit = "" if channel.shown_unit == "1" else channel.shown_unit
    return Shown(channel.words, unit, channel.factor)


def coefficient(name: str, input_name: str, output_name: str) -> Shown:
    """Returns how a coefficient is shown: a has no unit, b that of output over input."""
    above, below = column(output_name), column(input_name)
    if name.startswith("a"):
        return Shown(name, "", 1.0)
    if not name.startswith("b"):
        return Shown(name, above.unit, above.factor)
    return Shown(name, over(above.unit, below.unit), above.factor / below.factor)


def speed_gain(input_name: str, output_name: str) -> Shown:
    """Returns how K is shown: speed of the output over the input."""
    above, below = column(output_name), column(input_name)
    unit = f"({above.unit}/s)/{below.unit}" if above.unit and below.unit else ""
    return Shown("K", unit, above.factor / below.factor)


def si_unit(name: str) -> str:
    """Returns the unit of a column as the record has it; "" where it is not known."""
    channel = CHANNELS.get(name)
    return "" if channel is None or channel.unit == "1" else channel.unit


def over(above: str, below: str) -> str:
    """Returns the unit of a ratio; "" where one of both is not known."""
    return f"{above}/{below}" if above and below else ""
