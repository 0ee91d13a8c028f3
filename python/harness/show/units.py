# SPDX-License-Identifier: MIT
"""Columns of a record and coefficients of a model in the units that are shown.

The one way in which pages write a share: in per cent, with two digits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..catalogue.channels import CHANNELS
from ..diagnosis.schema import Estimate
from .page import SPACE


@dataclass(frozen=True)
class Shown:
    """Name and unit of a quantity as it is shown, and the factor to this unit; "" is no unit."""

    words: str
    unit: str
    factor: float

    @property
    def label(self) -> str:
        """Name with the unit, for an axis."""
        return f"{self.words} in {self.unit}" if self.unit else self.words

    @property
    def unit_words(self) -> str:
        """The unit; a quantity without one counts in units of its own."""
        return self.unit or f"unit of {self.words}"


def column(name: str) -> Shown:
    """Returns a column of a record in the unit of people; one of no channel has its own name."""
    channel = CHANNELS.get(name)
    if channel is None:
        return Shown(name, "", 1.0)
    unit = "" if channel.shown_unit == "1" else channel.shown_unit
    return Shown(channel.words, unit, channel.factor)


def si_column(name: str) -> Shown:
    """Returns a column of a record as the record has it."""
    channel = CHANNELS.get(name)
    return Shown(name, "" if channel is None or channel.unit == "1" else channel.unit, 1.0)


def coefficient(name: str, above: Shown, below: Shown) -> Shown:
    """Returns how a coefficient is shown: a has no unit, b that of output over input."""
    if name.startswith("a"):
        return Shown(name, "", 1.0)
    if not name.startswith("b"):
        return Shown(name, above.unit, above.factor)
    return Shown(name, over(above, below), above.factor / below.factor)


def over(above: Shown, below: Shown) -> str:
    """Returns the unit of a ratio; "" where one of both is not known."""
    return f"{above.unit}/{below.unit}" if above.unit and below.unit else ""


def percent(share: float | None) -> str:
    """Returns a share in per cent with two digits; a dash where it is not known."""
    if share is None or not math.isfinite(share):
        return "–"
    size = abs(100.0 * share)
    if size == 0.0:
        return f"0{SPACE}%"
    decimals = 0 if size >= 9.95 else 1 if size >= 0.995 else 2
    return f"{100.0 * share:.{decimals}f}{SPACE}%"


def percent_ends(estimate: Estimate) -> str:
    """Returns the interval of a share in per cent, with one decimal if it is narrower than 2 %."""
    if not (math.isfinite(estimate.low) and math.isfinite(estimate.high)):
        return "no interval"
    places = _decimals(estimate)
    return f"{100.0 * estimate.low:.{places}f} to {100.0 * estimate.high:.{places}f}{SPACE}%"


def percent_interval(estimate: Estimate) -> str:
    """Returns a share with its interval, both in per cent and with the same number of decimals."""
    if not math.isfinite(estimate.value):
        return percent(estimate.value)
    value = f"{100.0 * estimate.value:.{_decimals(estimate)}f}{SPACE}%"
    return f"{value} ({percent_ends(estimate)})"


def _decimals(estimate: Estimate) -> int:
    return 1 if 100.0 * (estimate.high - estimate.low) < 2.0 else 0


def frequency_unit(dt_s: float | None) -> str:
    """Returns the unit of frequencies; without a sampling time these are per sample."""
    return "cycles a sample" if dt_s is None else "Hz"
