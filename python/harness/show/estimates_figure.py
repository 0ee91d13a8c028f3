# SPDX-License-Identifier: MIT
"""Draws the coefficients of many records, each with its interval and the range of the others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..base.text import printable
from ..models.estimation import Coefficient, Estimates
from .plotting import BLUE, GREY, SKY, VERMILION, stacked, styled

# An axis ends this many times the range between the quantiles beyond them; what lies farther away
# is drawn as a triangle at its end.
MARGIN = 1.5
# Outliers with a name in the figure, in each panel; the tables name all.
MOST_NAMED = 4
# More records cannot be told apart in the width of a page.
MOST_DRAWN = 400


@styled
def estimates_figure(found: Estimates) -> Figure:
    """Draws a panel for each coefficient, over the numbers of the records in the table."""
    count = len(found.coefficients)
    figure, panels = stacked(1.0 + 1.5 * count, [1.0] * count, xlabel="number of the record")
    far = {(one.file, one.coefficient) for one in found.outliers}
    drawn = _drawn(found)
    for axes, coefficient in zip(panels, found.coefficients, strict=True):
        _panel(axes, found, coefficient, drawn, far)
    panels[0].set_xlim(0.0, len(found.records) + 1.0)
    return figure


def _drawn(found: Estimates) -> list[int]:
    """Places of the records to draw: all outliers, and of the others every so many."""
    files = {one.file for one in found.outliers}
    step = -(-len(found.records) // MOST_DRAWN)
    return [i for i, one in enumerate(found.records) if i % step == 0 or one.file in files]


def _panel(
    axes: Axes,
    found: Estimates,
    coefficient: Coefficient,
    drawn: Sequence[int],
    far: set[tuple[str, str]],
) -> None:
    name = coefficient.name
    value, low, high = np.array([found.records[i].interval(name) for i in drawn]).T
    margin = MARGIN * (coefficient.high - coefficient.low) or coefficient.standard_deviation
    bottom, top = coefficient.low - margin, coefficient.high + margin
    outlier = np.array([(found.records[i].file, name) in far for i in drawn])
    number = np.array(drawn) + 1
    axes.axhspan(coefficient.low, coefficient.high, color=SKY, alpha=0.25, linewidth=0)
    axes.axhline(coefficient.median, color=GREY, linewidth=0.8)
    edge = 0.06 * (top - bottom)  # half the height of a triangle
    shown = np.clip(value, bottom + edge, top - edge)
    inside = (value >= bottom) & (value <= top)
    for which, colour in ((~outlier, BLUE), (outlier, VERMILION)):
        for mark, chosen in (
            (".", which & inside),
            ("^", which & (value > top)),
            ("v", which & (value < bottom)),
        ):
            ends = np.clip((low[chosen], high[chosen]), bottom, top)
            axes.vlines(number[chosen], *ends, color=colour, linewidth=0.8)
            axes.plot(number[chosen], shown[chosen], mark, color=colour, markersize=5)
    for i in np.flatnonzero(outlier)[:MOST_NAMED]:
        right = number[i] > len(found.records) / 2
        text = axes.annotate(
            printable(found.records[drawn[i]].file),
            (number[i], shown[i]),
            xytext=(-6 if right else 6, 0),
            textcoords="offset points",
            horizontalalignment="right" if right else "left",
            verticalalignment="center",
            color=VERMILION,
            fontsize="small",
            parse_math=False,
        )
        text.set_in_layout(False)  # a long name does not squeeze the axes
    if top > bottom:
        axes.set_ylim(bottom, top)
    axes.set_ylabel(name)
