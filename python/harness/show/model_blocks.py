# SPDX-License-Identifier: MIT
"""What is told of a model, an estimate, a run and a proportional control, wherever it is shown."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from ..base.numbers import plain_number
from ..catalogue.channels import COMMAND
from ..models.estimation.advice import not_white_words, servo_words, state_words
from ..models.identification.candidates import simulation_cell, simulation_words
from ..models.identification.dynamics import Dynamics, Figure, Root, dynamics
from .page import Block, Table, Tagged, Told, cell_text
from .units import Shown, coefficient, column, frequency_unit, si_column

if TYPE_CHECKING:
    from ..models.estimation import EstimationResult
    from ..models.estimation.servo import ServoPath
    from ..models.identification import IdentificationResult
    from ..models.identification.loop import LoopAnalysis, Mode, ProportionalLoop
    from ..signals.simulation import SimulationRun


def loop_blocks(
    loop: LoopAnalysis, dt_s: float | None, input_band: tuple[float, float] | None = None
) -> list[Block]:
    """Returns the limit of stability in words, and the loops and natural frequencies as tables."""
    unit = frequency_unit(dt_s)
    return [
        (
            f"{limit_words(loop, dt_s, input_band)} k is in units of the input over units of the "
            "output."
        ),
        Table(
            "Loops with unity gain and with half the limit. Usual demands are a gain margin of "
            "6 dB or more and a phase margin of 45 degrees or more. The figures are those of the "
            "model, by python-control.",
            (
                "k",
                "stable",
                "gain margin, dB",
                "phase margin, degrees",
                f"gain crossover, {unit}",
                "least damping ratio",
            ),
            [_row(closed) for closed in loop.loops],
        ),
        Table(
            "Natural frequencies and damping ratios of the model's poles, as those of "
            "s = ln(z) / dt.",
            ("pole z", f"natural frequency, {unit}", "damping ratio"),
            [
                (place(mode.pole), plain_number(mode.frequency_hz, 4), f"{mode.damping:.3f}")
                for mode in loop.modes
            ],
        ),
    ]


def limit_words(
    loop: LoopAnalysis, dt_s: float | None, input_band: tuple[float, float] | None
) -> str:
    """Says up to which gain the loop is stable, and whether `input_band` supports this limit."""
    control = "Under proportional control, u = k (r - y),"
    if loop.limit_gain is None or loop.phase_crossover_hz is None or loop.half is None:
        return (
            f"{control} no gain makes the model oscillate: its phase does not reach -180 degrees."
        )
    limit = f"k = {plain_number(loop.limit_gain, 4)}"
    if not loop.half.stable:
        return f"{control} the model is unstable with half of {limit} already."
    text = (
        f"{control} the model is stable up to {limit}, where it oscillates at "
        f"{plain_number(loop.phase_crossover_hz, 4)} {frequency_unit(dt_s)}."
    )
    if input_band is not None and not input_band[0] <= loop.phase_crossover_hz <= input_band[1]:
        text += (
            " The input has next to no power there: this limit is extrapolated, do not rely on it."
        )
    return text


def place(z: complex) -> str:
    """Returns a real pole, or both poles of a complex pair, as text."""
    return f"{z.real:.5f}" + (f" ± {z.imag:.5f}j" if z.imag else "")


def _row(loop: ProportionalLoop) -> Sequence[str]:
    return (
        plain_number(loop.gain, 4),
        "yes" if loop.stable else "no",
        "no limit" if np.isinf(loop.gain_margin) else f"{20.0 * np.log10(loop.gain_margin):.1f}",
        "no crossover" if loop.phase_margin_deg is None else f"{loop.phase_margin_deg:.1f}",
        "none" if loop.gain_crossover_hz is None else plain_number(loop.gain_crossover_hz, 4),
        _least_damping(loop.modes),
    )


def _least_damping(modes: Sequence[Mode]) -> str:
    return f"{min(mode.damping for mode in modes):.3f}" if modes else "no poles but delays"


# Numbers of 1e-3 to below 1e5 need no common power of ten.
LEAST_POWER, MOST_POWER = -3, 4


class ModelTold(msgspec.Struct, frozen=True):
    """What is told of an identified model."""

    orders: Table
    """The best candidate of each order; the chosen one is marked."""
    reasons: list[str]
    tests: list[Tagged]
    advice: list[str]
    """Why it was chosen, what the residual tests found, and what to be careful with."""
    coefficients: Table
    roots: Table
    """Of the chosen model."""
    servo: list[str]
    """K, omega_n and xi as far as they exist, and why not, else."""

    def blocks(self) -> list[Told]:
        """Returns all of it in the order of reading."""
        found = [*self.reasons, *map(cell_text, self.tests), *self.advice]
        return [self.orders, *found, self.coefficients, self.roots, *self.servo]


def model_told(
    result: IdentificationResult, input_name: str, output_name: str, *, usual: bool = False
) -> ModelTold:
    """Returns what is told of an identification.

    Parameters
    ----------
    result
        the identification.
    input_name, output_name
        columns that it was made of.
    usual
        whether numbers are in the units that people use, with a column that says so; else in those
        of the record.
    """
    unit_of = column if usual else si_column
    ends = unit_of(output_name), unit_of(input_name)
    model = result.chosen.model
    told = dynamics(model, result.dt_s)
    spread = zip(model.orders.names, model.theta.tolist(), model.standard_deviations, strict=True)
    rows = []
    for name, value, deviation in spread:
        shown = coefficient(name, *ends)
        numbers = plain_number(shown.factor * value, 6), plain_number(shown.factor * deviation, 2)
        rows.append((name, *numbers, shown.unit))
    orders = model.orders
    rests = told.static_gain is not None
    third = any((one.orders.na, one.orders.nb) == (3, 3) for one in result.by_order)
    title = f"model: na = {orders.na}, nb = {orders.nb}, nk = {orders.nk}"
    return ModelTold(
        orders=_candidates(result),
        reasons=[result.reason, result.delay_reason],
        tests=[
            Tagged(test.verdict, kind="good" if test.passed else "bad")
            for test in (result.whiteness, result.independence)
        ],
        advice=list(result.advice),
        coefficients=_with_units(title, ("coefficient", "value", "1-sigma"), rows, units=usual),
        roots=_roots(told, timed=result.dt_s is not None),
        # Where the third order was tried, and a model that does not integrate is better, nobody
        # misses a servo.
        servo=_servo_lines(told, *ends)[: 1 if rests and third else None],
    )


def model_line(result: IdentificationResult) -> str:
    """Returns which model was chosen and how well it fits, in a line."""
    chosen = result.chosen
    return (
        f"{chosen.orders}; on the validation half one-step fit {chosen.one_step_fit_percent:.2f} "
        f"%, {simulation_words(chosen.simulation_fit_percent)}"
    )


def _with_units(
    title: str, headings: tuple[str, ...], rows: Sequence[tuple[str, ...]], *, units: bool
) -> Table:
    """Returns a table of rows that end with a unit, which is shown where `units` says so."""
    if units:
        return Table(title, (*headings, "unit"), rows)
    return Table(title, headings, [row[:-1] for row in rows])


def _candidates(result: IdentificationResult) -> Table:
    """Returns the figures of the best candidate of each order.

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


