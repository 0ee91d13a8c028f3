# SPDX-License-Identifier: MIT
"""The one way in which pages write a share: in per cent, with two digits."""

from __future__ import annotations

import math

from ehsid.harness.gap.schema import Estimate

# This space keeps a number and its unit on one line.
SPACE = "\N{NO-BREAK SPACE}"
# A share next to the whole is written with as many digits as tell it from the whole, up to these.
MOST_DECIMALS = 4


def percent(share: float | None) -> str:
    """Returns a share in per cent with two digits; a dash where it is not known.

    What is not the whole is never written as 100 %: 0.996 is 99.6 %.
    """
    if share is None or not math.isfinite(share):
        return "–"
    return f"{_number(100.0 * share)}{SPACE}%"


def _number(value: float) -> str:
    size = abs(value)
    if size == 0.0:
        return "0"
    if size >= 9.95:
        decimals = 0
        while decimals < MOST_DECIMALS and size < 100.0 <= round(size, decimals):
            decimals += 1
    else:
        decimals = 1 if size >= 0.995 else 2
    return f"{value:.{decimals}f}"


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
