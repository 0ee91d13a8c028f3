# SPDX-License-Identifier: MIT
"""Draws the reliability of the probabilities (`ehsid gap-calibrate`)."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from ehsid.harness.show.plotting import BLUE, VERMILION, styled

from ..calibration.checking import Probabilities


@styled
def reliability_drawing(each: Sequence[Probabilities]) -> Figure:
    """Draws the share true over the stated probability; a panel for each kind of claim.

    Each of two sets of constants has its colour. Bars are intervals of 90 %.
    """
    drawing = Figure(figsize=(9, 4.4))
    panels = drawing.subplots(1, len(each[0].reliability), squeeze=False)[0]
    for place, axes in enumerate(panels):
        axes.plot([0, 100], [0, 100], color="0.6", linewidth=1.0, linestyle="--")
        for probabilities, colour in zip(each, (VERMILION, BLUE), strict=True):
            bins = probabilities.reliability[place].bins
            at = [100.0 * group.probability for group in bins]
            axes.vlines(
                at,
                [100.0 * group.true.low for group in bins],
                [100.0 * group.true.high for group in bins],
                color=colour,
                linewidth=1.5,
                alpha=0.6,
            )
            shares = [100.0 * group.true.value for group in bins]
            axes.plot(at, shares, "o-", color=colour, markersize=5, label=probabilities.words)
        axes.set_title(each[0].reliability[place].words)
        axes.set_xlim(-2.0, 102.0)
        axes.set_ylim(-2.0, 102.0)
        axes.set_xlabel("stated probability, %")
        axes.set_ylabel("true, %")
        axes.legend(loc="upper left")
    return drawing
