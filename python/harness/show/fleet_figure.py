# SPDX-License-Identifier: MIT
"""Draws the figure of a fleet: gaps of the machines beside a matrix of machines and effects."""

from __future__ import annotations

import math
from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..base.text import printable
from ..fleet.ranking import Machine
from .gap_words import plain_name
from .plotting import BLUE, GREY, ORANGE, styled

NAMED, RIVAL, LEFT = BLUE, ORANGE, GREY


@styled
def fleet_figure(machines: Sequence[Machine], effects: Sequence[str]) -> Figure:
    """Draws bars of the structural gaps beside a matrix of machines and effects, if there are any.

    The names of the effects stand above their columns.
    """
    height = 1.9 + 0.3 * len(machines)
    figure = Figure(figsize=(9.0, height))
    if effects:
        ratios = [1.0, 1.0 + 0.22 * len(effects)]
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=ratios)
        _matrix(right, machines, effects)
    else:
        left = figure.subplots()
    rows = range(len(machines))
    left.barh(rows, [100.0 * machine.structural for machine in machines], color=NAMED, height=0.6)
    rests = [100.0 * min(machine.structural, _rest(machine)) for machine in machines]
    left.barh(rows, rests, color=LEFT, height=0.6)
    left.set_yticks(rows, [printable(machine.name) for machine in machines], parse_math=False)
    left.set_ylim(len(machines) - 0.5, -0.5)
    left.set_xlabel("structural gap, % of the motion")
    left.grid(False, axis="y")
    return figure


def _rest(machine: Machine) -> float:
    """Gap that remains above the highest noise floor with the named effects, as an nrmse.

    It is the structural gap where the gap with effects is not known.
    """
    left = machine.augmented - machine.noise_floor[1]
    return max(0.0, left) if math.isfinite(left) else machine.structural


def _matrix(axes: Axes, machines: Sequence[Machine], effects: Sequence[str]) -> None:
    place = {effect: column for column, effect in enumerate(effects)}
    largest = max((machine.structural for machine in machines), default=0.0) or 1.0
    for row, machine in enumerate(machines):
        for effect in machine.effects:
            # The area grows with the effect's part of the gap; the smallest disc stays visible.
            size = 25.0 + 200.0 * effect.share_of_gap * machine.structural / largest
            axes.scatter(place[effect.id], row, s=size, color=NAMED, linewidths=0)
        rivals = [place[effect] for effect in machine.rivals]
        axes.scatter(rivals, [row] * len(rivals), s=60, facecolors="none", edgecolors=RIVAL)
        unseen = [place[effect] for effect in machine.cannot_judge if effect in place]
        axes.scatter(unseen, [row] * len(unseen), s=18, marker="x", color=LEFT, linewidths=1.0)
    axes.set_xticks(range(len(effects)), [plain_name(effect) for effect in effects], rotation=40)
    for label in axes.get_xticklabels():
        label.set_horizontalalignment("left")
    axes.xaxis.tick_top()
    axes.set_xlim(-0.6, len(effects) - 0.4)
    axes.tick_params(left=False)
