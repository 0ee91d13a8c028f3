# SPDX-License-Identifier: MIT
"""Characteristic of a valve as tables over the command, and its inverse for a controller.

In the order of the simulator (docs/effects.md): x = command + bias, x <- limit tanh(x / limit),
opening = x - overlap beyond the overlap of its side. Shares of the rated command and of full
opening. Merritt, Hydraulic Control Systems, Wiley 1967, ch. 5; the inverse as feed-forward: Jelali,
Kroll, Hydraulic Servo-systems, Springer 2003, ch. 7.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.numbers import FloatArray
from ..diagnosis.schema import Estimate
from .known import Known

POINTS = 100
# Tables end where the opening rises with this share of its slope about null: there the inverse
# multiplies noise by ten.
LEAST_SLOPE = 0.1


@dataclass(frozen=True)
class Sizes:
    """Sizes of one valve; shares of the rated command."""

    overlap_a: float = 0.0
    overlap_b: float = 0.0
    """Of the edges that extend the rod, and of those that retract it, >= 0."""
    bias: float = 0.0
    """Opening at zero command."""
    limit: float = math.inf
    """Largest opening, > 0."""

    def opening(self, command: FloatArray) -> FloatArray:
        """Returns the signed opening at commands, both shares, of any shape."""
        x = command + self.bias
        if math.isfinite(self.limit):
            x = self.limit * np.tanh(x / self.limit)
        return np.maximum(x - self.overlap_a, 0.0) + np.minimum(x + self.overlap_b, 0.0)

    def command(self, opening: FloatArray, side: int) -> FloatArray:
        """Returns the commands at openings of one side (1 extends, -1 retracts); NaN beyond."""
        x = opening + (self.overlap_a if side > 0 else -self.overlap_b)
        if math.isfinite(self.limit):
            with np.errstate(invalid="ignore", divide="ignore"):
                x = self.limit * np.arctanh(x / self.limit)
        return np.asarray(x - self.bias)

    def end(self, side: int) -> float:
        """Returns the last command of a side that a controller should send."""
        # d opening / d command = 1 - tanh^2(x / limit)
        farthest = self.limit * math.atanh(math.sqrt(1.0 - LEAST_SLOPE))
        return side * min(1.0, farthest - side * self.bias)


@dataclass(frozen=True, eq=False)
class Side:
    """Tables of one direction; each array has the shape (100,), and shares have their sign."""

    side: int
    """1 extends, -1 retracts."""
    command: FloatArray
    """Equidistant, from where the edges begin to open."""
    opening: FloatArray
    opening_low: FloatArray
    opening_high: FloatArray
    """With the ends of the band of 90 %, by size."""
    inverse_opening: FloatArray
    """Equidistant, from 0 to the largest opening."""
    inverse_command: FloatArray
    inverse_low: FloatArray
    inverse_high: FloatArray
    """With the ends of the band of 90 %; low is the end nearer to null."""

    @property
    def edge(self) -> Estimate:
        """Command at which the edges begin to open; low is the end nearer to null."""
        ends = (self.inverse_command, self.inverse_low, self.inverse_high)
        return Estimate(*(float(one[0]) for one in ends))

    @property
    def margin(self) -> float:
        """What is taken off the inverse, so that its edge is the nearer end of the band."""
        return self.edge.value - self.edge.low

    @property
    def safe_command(self) -> FloatArray:
        """The inverse that a controller takes, shape (100,)."""
        return self.inverse_command - self.margin


@dataclass(frozen=True, eq=False)
class Valve:
    """Characteristic of a valve in both directions."""

    rated_command: float
    overlap_a: Estimate
    overlap_b: Estimate
    bias: Estimate
    limit: Estimate | None
    """None where the flow does not saturate."""
    hysteresis: Estimate
    extending: Side
    retracting: Side

    def side(self, sign: float) -> Side:
        """Returns the tables of a direction."""
        return self.extending if sign > 0.0 else self.retracting

    @property
    def null(self) -> float:
        """Command in the middle between both edges, share of the rated command."""
        return 0.5 * (self.extending.edge.value + self.retracting.edge.value)

    def notes(self) -> list[str]:
        """Returns what the inverse does not make up for."""
        made = []
        if self.hysteresis.value > 0.0:
            made.append(
                f"The hysteresis of +-{100.0 * self.hysteresis.value:.2g} % is not made up for: a "
                "play that is overestimated makes the loop oscillate."
            )
        if max(abs(side.command[-1]) for side in (self.extending, self.retracting)) < 1.0:
            made.append(
                "The flow saturates: the tables end where the opening rises with a tenth of its "
                "slope about null."
            )
        return made


def valve_of(known: Known) -> Valve:
    """Returns the characteristic of a machine with bands.

    Raises
    ------
    ValueError
        the edges of the valve open nowhere within the rated command.
    """
    assert known.rig is not None
    size = known.size
    overlap_a, overlap_b = (
        _sum(size("effects.valve_dead_band.overlap"), size(f"effects.valve_dead_band_sides.{one}"))
        for one in ("overlap_a", "overlap_b")
    )
    bias = _sum(size("effects.valve_null_bias.offset"), size("nuisance.null_bias"))
    limit = size("effects.valve_flow_saturation.limit", math.inf)
    middle = Sizes(overlap_a.value, overlap_b.value, bias.value, limit.value)
    moved = [
        [replace(middle, overlap_a=end) for end in overlap_a.ci90],
        [replace(middle, overlap_b=end) for end in overlap_b.ci90],
        [replace(middle, bias=end) for end in bias.ci90],
        [replace(middle, limit=end) for end in limit.ci90],
    ]
    return Valve(
        known.rig.values["valve.rated_command_v"],
        overlap_a,
        overlap_b,
        bias,
        limit if math.isfinite(limit.value) else None,
        size("effects.valve_hysteresis.half_width"),
        _side(middle, moved, 1),
        _side(middle, moved, -1),
    )


def _sum(one: Estimate, other: Estimate) -> Estimate:
    """Sum of two independent estimates: their half intervals add as squares."""
    value = one.value + other.value
    low = math.hypot(one.low - one.value, other.low - other.value)
    return Estimate(
        value, value - low, value + math.hypot(one.high - one.value, other.high - other.value)
    )


def _side(middle: Sizes, moved: Sequence[Sequence[Sizes]], side: int) -> Side:
    edge, end = float(middle.command(np.zeros(1), side)[0]), middle.end(side)
    if not side * (end - edge) > 0.0:
        raise ValueError(
            f"the edges that {'extend' if side > 0 else 'retract'} the rod open at {edge:.3g} of "
            "the rated command: expected less than 1; look at overlap, null bias and saturation"
        )
    command = np.linspace(edge, end, POINTS)
    opening = middle.opening(command)
    inverse_opening = np.linspace(0.0, opening[-1], POINTS)

    def band(of: Callable[[Sizes], FloatArray]) -> tuple[FloatArray, FloatArray]:
        # Sizes are taken as independent: half bands add as squares. Bands go by size, not by sign.
        centre = side * of(middle)
        below, above = np.zeros(POINTS), np.zeros(POINTS)
        for ends in moved:
            apart = np.nan_to_num([side * of(one) - centre for one in ends])
            below += np.minimum(apart.min(axis=0), 0.0) ** 2
            above += np.maximum(apart.max(axis=0), 0.0) ** 2
        return side * (centre - np.sqrt(below)), side * (centre + np.sqrt(above))

    low, high = band(lambda one: one.opening(command))
    return Side(
        side,
        command,
        opening,
        side * np.maximum(side * low, 0.0),
        high,
        inverse_opening,
        middle.command(inverse_opening, side),
        *band(lambda one: one.command(inverse_opening, side)),
    )
