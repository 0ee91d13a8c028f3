# SPDX-License-Identifier: MIT
"""Maps of the claims: the conditions in which the varying factor is better, and in which not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ehsid.harness.report.plotting import (
    INK,
    PALE,
    SKY,
    VERMILION,
    draw_band,
    draw_numbers,
    stacked,
    styled,
)
from ehsid.harness.studies.claims import Input, Judged, ResetJudged
from ehsid.harness.studies.evidence import Comparison, Finding

COLOURS = {
    Finding.holds: SKY,
    Finding.fails: VERMILION,
    Finding.equal: PALE,
    Finding.neither: "white",
    Finding.undecided: "#f2d58a",
}


def _draw(axes: Any, cells: Sequence[Sequence[Comparison]]) -> None:
    """Draws a map: colours by finding, median ratios as text, the first row at the bottom."""
    order = list(COLOURS)
    values = [[order.index(cell.finding) for cell in row] for row in cells]
    axes.grid(False)
    axes.imshow(
        values,
        cmap=ListedColormap(list(COLOURS.values())),
        vmin=-0.5,
        vmax=len(order) - 0.5,
        origin="lower",
        aspect="auto",
    )
    for i, row in enumerate(cells):
        for j, cell in enumerate(row):
            if cell.finding is not Finding.neither:
                ratio = cell.ratio.median
                text = f"{ratio:.2f}" if ratio < 10.0 else f"{ratio:.0f}"
                axes.text(j, i, text, ha="center", va="center", fontsize=6.5)


def _legend(figure: Figure) -> None:
    figure.legend(
        handles=[
            Patch(facecolor=colour, edgecolor="0.6", label=finding.value)
            for finding, colour in COLOURS.items()
        ],
        loc="outside lower center",
        ncols=len(COLOURS),
    )


@styled
def claims_figure(
    judged: Sequence[Judged], claims: dict[str, Callable[[Judged], Comparison]], kind: Input
) -> Figure:
    """Draws the maps over P0 and noise for one input: a row per claim, a panel per lambda0."""
    cells = {
        (c.condition.p0, c.condition.noise, c.condition.lambda0): c
        for c in judged
        if c.condition.input is kind
    }
    p0s = sorted({p0 for p0, _, _ in cells})
    noises = sorted({noise for _, noise, _ in cells})
    lambda0s = sorted({lambda0 for _, _, lambda0 in cells})
    figure = Figure(figsize=(12.0, 2.6 * len(claims) + 0.4))
    blocks = figure.subfigures(len(claims), 1, squeeze=False)[:, 0]
    for block, (claim, of) in zip(blocks, claims.items(), strict=True):
        block.suptitle(claim, fontsize=10)
        panels = block.subplots(1, len(lambda0s), sharey=True, squeeze=False)[0]
        for axes, lambda0 in zip(panels, lambda0s, strict=True):
            _draw(axes, [[of(cells[p0, noise, lambda0]) for p0 in p0s] for noise in noises])
            axes.set_xticks(range(len(p0s)), [f"{p0:g}" for p0 in p0s], rotation=60, fontsize=7)
            axes.set_yticks(range(len(noises)), [f"{noise:g}" for noise in noises], fontsize=7)
            axes.set_title(f"lambda0 = {lambda0:g}", fontsize=8)
            axes.set_xlabel("P0", fontsize=8)
        panels[0].set_ylabel("noise", fontsize=8)
    _legend(figure)
    return figure


@styled
def start_figure(judged: Sequence[Judged], published: float) -> Figure:
    """Draws the error of lambda = 1 after 100 s over P0, with one curve for each noise.

    The dashed line is the error of the paper's column.
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
    noises = sorted({cell.noise for cell in resets})
    factors = sorted({cell.factor for cell in resets})
    cells = {(cell.noise, cell.factor): cell for cell in resets}
    figure = Figure(figsize=(9, 3.6))
    left, right = figure.subplots(1, 2, sharey=True)
    _draw(left, [[cells[noise, factor].sooner for factor in factors] for noise in noises])
    fired = np.array([[cells[noise, factor].fired for factor in factors] for noise in noises])
    draw_numbers(right, fired, [[f"{100.0 * share:.0f}" for share in row] for row in fired])
    for axes, title in (
        (left, "samples with reset over without"),
        (right, "reset fired, % of the runs"),
    ):
        axes.set_xticks(range(len(factors)), [f"{factor:g}" for factor in factors])
        axes.set_yticks(range(len(noises)), [f"{noise:g}" for noise in noises])
        axes.set_xlabel("all b times")
        axes.set_title(title)
    left.set_ylabel("noise")
    _legend(figure)
    return figure
