# SPDX-License-Identifier: MIT
"""Figures of the start of lambda = 1, and of the reset."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ehsid.harness.show.plotting import INK, draw_band, draw_numbers, stacked, styled

from ..claims import Input, Judged, ResetJudged
from ..evidence import Finding
from .claims_map import FINDINGS, draw_resets


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