def _roots(told: Dynamics, *, timed: bool) -> Table:
    """Returns poles and zeros; with the sampling time, frequency and damping of the poles."""
    rows = [_root("pole", one) for one in told.poles] + [_root("zero", one) for one in told.zeros]
    headings = ("", "z", "|z|", "1-sigma of |z|", "f in Hz", "damping")
    shown = len(headings) if timed else 4
    return Table("", headings[:shown], [row[:shown] for row in rows])


def _root(kind: str, root: Root) -> tuple[str, ...]:
    place = f"{root.real:.5g}" + (f" +- {root.imag:.5g} j" if root.imag > 0.0 else "")
    return (
        kind,
        place,
        f"{abs(complex(root.real, root.imag)):.5g}",
        "" if root.deviation is None else plain_number(root.deviation, 2),
        "integrator" if root.integrates else _number(root.frequency_hz),
        _number(root.damping),
    )


def _number(value: float | None) -> str:
    return "" if value is None else plain_number(value, 3)


def _servo_lines(told: Dynamics, above: Shown, below: Shown) -> list[str]:
    """Returns K, omega_n and xi of the chosen model as far as they exist, and why not, else."""
    lines = [_gain_line(told, above, below)]
    if told.servo is None:
        lines.append(f"Not read as a servo: {told.why_no_servo}.")
    else:
        lines.append(
            f"Natural frequency omega_n = {_figure(told.servo.omega_n)} rad/s, damping ratio "
            f"xi = {_figure(told.servo.xi)}."
        )
    return lines


