# SPDX-License-Identifier: MIT
"""The position controller that the exported tables are for, as it runs in a controller.

    w = r' + k (r - y)              velocity that is asked for, m/s
    x = opening for w               table of the direction: speeds, friction, leakage
    u = rated command for x         inverse table of the direction, less the margin of its edge

About w = 0 the command goes in a straight line from the edge of one direction to that of the other,
over +- the velocity that the noise of the sensor alone asks for: a jump would make the spool rattle
over its dead band. The edges are taken at the ends of their intervals that are nearer to null,
since making up for more than there is makes the loop oscillate about null (Tao, Kokotovic, Adaptive
Control of Systems with Actuator and Sensor Nonlinearities, Wiley 1996).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..base.numbers import FloatArray
from ..signals.simulation import PositionController

# Of the noise of the position, in standard deviations, that the ramp about null admits, and the
# least ramp, share of the speed at full opening.
NOISES, LEAST_RAMP = 6.0, 0.005


@dataclass(frozen=True)
class TableSide:
    """What a controller needs of one direction; arrays of shape (n,), rising by size."""

    velocity: FloatArray
    opening: FloatArray
    """Openings, shares without sign, that these velocities, m/s without sign, need."""
    inverse_opening: FloatArray
    inverse_command: FloatArray
    """Commands, shares of the rated command with their sign, at openings without sign."""

    def command(self, velocity: float) -> float:
        """Returns the command for a velocity without sign, m/s; share of the rated command."""
        opening = np.interp(velocity, self.velocity, self.opening)
        return float(np.interp(opening, self.inverse_opening, self.inverse_command))


@dataclass(frozen=True)
class CompensatedController(PositionController):
    """P with velocity feed-forward in m/s, and the tables of both directions behind it.

    k is `gain_v_m` over `feed_forward_v_s_m`; the limit is the rated command.
    """

    extending: TableSide = field(kw_only=True)
    retracting: TableSide = field(kw_only=True)
    ramp_m_s: float = field(kw_only=True)
    """Velocity up to which the command is on the straight line about null, m/s, > 0."""

    def step(
        self,
        integral_m_s: float,
        reference_m: float,
        position_m: float,
        speed_m_s: float,
        dt_s: float,
    ) -> tuple[float, float]:
        """Returns the command of this sample, and the integral, which stays as it is."""
        pole = self.gain_v_m / self.feed_forward_v_s_m
        wanted = speed_m_s + pole * (reference_m - position_m)
        side = self.extending if wanted > 0.0 else self.retracting
        share = side.command(max(abs(wanted), self.ramp_m_s))
        if abs(wanted) < self.ramp_m_s:
            low, high = (one.command(self.ramp_m_s) for one in (self.retracting, self.extending))
            share = low + (high - low) * 0.5 * (1.0 + wanted / self.ramp_m_s)
        command = self.limit_v * share
        return min(max(command, -self.limit_v), self.limit_v), integral_m_s
