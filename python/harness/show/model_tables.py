# SPDX-License-Identifier: MIT
"""Tables and sentences of models and runs, as commands and the Python interface show them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..base.plain_number import plain_number
from ..models.estimation.words import not_white_words, servo_words, state_words
from ..models.identification.criteria import simulation_cell, simulation_words
from .page import Table

if TYPE_CHECKING:
    from ..models.estimation import EstimationResult
    from ..models.estimation.servo import ServoPath
    from ..models.identification import IdentificationResult
    from ..signals.simulation import SimulationRun

# Numbers of 1e-3 to below 1e5 need no common power of ten.
LEAST_POWER, MOST_POWER = -3, 4


def candidate_table(result: IdentificationResult) -> Table:
    """Returns the figures of the best candidate of each order; the chosen one is marked.

    FPE, loss and MDL have a power of ten in common, which stands in the title, so that a terminal
    of 80 columns shows all their digits.
    """
    power = _power(result.chosen.validation.loss)
    rows = tuple(
        (
            str(candidate.orders.na),
            str(candidate.orders.nk),
            f"{candidate.one_step_fit_percent:.2f}",
            simulation_cell(candidate.simulation_fit_percent),
            _scaled(candidate.validation.fpe, power),
            _scaled(candidate.validation.loss, power),
            plain_number(candidate.validation.aic, 4),
            _scaled(candidate.validation.mdl, power),
        )
        for candidate in result.by_order
    )
    headings = ("order", "nk", "one-step %", "simulated %", "FPE", "loss", "AIC", "MDL")
    title = "fit on the validation half; the chosen order is marked"
    if power:
        title += f"; FPE, loss and MDL in units of 1e{power}"
    chosen = [one.orders for one in result.by_order].index(result.chosen.orders)
    return Table(title, headings, rows, [chosen])


def _power(loss: float) -> int:
    """Returns the power of ten that numbers of this size have in common; 0 for a usual size."""
    if not (math.isfinite(loss) and loss > 0.0):
        return 0
    power = math.floor(math.log10(loss))
    return power if power < LEAST_POWER or power > MOST_POWER else 0


def _scaled(value: float, power: int) -> str:
    """Returns a number in units of a power of ten; of a far larger or smaller one, one digit."""
    scaled = value / 10.0**power
    return f"{scaled:.5g}" if scaled == 0.0 or 1e-3 <= scaled < 1e5 else f"{scaled:.0e}"


def identification_lines(result: IdentificationResult) -> list[str]:
    """Returns the choice with its reasons, the residual tests, and the advice, in sentences."""
    return [
        result.reason,
        result.delay_reason,
        result.whiteness.verdict,
        result.independence.verdict,
        *result.advice,
    ]


def servo_table(result: EstimationResult) -> Table | None:
    """Returns K, omega_n and xi with their intervals and trust; None where there is no servo."""
    return None if result.servo is None else servo_path_table(result.servo)


def servo_path_table(servo: ServoPath) -> Table:
    """Returns K, omega_n and xi over a record with their intervals and trust."""
    rows = []
    for value in servo:
        plain = value.to_dict()
        low, high = plain["ci90"] or (math.nan, math.nan)
        told = "-" if plain["value"] is None else f"{plain['value']:.4g} {value.unit}".rstrip()
        interval = "-" if plain["value"] is None else f"{low:.4g} .. {high:.4g}"
        trusted = f"{100.0 * value.trusted_share:.0f} % of the record"
        rows.append((value.name, told, interval, trusted))
    headings = ("servo", "value", "90 % interval", "trusted")
    return Table(f"delay in samples: {servo.delay}", headings, rows)


def servo_lines(result: EstimationResult) -> list[str]:
    """Returns what is to be said of the servo, in sentences."""
    return [] if result.servo is None else servo_words(result.servo)


def parameter_table(result: EstimationResult) -> Table:
    """Returns the estimated parameters with their intervals."""
    rows = tuple(
        (name, f"{entry['value']:.5g}", f"{entry['ci95'][0]:.5g} .. {entry['ci95'][1]:.5g}")
        for name, entry in result.to_dict()["parameters"].items()
    )
    return Table("", ("parameter", "value", "95 % interval"), rows)


def estimation_lines(result: EstimationResult) -> list[str]:
    """Returns the figures of an estimation, and what its residuals mean, in sentences."""
    figures = (
        f"one-step fit {result.one_step_fit_percent:.2f} %, "
        f"{simulation_words(result.simulation_fit_percent)}, RMSE {plain_number(result.rmse, 4)}, "
        f"resets {result.resets}, {state_words(result)}, "
        f"{result.skipped} of {result.status.size} samples carried no information; "
        f"one-step fit and RMSE leave out the first {result.n_start} equations"
    )
    constant = (
        "The offset is the constant term of the signals as they are in the record."
        if result.orders.offset
        else "The model is of the signals less their means, "
        f"{plain_number(result.u_mean, 6)} of the input and {plain_number(result.y_mean, 6)} of "
        "the output."
    )
    lines = [figures, constant]
    return lines if result.residuals_white else [*lines, not_white_words(result)]


def run_table(run: SimulationRun) -> Table:
    """Returns the range of each simulated output, and the error of its integration."""
    rows = tuple(
        (name, f"{values.min():.5g}", f"{values.max():.5g}", plain_number(100.0 * error, 2))
        for name, error in run.error.items()
        for values in [run.record.column(name)]
    )
    headings = ("output", "lowest", "highest", "error of integration, % of range")
    return Table("", headings, rows)
