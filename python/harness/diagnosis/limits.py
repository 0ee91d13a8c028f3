# SPDX-License-Identifier: MIT
"""What an experiment may not pass: travel, command, speed and pressure of a machine."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """Limits of an experiment, SI.

    Raises
    ------
    ValueError
        a limit is not positive, or the travel has no length.
    """

    position_m: tuple[float, float]
    """Smallest and largest position of the rod, m."""
    command_v: float
    """Largest |command|, V."""
    speed_m_s: float = math.inf
    """Largest |speed| of the rod, m/s."""
    pressure_pa: float = math.inf
    """Largest pressure of a chamber, Pa, absolute."""

    def __post_init__(self) -> None:
        """Checks the limits."""
        low, high = self.position_m
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise ValueError(f"a travel of {low:g} to {high:g} m: expected the smaller end first")
        if not math.isfinite(self.command_v):
            raise ValueError("the limit of the command is not known")
        for name in ("command_v", "speed_m_s", "pressure_pa"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"a limit {name} = {getattr(self, name):g}: expected > 0")

    @property
    def span_m(self) -> float:
        """Length of the travel, m."""
        return self.position_m[1] - self.position_m[0]
