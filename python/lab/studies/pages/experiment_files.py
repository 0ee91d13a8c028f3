# SPDX-License-Identifier: MIT
"""Converts findings of the experiment to plain values for JSON and to CSV text."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any

from ehsid.harness.base.encoding import to_plain

from ..claims import Judged, ResetJudged
from ..procedure import Procedure
from ..recursive import Changed, Recursive
from ..summary import summarise, summarise_change


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
