# SPDX-License-Identifier: MIT
"""Numbers that stand for no value, such as -9999 and 9.9E37, told apart from true extremes.

A true extreme is reached: a position at its end stop and a sensor at its limit have neighbours
among the other values. A number that stands for no value lies alone, far outside of all others.
A command may step to its full scale, and so may a signal that is no channel: of them only numbers
are taken for no value that no full scale has.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..base.arrays import FloatArray
from ..catalogue.channels import CHANNELS, COMMAND, TIME

# No quantity of a machine is so large; instruments say 9.9E37, and netCDF 9.96921e36.
NO_QUANTITY = 1e20
NINES = frozenset(sign * (10.0**digits - 1.0) for digits in range(3, 11) for sign in (1, -1))
# The ends of integers, and what netCDF puts beside them.
FULL = frozenset(
    float(number)
    for bits in (15, 16, 31, 32, 63, 64)
    for number in (2**bits - 1, -(2**bits), 1 - 2**bits)
)
# Distance to the nearest other value, in spans of all others: of a number that is known to stand
# for no value, of any other, and of any in a signal that may be switched.
FAR_KNOWN, FAR, FAR_SWITCHED = 1.0, 5.0, 100.0
# With fewer other values there is no telling what lies outside of them.
LEAST_VALUES = 20
# So many different values has a signal that is measured, and not switched between levels.
LEAST_DIFFERENT = 10
# A larger command is none in V, mV, mA or percent; it may be in counts.
LARGEST_COMMAND = 20_000.0
SWITCHED = (COMMAND, "spool")


@dataclass(frozen=True)
class Sentinels:
    """The numbers in the values of a signal that stand for no value, and the span of the others."""

    numbers: tuple[float, ...]
    lowest: float
    highest: float

    def without(self, values: FloatArray) -> FloatArray:
        """Returns the values with NaN in their place."""
        return np.where(np.isin(values, self.numbers), np.nan, values)

    def remark(self, name: str, values: FloatArray) -> str:
        """Returns a sentence on what is taken for no value."""
        rows = int(np.count_nonzero(np.isin(values, self.numbers)))
        numbers = " or ".join(f"{number:.9g}" for number in self.numbers)
        return (
            f"'{name}' is {numbers} in {rows} of {values.size} rows, far outside of its other "
            f"values ({self.lowest:.4g} to {self.highest:.4g}): taken as no value"
        )


def sentinels_of(values: FloatArray, channel: str) -> Sentinels | None:
    """Returns what in the values of a channel, shape (n,), stands for no value; None if nothing."""
    left = values[np.isfinite(values)]
    numbers: list[float] = []
    while left.size:
        # Both ends at once, as each would hide the other.
        ends = [float(left.min()), float(left.max())]
        huge = [end for end in ends if abs(end) >= NO_QUANTITY]
        others = left[~np.isin(left, huge or ends)]
        found = [end for end in huge or ends if _is_none(end, left, others, channel)]
        if not found:
            break
        numbers += found
        left = left[~np.isin(left, found)]
    if not numbers or not left.size:
        return None
    return Sentinels(tuple(numbers), float(left.min()), float(left.max()))


def has_sentinels(columns: Mapping[str, FloatArray]) -> bool:
    """Whether a column, named by its channel, has numbers that stand for no value."""
    return any(sentinels_of(one, name) for name, one in columns.items() if name != TIME)


def _is_none(number: float, left: FloatArray, others: FloatArray, channel: str) -> bool:
    if others.size < LEAST_VALUES:
        return False
    largest = float(np.max(np.abs(others)))
    distance, span = float(np.min(np.abs(others - number))), float(np.ptp(others))
    repeats = int(np.count_nonzero(left == number)) > 1
    if abs(number) >= NO_QUANTITY:
        return largest < NO_QUANTITY and (repeats or abs(number) < 1e40)
    nines = number in NINES
    if channel in SWITCHED or channel not in CHANNELS:
        # No full scale is -9999, but that of a pulse width may be 999.
        far = FAR if nines and number < -1000.0 else FAR_SWITCHED
        if distance <= far * span or not _differ(others, 2 if nines else LEAST_DIFFERENT):
            return False
        # A command in counts is whole, and may step to the end of its integer.
        counts = bool((others == np.round(others)).all())
        return nines or (
            repeats
            and not counts
            and abs(number) > LARGEST_COMMAND
            and abs(number) >= FAR * largest
        )
    if nines or number in FULL:
        return distance > FAR_KNOWN * span and distance > 0.0
    return (
        repeats
        and distance > FAR * span
        and abs(number) >= FAR * largest
        and _differ(others, LEAST_DIFFERENT)
    )


def _differ(values: FloatArray, count: int) -> bool:
    return bool(np.unique(values).size >= count)
