# SPDX-License-Identifier: MIT
"""The one way in which pages write a share: in per cent, with two digits."""

from __future__ import annotations

import math

from ..diagnosis.schema import Estimate

# This space keeps a number and its unit on one line.
SPACE = "\N{NO-BREAK SPACE}"


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