def _gain_line(told: Dynamics, above: Shown, below: Shown) -> str:
    factor, y, u = above.factor / below.factor, above.unit_words, below.unit_words
    if told.velocity_gain is not None:
        return f"Velocity gain K = {_figure(told.velocity_gain, factor)} {y}/s per {u}."
    if told.static_gain is not None:
        late = "" if told.lag_s is None else f" {_figure(told.lag_s, 1e3)} ms late"
        return (
            f"The model follows a slow input{late} with a static gain of "
            f"{_figure(told.static_gain, factor)} {y} per {u}; it does not integrate and has no "
            "velocity gain K."
        )
    if not told.stable:
        return (
            "The model is unstable: a pole lies outside of the unit circle, so that it has neither "
            "a static gain nor a velocity gain K."
        )
    return "The model integrates. Its velocity gain K needs the sampling time, which is not known."


def _figure(figure: Figure, factor: float = 1.0) -> str:
    value = plain_number(factor * figure.value, 4)
    if figure.deviation is None:
        return value
    return f"{value} +- {plain_number(factor * figure.deviation, 2)}"


class EstimateTold(msgspec.Struct, frozen=True):
    """What is told of a recursive estimation."""

    servo: list[str | Table]
    """K, omega_n and xi with their intervals and trust, and what is to be said of them; no blocks
    where there is no servo."""
    head: str
    """Structure, method and forgetting."""
    parameters: Table
    """At the end of the record, with their intervals."""
    figures: list[str]
    """Figures of the estimation, and what its residuals mean."""

    def blocks(self) -> list[Told]:
        """Returns all of it in the order of reading."""
        return [*self.servo, self.head, self.parameters, *self.figures]


def estimate_told(
    result: EstimationResult, input_name: str, output_name: str, *, usual: bool = False
) -> EstimateTold:
    """Returns what is told of an estimation; the parameters are as those of `model_told`."""
    unit_of = column if usual else si_column
    ends = unit_of(output_name), unit_of(input_name)
    servo = result.servo
    rows = []
    for name, entry in result.to_dict()["parameters"].items():
        shown = coefficient(name, *ends)
        value, low, high = (shown.factor * one for one in (entry["value"], *entry["ci95"]))
        rows.append((name, f"{value:.5g}", f"{low:.5g} .. {high:.5g}", shown.unit))
    headings = ("parameter", "value", "95 % interval")
    return EstimateTold(
        servo=[] if servo is None else [servo_table(servo), *servo_words(servo)],
        head=f"{result.orders}, {result.method}, {result.forgetting}",
        parameters=_with_units("", headings, rows, units=usual),
        figures=_figures(result, ends[0] if usual else Shown("", "", 1.0)),
    )


def servo_table(servo: ServoPath) -> Table:
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


def _figures(result: EstimationResult, output: Shown) -> list[str]:
    rmse = f"{plain_number(output.factor * result.rmse, 4)} {output.unit}".rstrip()
    figures = (
        f"one-step fit {result.one_step_fit_percent:.2f} %, "
        f"{simulation_words(result.simulation_fit_percent)}, RMSE {rmse}, "
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
    """Returns the range of each simulated output, and the error of its integration if known."""
    rows: list[tuple[str, ...]] = []
    for name, values in run.record.columns.items():
        if name != COMMAND:
            row = (name, f"{values.min():.5g}", f"{values.max():.5g}")
            error = run.error.get(name)
            rows.append(row if error is None else (*row, plain_number(100.0 * error, 2)))
    headings: tuple[str, ...] = ("output", "lowest", "highest")
    if run.error:
        headings = (*headings, "error of integration, % of range")
    return Table("", headings, tuple(rows))
