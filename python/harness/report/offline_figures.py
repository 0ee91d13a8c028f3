# SPDX-License-Identifier: MIT
"""Figures of the offline procedure: outputs, residual tests, poles and zeros, Bode."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse

from ehsid.harness.experiment.attempts import Attempt
from ehsid.harness.identification import (
    EstimatedResponse,
    FrequencyResponse,
    IdentificationResult,
    PolesZeros,
    Roots,
)
from ehsid.harness.identification.loop import LoopAnalysis

# 95 % of a normal pair of values lie within this of the centre, squared, in deviations.
CHI2_2_95 = 5.991
DEVIATIONS_95 = 1.960


def outputs_figure(attempt: Attempt, dt_s: float | None, output: str) -> Figure:
    """Measured and simulated output on the validation part, and what either prediction misses."""
    figure = Figure(figsize=(9, 6), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    if attempt.one_step is None or attempt.simulated is None:
        return figure
    step = dt_s or 1.0
    upper.plot(
        attempt.simulated.index * step, attempt.simulated.measured, label="measured", linewidth=2.0
    )
    upper.plot(
        attempt.simulated.index * step,
        attempt.simulated.predicted,
        label=f"simulated, fit {attempt.simulation_fit_percent:.2f} %",
        linewidth=1.0,
    )
    upper.set_ylabel(output)
    upper.legend(fontsize="small")
    for prediction, label in (
        (attempt.simulated, "simulation"),
        (attempt.one_step, f"one step ahead, fit {attempt.one_step_fit_percent:.2f} %"),
    ):
        colour = "tab:orange" if prediction is attempt.simulated else "tab:gray"
        lower.plot(
            prediction.index * step, prediction.residual, label=label, color=colour, linewidth=0.9
        )
    lower.set_ylabel("measured less predicted")
    lower.set_xlabel("sample" if dt_s is None else "time in s")
    lower.legend(fontsize="small")
    for axes in (upper, lower):
        axes.margins(x=0.0)
        axes.grid(True, alpha=0.3)
    return figure


def residual_figure(result: IdentificationResult) -> Figure:
    """Autocorrelation of the residual and its correlation with the input, with their bands."""
    figure = Figure(figsize=(9, 5), layout="constrained")
    upper, lower = figure.subplots(2, 1)
    white, independent = result.whiteness, result.independence
    for axes, test in ((upper, white), (lower, independent)):
        label = "99 % band of a single lag"
        axes.axhspan(-test.band, test.band, color="tab:orange", alpha=0.25, label=label)
        axes.axhline(0.0, color="0.5", linewidth=0.8)
        outside = np.abs(test.correlation) > test.band
        for which, colour in ((~outside, "tab:blue"), (outside, "tab:red")):
            axes.vlines(test.lags[which], 0.0, test.correlation[which], color=colour, linewidth=3.0)
        axes.margins(x=0.02)
    for sign in (-1.0, 1.0):
        lower.axhline(
            sign * independent.family_band,
            color="tab:orange",
            linestyle="--",
            linewidth=1.0,
            label="of lags 0 and up together" if sign > 0 else None,
        )
    upper.set_title("autocorrelation of the residual", fontsize="medium", loc="left")
    lower.set_title(
        "correlation of residual and input (positive lags: earlier input)",
        fontsize="medium",
        loc="left",
    )
    lower.set_xlabel("lag in samples")
    upper.legend(fontsize="small", loc="upper right")
    lower.legend(fontsize="small", loc="upper right")
    return figure


def poles_zeros_figure(found: PolesZeros) -> Figure:
    """Poles and zeros with their regions of 95 %, whole and around z = 1."""
    figure = Figure(figsize=(9, 4.8), layout="constrained")
    whole, near = figure.subplots(1, 2)
    values = np.concatenate((found.poles.values, found.zeros.values, [1.0]))
    widest = min(1.15 * max(1.0, float(np.max(np.abs(values)))), 2.0)
    closest = found.poles.values[np.argmin(np.abs(found.poles.values - 1.0))]
    reach = max(float(np.abs(closest - 1.0)), _spread(found.poles), 1e-6)
    for axes, centre, half in ((whole, 0.0, widest), (near, 1.0, min(3.0 * reach, 0.5))):
        axes.add_patch(Circle((0.0, 0.0), 1.0, fill=False, color="0.5", linewidth=0.8))
        axes.axhline(0.0, color="0.8", linewidth=0.6)
        _roots(axes, found.poles, "x", "tab:blue", "poles")
        _roots(axes, found.zeros, "o", "tab:red", "zeros")
        axes.set_xlim(centre - half, centre + half)
        axes.set_ylim(-half, half)
        axes.set_aspect("equal")
        axes.set_xlabel("real part")
    outside = int(np.sum(np.abs(values) > widest))
    whole.set_title(
        "unit circle" + (f" ({outside} beyond the frame)" if outside else ""), fontsize="medium"
    )
    near.set_title("around z = 1", fontsize="medium")
    near.tick_params(axis="x", labelrotation=30)
    whole.set_ylabel("imaginary part")
    whole.legend(fontsize="small", loc="upper left")
    return figure


def bode_figure(
    response: EstimatedResponse,
    truth: FrequencyResponse | None,
    dt_s: float | None,
    input_band: tuple[float, float] | None = None,
    loop: LoopAnalysis | None = None,
) -> Figure:
    """Magnitude and phase with the band of 95 %, beside the rig's where it is known.

    Shaded grey: outside `input_band`. With `loop`: the margins with half the limit gain.
    """
    figure = Figure(figsize=(9, 6), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    f = response.frequency_hz
    for axes, centre, band in (
        (upper, response.magnitude_db, response.magnitude_band_db()),
        (lower, response.phase_deg, response.phase_band_deg()),
    ):
        beyond: str | None = "outside the input's band"
        axes.fill_between(f, band[:, 0], band[:, 1], alpha=0.3, linewidth=0, label="95 % band")
        axes.semilogx(f, centre, label="model", linewidth=1.5)
        axes.grid(True, which="both", alpha=0.25)
        axes.margins(x=0.0)
        if input_band is not None:
            for start, stop in ((f[0], input_band[0]), (input_band[1], f[-1])):
                if start < stop:
                    axes.axvspan(start, stop, color="0.5", alpha=0.12, linewidth=0, label=beyond)
                    beyond = None
    low, high = float(np.min(response.magnitude_db)), float(np.max(response.magnitude_db))
    if truth is not None:
        # Unwrapped each by itself, the phases can be whole turns apart.
        nearest = int(np.argmin(np.abs(f - truth.frequency_hz[0])))
        turns = np.round((response.phase_deg[nearest] - truth.phase_deg[0]) / 360.0)
        for axes, values in (
            (upper, truth.magnitude_db),
            (lower, truth.phase_deg + 360.0 * turns),
        ):
            axes.semilogx(truth.frequency_hz, values, "k.", markersize=4.0, label=truth.source)
        low = min(low, float(np.min(truth.magnitude_db)))
        high = max(high, float(np.max(truth.magnitude_db)))
    # A band without bounds, where the model is hardly determined, must not flatten the rest.
    upper.set_ylim(low - 6.0, high + 6.0)
    middle = response.phase_deg
    lower.set_ylim(float(np.min(middle)) - 60.0, float(np.max(middle)) + 60.0)
    if loop is not None:
        _margins(upper, lower, response, loop)
    upper.set_ylabel("magnitude in dB")
    lower.set_ylabel("phase in degrees")
    lower.set_xlabel("frequency in cycles a sample" if dt_s is None else "frequency in Hz")
    upper.legend(fontsize="small")
    return figure


def _margins(upper: Axes, lower: Axes, response: EstimatedResponse, loop: LoopAnalysis) -> None:
    """Both margins of the loop with half the limit gain, as arrows between the curves and 1/k."""
    half, turnover = loop.half, loop.phase_crossover_hz
    if half is None or turnover is None or loop.limit_gain is None:
        return
    red = "tab:red"
    f = np.log(response.frequency_hz)
    level, lowest = (-20.0 * np.log10(np.abs(k)) for k in (half.gain, loop.limit_gain))
    upper.axhline(level, color=red, linestyle="--", linewidth=1.0, label="1/k")
    upper.annotate(
        "", (turnover, lowest), (turnover, level), arrowprops={"arrowstyle": "<->", "color": red}
    )
    for axes in (upper, lower):
        axes.axvline(turnover, color=red, linestyle=":", linewidth=1.0)
        if half.gain_crossover_hz is not None:
            axes.axvline(half.gain_crossover_hz, color=red, linestyle=":", linewidth=1.0)
    # -180 degrees of k G: with a negative k that is 0 of G; a whole turn more is the same phase.
    border = -180.0 if half.gain > 0.0 else 0.0
    at = float(np.interp(np.log(turnover), f, response.phase_deg))
    border += 360.0 * round((at - border) / 360.0)
    lower.axhline(border, color=red, linestyle="--", linewidth=1.0, label="phase of k G: -180")
    words = f"gain margin {20.0 * np.log10(half.gain_margin):.1f} dB"
    if half.gain_crossover_hz is not None and half.phase_margin_deg is not None:
        lower.annotate(
            "",
            (half.gain_crossover_hz, border),
            (half.gain_crossover_hz, border + half.phase_margin_deg),
            arrowprops={"arrowstyle": "<->", "color": red},
        )
        words += f", phase margin {half.phase_margin_deg:.1f} degrees"
    upper.set_title(f"proportional control with k = {half.gain:.4g}: {words}", fontsize="medium")
    upper.legend(fontsize="small")
    lower.legend(fontsize="small")


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
