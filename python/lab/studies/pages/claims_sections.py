# SPDX-License-Identifier: MIT
"""Sections of the report with the verdict on each claim, and what is behind it.

The claims of the paper as one map: which of them holds under which conditions.

Figures of the start of lambda = 1, and of the reset.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ehsid.harness.show.page import Picture, Section, Table
from ehsid.harness.show.plotting import (
    GREY,
    INK,
    PALE,
    SKY,
    VERMILION,
    WHITE,
    YELLOW,
    draw_band,
    draw_numbers,
    stacked,
    styled,
)
from ehsid.harness.show.units import percent

from ..claims import Comparison, Finding, Input, Judged, ResetJudged
from ..experiment import RUNS_A_CELL, ClaimResults
from ..rig_records import RECURSIVE
from ..verdicts import CLAIMS, ClaimVerdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis


COLOURS = {
    Finding.holds: SKY,
    Finding.fails: VERMILION,
    Finding.equal: PALE,
    Finding.neither: WHITE,
    Finding.undecided: YELLOW,
}
# The entries of a legend of these colours.
FINDINGS = [
    Patch(facecolor=colour, edgecolor=GREY, label=finding.value)
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


@styled
def start_figure(judged: Sequence[Judged], published: float) -> Figure:
    """Draws the error of lambda = 1 after 100 s over P0, with one curve for each noise.

    The dashed line is the size of the error of the paper's column.
    """
    figure, (axes,) = stacked(4.0, [1], xlabel="P0", width=8.0)
    noises = sorted({cell.condition.noise for cell in judged})
    for noise in noises:
        curve = {
            cell.condition.p0: cell.error_of_one
            for cell in judged
            if cell.condition.noise == noise and cell.condition.input is Input.multisine
        }
        p0s = sorted(curve)
        error = np.array([[curve[p0].low, curve[p0].median, curve[p0].high] for p0 in p0s])
        style = {"marker": "o", "markersize": 3, "label": f"noise {noise:g}"}
        draw_band(axes, np.array(p0s), 100.0 * error.T, 0.15, **style)
    axes.axhline(100.0 * published, color=INK, linestyle="--", label="the paper's column")
    axes.set_xscale("log")
    axes.set_ylabel("error of lambda = 1 after 100 s in %")
    axes.legend()
    return figure


@styled
def reset_figure(resets: Sequence[ResetJudged]) -> Figure:
    """Draws two maps over the size of the change and the noise.

    Left is the ratio of the settling times with and without reset, right the share of the runs in
    which the reset fired.
    """
    figure = Figure(figsize=(9, 3.6))
    left, right = figure.subplots(1, 2, sharey=True)
    rows = draw_resets(left, resets)
    for i, row in enumerate(rows):
        for j, cell in enumerate(row):
            if cell.sooner.finding is not Finding.neither:
                ratio = f"{cell.sooner.ratio.median:.2f}"
                left.text(j, i, ratio, ha="center", va="center", fontsize="small")
    fired = np.array([[cell.fired for cell in row] for row in rows])
    draw_numbers(right, fired, [[f"{100.0 * share:.0f}" for share in row] for row in fired])
    right.set_xticks(left.get_xticks(), [label.get_text() for label in left.get_xticklabels()])
    right.set_xlabel(left.get_xlabel())
    left.set_title("samples with reset over without")
    right.set_title("reset fired, % of the runs")
    figure.legend(handles=FINDINGS, loc="outside lower center", ncols=len(FINDINGS))
    return figure


def verdict_lead(verdicts: Sequence[ClaimVerdict]) -> list[str]:
    """Returns one sentence for each claim: its verdict, and the shares where it holds and fails."""
    return [
        f"{verdict.claim}: {verdict.verdict.value} "
        f"({percent(verdict.holds)} of the conditions tried, the opposite in "
        f"{percent(verdict.fails)})."
        for verdict in verdicts
    ]


def claims_table(claims: ClaimResults) -> Table:
    """Returns the table of the verdicts, with one row for each claim."""
    return Table(
        "The paper's claims on the varying factor, Eq. (15), over all conditions of the maps: "
        "share of the conditions in which the claim holds, fails, or makes no difference; the rest "
        "is undecided or never arrives.",
        ("claim", "verdict", "holds", "fails", "no difference"),
        [
            (
                verdict.claim,
                verdict.verdict.value,
                percent(verdict.holds),
                percent(verdict.fails),
                percent(verdict.equal),
            )
            for verdict in claims.verdicts
        ],
    )


def claims_sections(claims: ClaimResults) -> list[Section]:
    """Returns the sections on verdicts, the start of lambda = 1, and the reset."""
    paper = ", ".join(f"{name}: {run.rmse:g}" for name, run in RECURSIVE.items())
    return [
        Section(
            "Do the claims hold?",
            [
                claims_table(claims),
                *(f"{verdict.claim}: {verdict.where()}." for verdict in claims.verdicts),
                (
                    "Faster: time until the parameter error stays below 5 %. Calmer: spread of the "
                    "estimate over the last quarter. RMSE: of the innovation over the whole run, "
                    f"against the better of the other two (the paper reports {paper}). The "
                    "recursion is the paper's own, without this estimator's guards. A cell of the "
                    f"map has {RUNS_A_CELL} paired runs; its colour follows the 95 % interval of "
                    "the median ratio, which claims.csv has for every condition."
                ),
            ],
        ),
        Section(
            "The start of lambda = 1",
            [
                (
                    "lambda = 1 never forgets its start. From a small P(0), that is a start at "
                    "theta = 0 that is trusted, an error is left after 100 s; from a vague start "
                    "lambda = 1 is as close as any. The paper's column for lambda = 1 is "
                    f"{percent(claims.error_of_one)} away from model (16). P(0) = "
                    f"{claims.start_of_one:.2g} I leaves as much at the noise of the published "
                    "fit, for an input of rms 1.5, but in other parameters, as the table for this "
                    "start shows: the start does not explain the column."
                ),
                Picture(
                    start_figure(claims.judged, claims.error_of_one),
                    "Error of lambda = 1 after 100 s over the start, median with its 95 % "
                    "interval, multisine.",
                    "Curves that fall from 100 % for small P0 to below 1 % for large P0",
                ),
            ],
        ),
        Section(
            "Where the reset helps",
            [
                Picture(
                    reset_figure(claims.resets),
                    "Varying factor from a vague start; all b change at 50 s. The reset fires "
                    "where the error of the prediction grows threefold.",
                    "Two maps over the size of the change and the noise",
                )
            ],
        ),
    ]
