# SPDX-License-Identifier: MIT
"""Watches the limits while an experiment runs, and says when it has to end."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace

from ..catalogue.channels import CHAMBER_PRESSURES, POSITION
from ..diagnosis.limits import Limits

# Time in which a servo stops after its command goes to null: delay, valve, and the oil spring.
STOPPING_S = 0.05
# The speed is that over this time: the oil spring swings a rod with up to some 150 Hz. Noise of the
# sensor is not taken for speed, up to so many of its deviations.
SPEED_OVER_S, DEVIATIONS = 0.002, 3.0
# Share of the limit of speed or pressure at which an experiment ends: it must not be passed.
NEARLY = 0.9


@dataclass(frozen=True)
class Seen:
    """How far a machine went."""

    position_m: tuple[float, float] = (math.inf, -math.inf)
    command_v: float = 0.0
    speed_m_s: float = 0.0
    pressure_pa: float | None = None
    """Positions between which the rod was, and the largest |command|, |speed| and pressure of a
    chamber; None where no pressure is measured."""


class Guard:
    """Limits of a machine, looked at sample by sample.

    Parameters
    ----------
    limits
        what the machine may not pass.
    dt_s
        sampling time, s.

    Attributes
    ----------
    noise_m
        standard deviation of the noise of the position sensor, m, as it is at rest.
    """

    noise_m = 0.0

    def __init__(self, limits: Limits, dt_s: float) -> None:
        self._limits = limits
        self._dt_s = dt_s
        self._seen = Seen()
        self._positions: deque[float] = deque(maxlen=max(2, round(SPEED_OVER_S / dt_s) + 1))

    @property
    def seen(self) -> Seen:
        """How far the machine has gone."""
        return self._seen

    def command(self, wished_v: float) -> float:
        """Returns the command inside its limit, V; 0 for one that is not a number."""
        if not math.isfinite(wished_v):
            return 0.0
        command = min(max(wished_v, -self._limits.command_v), self._limits.command_v)
        self._seen = replace(self._seen, command_v=max(self._seen.command_v, abs(command)))
        return command

    def reason(self, sample: Mapping[str, float]) -> str:
        """Returns why the experiment has to end at this sample; "" where it may go on.

        Parameters
        ----------
        sample
            outputs by contract name, SI; the position, and pressures as far as they are measured.
        """
        position = sample[POSITION]
        if not math.isfinite(position):
            return "the position is not a number"
        self._positions.append(position)
        speed = self._speed()
        self._look(sample, speed)
        window_s = self._dt_s * (len(self._positions) - 1)
        noise = DEVIATIONS * math.sqrt(2.0) * self.noise_m / max(window_s, self._dt_s)
        if abs(speed) - noise > NEARLY * self._limits.speed_m_s:
            return f"the speed of {1e3 * abs(speed):.3g} mm/s comes near its limit"
        # Where the rod would stop if the valve closed now.
        stop = position + speed * STOPPING_S
        low, high = self._limits.position_m
        if not low < stop < high:
            end = "lower" if stop <= low else "upper"
            return f"at {1e3 * position:.4g} mm the rod comes near the {end} end of its travel"
        for name in CHAMBER_PRESSURES:
            pressure = sample.get(name, 0.0)
            if not pressure <= NEARLY * self._limits.pressure_pa:
                return f"{name} of {1e-5 * pressure:.3g} bar comes near its limit"
        return ""

    def _look(self, sample: Mapping[str, float], speed: float) -> None:
        position, seen = sample[POSITION], self._seen
        low, high = seen.position_m
        pressures = [sample[name] for name in CHAMBER_PRESSURES if name in sample]
        self._seen = replace(
            seen,
            position_m=(min(low, position), max(high, position)),
            speed_m_s=max(seen.speed_m_s, abs(speed)),
            pressure_pa=max([*pressures, seen.pressure_pa or 0.0]) if pressures else None,
        )

    def _speed(self) -> float:
        """Mean speed over the last samples, m/s; 0 while there are too few: the rod was at rest."""
        seen = self._positions
        if len(seen) < (seen.maxlen or 0):
            return 0.0
        return (seen[-1] - seen[0]) / (self._dt_s * (len(seen) - 1))
