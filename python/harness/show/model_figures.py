# SPDX-License-Identifier: MIT
"""Draws an identification with its Bode diagram, and a recursive estimation.

What is drawn of an identified model, as numbers: matplotlib and Bokeh only draw it.

The files of an offline identification and of a recursive estimation.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..base.encoding import to_plain
from ..base.files import write_text
from ..base.numbers import FloatArray
from ..models.estimation import EstimationResult
from ..models.estimation.advice import Advice
from ..models.estimation.servo import ServoValue
from ..models.identification import (
    EstimatedResponse,
    FrequencyResponse,
    IdentificationResult,
    IoData,
    frequency_response,
    power_band,
    response_grid,
)
from ..models.identification.candidates import diverges
from ..models.identification.loop import LoopAnalysis, analyse_loop, to_control
from ..models.identification.residuals import IndependenceTest, WhitenessTest
from ..records import Origin
from ..records.record import with_reading
from .model_blocks import limit_words
from .model_file_names import IDENTIFICATION_FILES
from .plotting import (
    BLUE,
    FITTED,
    GREEN,
    GREY,
    MEASURED,
    SKY,
    VERMILION,
    draw_band,
    stacked,
    styled,
    time_axis,
    write_figure,
)
from .units import frequency_unit

FARTHEST = 1e4  # of the end of a band, in dB or degrees


class Curve(msgspec.Struct, frozen=True):
    """A curve over the frequency, with the ends of its 95 % band, and those of its axis.

    `known` are values that are known otherwise, at `Bode.known_at`.
    """

    label: str
    middle: list[float]
    low: list[float]
    high: list[float]
    ends: tuple[float, float]
    known: list[float] = []


class Bode(msgspec.Struct, frozen=True):
    """A Bode diagram; the frequency is in Hz, or per sample without a sampling time."""

    frequency: list[float]
    """Of the curves."""
    curves: list[Curve]
    """Magnitude in dB, and phase in degrees."""
    not_excited: list[tuple[float, float]]
    """Stretches of the frequency in which the input has next to no power."""
    known_at: list[float] = []
    source: str = ""
    """Frequencies at which the response is known otherwise, and from where; empty where it is not.
    """


class Lags(msgspec.Struct, frozen=True):
    """A residual test: the correlation at each lag in samples, and the 99 % band of one lag."""

    lags: list[int]
    values: list[float]
    band: float

    @property
    def outside(self) -> npt.NDArray[np.bool_]:
        """Which lags are outside of the band."""
        return np.asarray(np.abs(self.values) > self.band)


def lags(test: WhitenessTest | IndependenceTest) -> Lags:
    """Returns what is drawn of a residual test."""
    return Lags(test.lags.tolist(), test.correlation.tolist(), test.band)


def model_bode(result: IdentificationResult, data: IoData) -> Bode:
    """Returns the diagram of a model that was identified from these data."""
    dt_s = data.dt_s or 1.0
    grid = response_grid(result.n_validation, dt_s)
    return bode(frequency_response(result.chosen.model, grid, dt_s), power_band(data))


def bode(
    response: EstimatedResponse,
    input_band: tuple[float, float] | None = None,
    truth: FrequencyResponse | None = None,
) -> Bode:
    """Returns the diagram of a model; grey is outside of `input_band`, and `truth` is known."""
    f = response.frequency_hz
    magnitude = phase = np.zeros(0)
    if truth is not None:
        # The two phases are unwrapped separately, so they can differ by multiples of 360 degrees.
        nearest = int(np.argmin(np.abs(f - truth.frequency_hz[0])))
        turns = np.round((response.phase_deg[nearest] - truth.phase_deg[0]) / 360.0)
        magnitude, phase = truth.magnitude_db, truth.phase_deg + 360.0 * turns
    curves = []
    for label, middle, band, known, margin in (
        ("magnitude in dB", response.magnitude_db, response.magnitude_band_db(), magnitude, 6.0),
        ("phase in degrees", response.phase_deg, response.phase_band_deg(), phase, 60.0),
    ):
        # A band is very wide where the data hardly determine the model, and may be infinite; it
        # must not flatten the curve.
        low, high = np.nan_to_num(band.T, nan=0.0, posinf=FARTHEST, neginf=-FARTHEST).tolist()
        seen = np.concatenate((middle, known))
        ends = float(np.min(seen)) - margin, float(np.max(seen)) + margin
        curves.append(Curve(label, middle.tolist(), low, high, ends, known.tolist()))
    spans = [] if input_band is None else [(f[0], input_band[0]), (input_band[1], f[-1])]
    return Bode(
        f.tolist(),
        curves,
        [(float(start), float(stop)) for start, stop in spans if start < stop],
        [] if truth is None else truth.frequency_hz.tolist(),
        "" if truth is None else truth.source,
    )


@styled
def estimation_figure(result: EstimationResult, dt_s: float | None) -> Figure:
    """Draws K of the servo, the parameters with their 95 % bands, lambda and the innovation."""
    x, label = time_axis(dt_s, result.status.size)
    servo = result.servo
    heights = [3, 1, 1] if servo is None else [2, 3, 1, 1]
    figure, axes = stacked(8.0 if servo is None else 9.5, heights, xlabel=label)
    upper, middle, lower = axes[-3:]
    if servo is not None:
        draw_servo_value(axes[0], x, servo.gain)
        axes[0].set_title("servo: K with its 90 % band")
    # The first samples and those after a reset vary by orders of magnitude. The axis follows the
    # other samples.
    settled = result.theta_path[result.theta_path.shape[0] // 10 :]
    for i, name in enumerate(result.orders.names):
        middle_curve, half = result.theta_path[:, i], 1.96 * result.deviation_path[:, i]
        curves = (middle_curve - half, middle_curve, middle_curve + half)
        draw_band(upper, x, curves, label=name, linewidth=1.2)
    low, high = (float(value) for value in np.quantile(settled, [0.02, 0.98]))
    margin = 0.3 * (high - low) + 1e-12
    upper.set_ylim(low - margin, high + margin)
    upper.set_ylabel("parameters, 95 % band")
    upper.legend(ncols=len(result.orders.names))
    biased = "" if result.residuals_white else "; residuals not white, estimate biased"
    upper.set_title(f"{result.forgetting}{biased}")
    middle.plot(x, result.forgetting_factor, color=GREEN, linewidth=1.0)
    middle.set_ylabel("lambda")
    lower.plot(x, result.innovation, color=GREY, linewidth=0.8)
    lower.set_ylim(-6 * result.rmse, 6 * result.rmse)
    lower.set_ylabel("innovation")
    return figure


def draw_servo_value(axes: Axes, x: FloatArray, told: ServoValue) -> None:
    """Draws K, omega_n or xi with its 90 % band, in another colour where it is not trusted."""
    for shown, colour, word in (
        (told.trusted_path, BLUE, "trusted"),
        (~told.trusted_path, VERMILION, "not trusted"),
    ):
        value, half = (np.where(shown, path, np.nan) for path in (told.path, told.half_path))
        curves = (value - half, value, value + half)
        draw_band(axes, x, curves, label=word, linewidth=1.4, color=colour)
    known = told.path[told.trusted_path if told.trusted else np.isfinite(told.path)]
    if known.size:
        low, high = (float(one) for one in np.quantile(known, [0.02, 0.98]))
        margin = 0.3 * (high - low) + 0.1 * abs(high)
        axes.set_ylim(low - margin, high + margin)
    axes.set_ylabel(", ".join(filter(None, (told.name, told.unit))), parse_math=False)
    axes.legend(ncols=2)


@styled
def identification_figure(result: IdentificationResult) -> Figure:
    """Draws measured and simulated output, and both residual tests with their 99 % bands."""
    figure = Figure(figsize=(9, 8))
    upper, middle, lower = figure.subplots(3, 1, height_ratios=[2, 1, 1])
    _, label = time_axis(result.dt_s, 1)
    time = result.simulated.index * (result.dt_s or 1.0)
    upper.plot(time, result.simulated.measured, color=MEASURED, label="measured")
    chosen = result.chosen.simulation_fit_percent
    fit = "simulated, diverges" if diverges(chosen) else f"simulated, fit {chosen:.1f} %"
    upper.plot(time, result.simulated.predicted, color=FITTED, label=fit)
    upper.set_xlabel(label)
    upper.margins(x=0.0)
    upper.legend()
    upper.set_title(f"validation half, {result.chosen.orders}")
    draw_correlation(middle, result.whiteness, "autocorrelation of the residual")
    draw_correlation(lower, result.independence, "correlation of residual and input")
    lower.set_xlabel("lag in samples")
    return figure


def draw_correlation(axes: Axes, test: WhitenessTest | IndependenceTest, title: str) -> None:
    """Draws a residual test lag by lag; lags outside of the band of a single lag are coloured."""
    axes.axhspan(-test.band, test.band, color=SKY, alpha=0.25, label="99 % band of a single lag")
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    outside = lags(test).outside
    for which, colour in ((~outside, BLUE), (outside, VERMILION)):
        axes.vlines(test.lags[which], 0.0, test.correlation[which], color=colour, linewidth=3.0)
    axes.margins(x=0.02)
    axes.set_title(title, loc="left")
    axes.legend(loc="upper right")


@styled
def bode_figure(shown: Bode, dt_s: float | None, loop: LoopAnalysis | None = None) -> Figure:
    """Draws magnitude and phase with their 95 % bands, and the response that is known otherwise.

    Frequencies that the input did not excite are shaded grey. With `loop`, the figure shows gain
    margin and phase margin of the loop with half the limit gain.
    """
    figure, (upper, lower) = stacked(6.0, [1, 1], xlabel=f"frequency in {frequency_unit(dt_s)}")
    for axes, curve in zip((upper, lower), shown.curves, strict=True):
        f, low, high = shown.frequency, curve.low, curve.high
        axes.fill_between(f, low, high, alpha=0.3, linewidth=0, label="95 % band")
        axes.semilogx(f, curve.middle, label="model", linewidth=1.5)
        axes.grid(which="minor", alpha=0.15)
        for i, stretch in enumerate(shown.not_excited):
            beyond = None if i else "outside the input's band"
            axes.axvspan(*stretch, color=GREY, alpha=0.12, linewidth=0, label=beyond)
        if shown.known_at:
            axes.semilogx(shown.known_at, curve.known, "k.", markersize=4.0, label=shown.source)
        axes.set_ylim(*curve.ends)
        axes.set_ylabel(curve.label)
    if loop is not None:
        _margins(upper, lower, shown, loop)
    upper.legend()
    return figure


def _margins(upper: Axes, lower: Axes, shown: Bode, loop: LoopAnalysis) -> None:
    """Draws both margins of the loop with half the limit gain as arrows.

    They lie between the curves and the lines of 1/k and of -180 degrees of k G.
    """
    half, turnover = loop.half, loop.phase_crossover_hz
    if half is None or turnover is None or loop.limit_gain is None:
        return
    arrow = {"arrowstyle": "<->", "color": VERMILION}
    level, lowest = (-20.0 * np.log10(np.abs(k)) for k in (half.gain, loop.limit_gain))
    upper.axhline(level, color=VERMILION, linestyle="--", linewidth=1.0, label="1/k")
    upper.annotate("", (turnover, lowest), (turnover, level), arrowprops=arrow)
    for axes in (upper, lower):
        axes.axvline(turnover, color=VERMILION, linestyle=":", linewidth=1.0)
        if half.gain_crossover_hz is not None:
            axes.axvline(half.gain_crossover_hz, color=VERMILION, linestyle=":", linewidth=1.0)
    # With a negative k, -180 degrees of k G are 0 degrees of G. Multiples of 360 degrees are the
    # same phase; the line is drawn at the one nearest to the curve.
    border = -180.0 if half.gain > 0.0 else 0.0
    at = float(np.interp(np.log(turnover), np.log(shown.frequency), shown.curves[1].middle))
    border += 360.0 * round((at - border) / 360.0)
    lower.axhline(
        border, color=VERMILION, linestyle="--", linewidth=1.0, label="phase of k G: -180"
    )
    words = f"gain margin {20.0 * np.log10(half.gain_margin):.1f} dB"
    if half.gain_crossover_hz is not None and half.phase_margin_deg is not None:
        lower.annotate(
            "",
            (half.gain_crossover_hz, border),
            (half.gain_crossover_hz, border + half.phase_margin_deg),
            arrowprops=arrow,
        )
        words += f", phase margin {half.phase_margin_deg:.1f} degrees"
    upper.set_title(f"proportional control with k = {half.gain:.4g}: {words}")
    upper.legend()
    lower.legend()


def write_identification(
    folder: Path,
    result: IdentificationResult,
    data: IoData,
    origin: Origin | None,
) -> str:
    """Writes the files of an identification.

    Parameters
    ----------
    folder
        to write into.
    result, data
        the identification, and what it was made of.
    origin
        how the log became a record; None for a record.

    Returns
    -------
    The limit of stability of the chosen model under proportional control, in words.
    """
    plain = with_reading(result.to_dict(), origin)
    _write(folder, "identify", plain, identification_figure(result))
    model, dt_s = result.chosen.model, data.dt_s
    loop, band = analyse_loop(to_control(model, dt_s)), power_band(data)
    figure = bode_figure(model_bode(result, data), dt_s, loop)
    write_figure(folder / IDENTIFICATION_FILES[2], figure)
    return limit_words(loop, dt_s, band)


def write_estimation(
    folder: Path,
    result: EstimationResult,
    dt_s: float | None,
    origin: Origin | None,
    advice: Advice,
) -> None:
    """Writes the files of a recursive estimation; `advice` is what to try, the others as above."""
    plain = {**with_reading(result.to_dict(), origin), "advice": to_plain(advice)}
    _write(folder, "estimate", plain, estimation_figure(result, dt_s))


def _write(folder: Path, stem: str, results: dict[str, Any], figure: Figure) -> None:
    text = json.dumps(results, indent=2, allow_nan=False) + "\n"
    write_text(folder / f"{stem}.json", text)
    write_figure(folder / f"{stem}.png", figure)
