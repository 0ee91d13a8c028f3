# SPDX-License-Identifier: MIT
"""Converts findings of the experiment to plain values for JSON and to CSV text.

Figures of a comparison of several contenders.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ehsid.harness.base.encoding import to_plain
from ehsid.harness.show.plotting import (
    FIRST_DRAWN,
    GREY,
    MOST_DRAWN,
    draw_band,
    kept_samples,
    stacked,
    styled,
)

from .. import Outcome
from ..claims import Judged, ResetJudged
from ..procedure import Procedure
from ..reading import summarise, summarise_change
from ..recursive import Changed, Recursive


def _widths(n: int) -> list[float]:
    """Returns line widths from thick to thin, so that a curve under a later one stays visible."""
    return [float(width) for width in np.linspace(3.0, 1.0, n)]


@styled
def error_figure(outcomes: Mapping[str, Outcome], dt_s: float) -> Figure:
    """Draws the parameter error over time, and below the forgetting factor of the first run.

    The error is shown in percent, as the median and the range from 5 to 95 % of the runs.
    """
    figure, (upper, lower) = stacked(6.0, [3, 1], xlabel="time in s")
    widths = _widths(len(outcomes))
    lowest = np.inf
    for (name, outcome), width in zip(outcomes.items(), widths, strict=True):
        time = np.arange(outcome.error.shape[1]) * dt_s
        curves = 100.0 * np.quantile(outcome.error, [0.05, 0.5, 0.95], axis=0)
        colour = draw_band(upper, time, curves, 0.12, label=name, linewidth=width)
        factor = np.asarray(outcome.forgetting_factor, dtype=np.float64)
        kept = kept_samples([factor], MOST_DRAWN, FIRST_DRAWN)
        lower.plot(time[kept], factor[kept], color=colour, linewidth=width)
        lowest = min(lowest, float(curves[0].min()))
    upper.set_yscale("log")
    # In the first dozen equations the error is many times the parameters. It is not shown.
    upper.set_ylim(0.8 * lowest, 200.0)
    upper.set_ylabel("parameter error in %")
    upper.legend(loc="upper right")  # it is free, because errors fall; a search for it is slow
    lower.set_ylabel("lambda")
    return figure


@styled
def change_figure(
    pairs: Mapping[str, tuple[Outcome, Outcome]], dt_s: float, change: int, window: slice
) -> Figure:
    """Draws the parameter error around a change of the plant, as the median of the runs.

    Dashed curves are without the reset, solid curves with it. The argument `pairs` contains
    (without, with) by name, `change` is the sample of the change, `window` the samples shown.
    """
    figure, (axes,) = stacked(4.5, [1], xlabel="time in s")
    widths = _widths(len(pairs))
    for number, (name, (without, with_reset)) in enumerate(pairs.items()):
        for outcome, style, label in (
            (with_reset, "-", f"{name}, with reset"),
            (without, "--", f"{name}, without"),
        ):
            time = np.arange(outcome.error.shape[1]) * dt_s
            median = 100.0 * np.median(outcome.error, axis=0)
            axes.semilogy(
                time[window],
                median[window],
                style,
                color=f"C{number}",
                label=label,
                linewidth=widths[number],
            )
    axes.axvline(change * dt_s, color=GREY, linewidth=0.8)
    axes.set_ylabel("parameter error in %")
    axes.legend(loc="center right", ncols=2)
    return figure


def csv_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """Returns CSV text with one row for each mapping; all mappings have the same keys."""
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def orders_table(procedure: Procedure) -> dict[str, str]:
    """Returns the table of orders as CSV text by file name; empty if no model was kept."""
    result = None if procedure.kept is None else procedure.best.result
    if result is None:
        return {}
    rows = [
        {
            "na": candidate.orders.na,
            "nb": candidate.orders.nb,
            "nk": candidate.orders.nk,
            "one_step_fit_percent": candidate.one_step_fit_percent,
            "simulation_fit_percent": candidate.simulation_fit_percent,
            "loss": candidate.validation.loss,
            "fpe": candidate.validation.fpe,
            "aic": candidate.validation.aic,
            "mdl": candidate.validation.mdl,
        }
        for candidate in result.by_order
    ]
    return {"orders.csv": csv_text(rows)}


def claim_rows(judged: Sequence[Judged]) -> list[dict[str, Any]]:
    """Returns the table rows of claims 1 to 3, one row for each condition."""
    rows = []
    for cell in judged:
        at = cell.condition
        row: dict[str, Any] = {
            "p0": at.p0,
            "noise": at.noise,
            "input": at.input.value,
            "lambda0": at.lambda0,
        }
        for name in ("faster", "calmer", "lower_rmse"):
            comparison = getattr(cell, name)
            row |= {
                name: comparison.finding.value,
                f"{name}_ratio": comparison.ratio.median,
                f"{name}_low": comparison.ratio.low,
                f"{name}_high": comparison.ratio.high,
            }
        row["error_of_lambda_1"] = cell.error_of_one.median
        rows.append(row)
    return rows


def reset_rows(resets: Sequence[ResetJudged]) -> list[dict[str, Any]]:
    """Returns the table rows of claim 4 on the reset, one row for each condition."""
    return [
        {
            "noise": cell.noise,
            "factor": cell.factor,
            "sooner": cell.sooner.finding.value,
            "ratio": cell.sooner.ratio.median,
            "samples_with_reset": cell.after.median,
            "fired": cell.fired,
            "false_alarms": cell.false_alarms,
        }
        for cell in resets
    ]


def plain_runs(runs: Sequence[Recursive], dt_s: float) -> list[dict[str, Any]]:
    """Returns medians and intervals of each contender, with one entry for each start."""
    return [
        {
            "p0": run.p0,
            "contenders": {n: to_plain(summarise(o, dt_s)) for n, o in run.outcomes.items()},
        }
        for run in runs
    ]


def plain_change(changed: Changed) -> dict[str, Any]:
    """Returns medians and intervals of the runs with a change, by contender."""
    return {name: to_plain(summary) for name, summary in summarise_change(changed).items()}
