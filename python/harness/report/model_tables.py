# SPDX-License-Identifier: MIT
"""Tables and sentences of models and runs, as commands and the Python interface show them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ehsid.harness.estimation.words import not_white_words
from ehsid.harness.plain_number import plain_number
from ehsid.harness.report.text_table import TextTable

if TYPE_CHECKING:
    from ehsid.harness.estimation import EstimationResult
    from ehsid.harness.identification import IdentificationResult
    from ehsid.harness.simulation import SimulationRun


def candidate_table(result: IdentificationResult) -> TextTable:
    """Returns the figures of the best candidate of each order; the chosen one is marked."""
    rows = tuple(
        (
            f"{candidate.orders.na}{' *' * (candidate.orders == result.chosen.orders)}",
            str(candidate.orders.nk),
            f"{candidate.one_step_fit_percent:.2f}",
            f"{candidate.simulation_fit_percent:.2f}",
            f"{candidate.validation.fpe:.5g}",
            f"{candidate.validation.loss:.5g}",
            plain_number(candidate.validation.aic, 4),
            plain_number(candidate.validation.mdl, 4),
        )
        for candidate in result.by_order
    )
    headings = ("order", "nk", "one-step %", "simulated %", "FPE", "loss", "AIC", "MDL")
    title = "fit on the validation half; the chosen order is marked"
    return TextTable(headings, rows, title=title)


def identification_lines(result: IdentificationResult) -> list[str]:
    """Returns the choice with its reasons, the residual tests, and the advice, in sentences."""
    return [
        result.reason,
        result.delay_reason,
        result.whiteness.verdict,
        result.independence.verdict,
        *result.advice,
    ]


def parameter_table(result: EstimationResult) -> TextTable:
    """Returns the estimated parameters with their intervals."""
    rows = tuple(
        (name, f"{entry['value']:.5g}", f"{entry['ci95'][0]:.5g} .. {entry['ci95'][1]:.5g}")
        for name, entry in result.to_dict()["parameters"].items()
    )
    return TextTable(("parameter", "value", "95 % interval"), rows)


def estimation_lines(result: EstimationResult) -> list[str]:
    """Returns the figures of an estimation, and what its residuals mean, in sentences."""
    figures = (
        f"one-step fit {result.one_step_fit_percent:.2f} %, simulation fit "
        f"{result.simulation_fit_percent:.2f} %, RMSE {plain_number(result.rmse, 4)}, "
        f"resets {result.resets}, "
        f"{'converged' if result.converged else 'not converged'}, "
        f"{result.skipped} of {result.status.size} samples carried no information; "
        f"one-step fit and RMSE leave out the first {result.n_start} equations"
    )
    return [figures] if result.residuals_white else [figures, not_white_words(result)]


def run_table(run: SimulationRun) -> TextTable:
    """Returns the range of each simulated output, and the error of its integration."""
    rows = tuple(
        (name, f"{values.min():.5g}", f"{values.max():.5g}", plain_number(100.0 * error, 2))
        for name, error in run.error.items()
        for values in [run.record.column(name)]
    )
    headings = ("output", "lowest", "highest", "error of integration, % of range")
    return TextTable(headings, rows)
