# SPDX-License-Identifier: MIT
"""Figures of the offline procedure: outputs, residual tests, poles and zeros."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse

from ehsid.harness.base.text import printable
from ehsid.harness.catalogue.channels import shown_channel
from ehsid.harness.models.identification import IdentificationResult, PolesZeros, Roots
from ehsid.harness.show.model_figures import draw_correlation
from ehsid.harness.show.plotting import BLUE, GREY, SKY, VERMILION, stacked, styled, time_axis

from ..attempts import Attempt

# Size of the regions of 95 %: the squared radius, in standard deviations, of the ellipse for two
# normal values, and the half width, in standard deviations, of the interval for one value.
CHI2_2_95 = 5.991
DEVIATIONS_95 = 1.960


@styled
def outputs_figure(attempt: Attempt, dt_s: float | None, output: str) -> Figure:
    """Draws measured and simulated output on the validation part, and the errors below.

    The errors are those of the simulation and of the one-step prediction, as measured less
    predicted output. The time is in seconds, or in samples without a sampling time.
    """
    figure, (upper, lower) = stacked(6.0, [3, 2], xlabel=time_axis(dt_s, 0)[1])
    if attempt.one_step is None or attempt.simulated is None:
        return figure
    step = dt_s or 1.0
    words, factor, unit = shown_channel(output)
    upper.plot(
        attempt.simulated.index * step,
        factor * attempt.simulated.measured,
        label="measured",
        linewidth=2.0,
    )
    upper.plot(
        attempt.simulated.index * step,
        factor * attempt.simulated.predicted,
        label=f"simulated, fit {attempt.simulation_fit_percent:.2f} %",
        linewidth=1.0,
    )
    upper.set_ylabel(
        f"{printable(words)} in {unit}" if unit else printable(words), parse_math=False
    )
    upper.legend()
    for prediction, label in (
        (attempt.simulated, "simulation"),
        (attempt.one_step, f"one step ahead, fit {attempt.one_step_fit_percent:.2f} %"),
    ):
        colour = VERMILION if prediction is attempt.simulated else GREY
        error = factor * prediction.residual
        lower.plot(prediction.index * step, error, label=label, color=colour, linewidth=0.9)
    lower.set_ylabel("measured less predicted")
    lower.legend()
    return figure


@styled
def residual_figure(result: IdentificationResult) -> Figure:
    """Draws the residual's autocorrelation and its correlation with the input, with 99 % bands."""
    figure = Figure(figsize=(9, 5))
    upper, lower = figure.subplots(2, 1)
    draw_correlation(upper, result.whiteness, "autocorrelation of the residual")
    family_band = result.independence.family_band
    label = "of lags 0 and up together"
    lower.axhline(family_band, color=SKY, linestyle="--", linewidth=1.0, label=label)
    lower.axhline(-family_band, color=SKY, linestyle="--", linewidth=1.0)
    title = "correlation of residual and input (positive lags: earlier input)"
    draw_correlation(lower, result.independence, title)
    lower.set_xlabel("lag in samples")
    return figure


@styled
def poles_zeros_figure(model_roots: PolesZeros) -> Figure:
    """Draws poles and zeros with their regions of 95 %, in the whole plane and around z = 1."""
    figure = Figure(figsize=(9, 4.8))
    whole, near = figure.subplots(1, 2)
    values = np.concatenate((model_roots.poles.values, model_roots.zeros.values, [1.0]))
    widest = min(1.15 * max(1.0, float(np.max(np.abs(values)))), 2.0)
    closest = model_roots.poles.values[np.argmin(np.abs(model_roots.poles.values - 1.0))]
    reach = max(float(np.abs(closest - 1.0)), _spread(model_roots.poles), 1e-6)
    for axes, centre, half in ((whole, 0.0, widest), (near, 1.0, min(3.0 * reach, 0.5))):
        axes.grid(False)
        axes.add_patch(Circle((0.0, 0.0), 1.0, fill=False, color="0.5", linewidth=0.8))
        axes.axhline(0.0, color="0.8", linewidth=0.6)
        _roots(axes, model_roots.poles, "x", BLUE, "poles")
        _roots(axes, model_roots.zeros, "o", VERMILION, "zeros")
        axes.set_xlim(centre - half, centre + half)
        axes.set_ylim(-half, half)
        axes.set_aspect("equal")
        axes.set_xlabel("real part")
    outside = int(np.sum(np.abs(values) > widest))
    whole.set_title("unit circle" + (f" ({outside} beyond the frame)" if outside else ""))
    near.set_title("around z = 1")
    near.tick_params(axis="x", labelrotation=30)
    whole.set_ylabel("imaginary part")
    whole.legend(loc="upper left")
    return figure


def _roots(axes: Axes, roots: Roots, marker: str, colour: str, label: str) -> None:
    axes.plot(
        roots.values.real,
        roots.values.imag,
        marker,
        color=colour,
        markerfacecolor="none",
        markersize=8.0,
        linestyle="none",
        label=label,
    )
    for value, spread, reliable in zip(roots.values, roots.covariance, roots.reliable, strict=True):
        if not reliable:
            continue
        if value.imag == 0.0:
            half = DEVIATIONS_95 * float(np.sqrt(spread[0, 0]))
            axes.plot([value.real - half, value.real + half], [0.0, 0.0], color=colour, alpha=0.5)
            continue
        size, direction = np.linalg.eigh(spread)
        width, height = 2.0 * np.sqrt(CHI2_2_95 * np.maximum(size, 0.0))
        angle = float(np.degrees(np.arctan2(direction[1, 0], direction[0, 0])))
        axes.add_patch(
            Ellipse(
                (value.real, value.imag),
                float(width),
                float(height),
                angle=angle,
                color=colour,
                alpha=0.25,
            )
        )


def _spread(roots: Roots) -> float:
    nearest = int(np.argmin(np.abs(roots.values - 1.0)))
    if not roots.reliable[nearest]:
        return 0.1
    return DEVIATIONS_95 * float(np.sqrt(np.trace(roots.covariance[nearest])))
