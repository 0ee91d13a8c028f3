# SPDX-License-Identifier: MIT
"""The claims of the paper as one map: which of them holds under which conditions."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ehsid.harness.show.page import Picture
from ehsid.harness.show.plotting import INK, PALE, SKY, VERMILION, styled
from ehsid.harness.show.shares import percent

from ..claims import Judged, ResetJudged
from ..evidence import Comparison, Finding
from ..verdicts import CLAIMS, ClaimVerdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

COLOURS = {
    Finding.holds: SKY,
    Finding.fails: VERMILION,
    Finding.equal: PALE,
    Finding.neither: "white",
    Finding.undecided: "#f2d58a",
}
# The entries of a legend of these colours.
FINDINGS = [
    Patch(facecolor=colour, edgecolor="0.6", label=finding.value)
    for finding, colour in COLOURS.items()
]


def claims_picture(
    judged: Sequence[Judged], resets: Sequence[ResetJudged], found: Sequence[ClaimVerdict]
) -> Picture:
    """Returns the map with what a reader has to know of it."""
    p0s, noises = (
        sorted({getattr(cell.condition, name) for cell in judged}) for name in ("p0", "noise")
    )
    return Picture(
        claims_map(judged, resets, found),
        f"Each cell is a condition. In each block P(0) grows to the right, from {p0s[0]:g} I to "
        f"{p0s[-1]:g} I, and the noise upwards, from {noises[0]:g} to {noises[-1]:g}. In brackets: "
        "the share of the conditions in which the claim holds.",
        "Four maps of coloured cells, one for each claim: " + "; ".join(map(_claim_words, found)),
    )


@styled
def claims_map(
    judged: Sequence[Judged], resets: Sequence[ResetJudged], found: Sequence[ClaimVerdict]
) -> Figure:
    """Draws a cell for each condition of each claim, in the colour of the finding.

    The first claims have a block of cells for each lambda0 (across) and each input (upwards). The
    last claim is that on the reset. `found` are the verdicts in the order of the claims.
    """
    cells = {
        (c.condition.input, c.condition.noise, c.condition.lambda0, c.condition.p0): c
        for c in judged
    }
    inputs = list(dict.fromkeys(key[0] for key in cells))
    noises = sorted({key[1] for key in cells})
    lambda0s = sorted({key[2] for key in cells})
    p0s = sorted({key[3] for key in cells})
    rows, columns = list(product(inputs, noises)), list(product(lambda0s, p0s))
    heights = [2.3] * len(CLAIMS) + [2.6]
    figure = Figure(figsize=(9.0, sum(heights)))
    parts = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
    for part, of, verdict in zip(parts[:-1], CLAIMS.values(), found[:-1], strict=True):
        axes = part.subplots()
        _draw(axes, [[of(cells[*row, *column]) for column in columns] for row in rows])
        _name_blocks(axes.xaxis, [f"lambda0 = {value:g}" for value in lambda0s], len(p0s))
        _name_blocks(axes.yaxis, [str(value) for value in inputs], len(noises))
        axes.set_title(_claim_words(verdict), loc="left")
    left, right = parts[-1].subplots(1, 2, width_ratios=[1.6, 1.0])
    draw_resets(left, resets)
    left.set_title(_claim_words(found[-1]), loc="left")
    right.axis("off")
    right.legend(handles=FINDINGS, loc="lower right", title="the claim", fontsize="medium")
    return figure


def _claim_words(found: ClaimVerdict) -> str:
    return f"{found.claim}: {found.verdict.value} ({percent(found.holds)})"


def _draw(axes: Axes, cells: Sequence[Sequence[Comparison]]) -> None:
    """Draws cells in their colours, the first row at the bottom."""
    order = list(COLOURS)
    axes.grid(False)
    axes.imshow(
        np.array([[order.index(cell.finding) for cell in row] for row in cells]),
        cmap=ListedColormap(list(COLOURS.values())),
        vmin=-0.5,
        vmax=len(order) - 0.5,
        origin="lower",
        aspect="auto",
        interpolation="none",
    )


def _name_blocks(axis: Axis, names: Sequence[str], size: int) -> None:
    """Writes the name of each block of so many cells at its middle, with lines between them."""
    axis.set_ticks([size * (i + 0.5) - 0.5 for i in range(len(names))], names)
    axis.set_ticks([size * i - 0.5 for i in range(1, len(names))], minor=True)
    axis.set_tick_params(which="both", length=0)
    axis.grid(True, which="minor", color=INK, alpha=1.0, linewidth=0.9)


def draw_resets(axes: Axes, resets: Sequence[ResetJudged]) -> list[list[ResetJudged]]:
    """Draws the findings on the reset over the change and the noise; returns the rows of cells."""
    noises = sorted({cell.noise for cell in resets})
    factors = sorted({cell.factor for cell in resets})
    cells = {(cell.noise, cell.factor): cell for cell in resets}
    rows = [[cells[noise, factor] for factor in factors] for noise in noises]
    _draw(axes, [[cell.sooner for cell in row] for row in rows])
    axes.set_xticks(range(len(factors)), [f"{factor:g}" for factor in factors])
    axes.set_yticks(range(len(noises)), [f"{noise:.3g}" for noise in noises])
    axes.set_xlabel("change: all b times")
    axes.set_ylabel("noise")
    return rows
