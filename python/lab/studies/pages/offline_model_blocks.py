# SPDX-License-Identifier: MIT
"""Blocks of the sections on the offline procedure that describe the model that was kept.

Figures of the offline procedure: outputs, residual tests, poles and zeros.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse

from ehsid.harness.base.error_words import printable
from ehsid.harness.catalogue.channels import shown_channel
from ehsid.harness.models.identification import (
    Agreement,
    FrequencyResponse,
    IdentificationResult,
    PolesZeros,
    Roots,
)
from ehsid.harness.show.model_blocks import place
from ehsid.harness.show.model_figures import bode, bode_figure, draw_correlation
from ehsid.harness.show.page import Block, Picture, Table
from ehsid.harness.show.plotting import BLUE, GREY, PALE, SKY, VERMILION, stacked, styled, time_axis

from ..attempts import Attempt
from ..procedure import Procedure

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
        axes.add_patch(Circle((0.0, 0.0), 1.0, fill=False, color=GREY, linewidth=0.8))
        axes.axhline(0.0, color=PALE, linewidth=0.6)
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


def outputs_picture(procedure: Procedure) -> Picture:
    """Returns the picture of measured and simulated output (the paper's Fig. 7)."""
    return Picture(
        outputs_figure(procedure.best, procedure.data.dt_s, procedure.data.output_name),
        "Validation part: measured output and free run of the model from its first measured "
        "samples (the paper's Fig. 7); below, what the free run and the one-step prediction "
        "miss.",
        "Two curves of the output over time, and two of the differences below",
    )


def residual_picture(result: IdentificationResult) -> Picture:
    """Returns the picture of the residual tests (the paper's Fig. 8)."""
    return Picture(
        residual_figure(result),
        "One-step residual on the validation part (the paper's Fig. 8): "
        f"{result.whiteness.verdict}; {result.independence.verdict}. Orange: outside the band "
        "of a single lag, as one lag in a hundred is by chance.",
        "Bars of the residual's autocorrelation and of its correlation with the input, lag by "
        "lag, with 99 % bands",
    )


def poles_zeros_blocks(model_roots: PolesZeros) -> list[Block]:
    """Returns the table and the picture of the poles and zeros."""
    rows = [
        *_root_rows("pole", model_roots.poles),
        *_root_rows("zero", model_roots.zeros),
    ]
    at_origin = [
        f"{count} {name}{'s' if count > 1 else ''} at z = 0"
        for count, name in ((model_roots.origin_poles, "pole"), (model_roots.origin_zeros, "zero"))
        if count
    ]
    others = f" Order and delay add {' and '.join(at_origin)}." if at_origin else ""
    return [
        Table(
            "Poles and zeros in the z plane with their standard deviations, to first order in "
            f"those of the parameters.{others}",
            ("root", "z", "deviation, real", "deviation, imaginary", "|z|", "deviation of |z|"),
            rows,
        ),
        Picture(
            poles_zeros_figure(model_roots),
            "Poles (crosses) and zeros (circles) with their regions of 95 %: ellipses, bars on "
            "the real axis. None is drawn where a neighbour is within three deviations, as the "
            "first order does not hold there.",
            "The z plane with the unit circle, crosses and circles with ellipses around them, and "
            "the part around z = 1 enlarged",
        ),
    ]


def _root_rows(name: str, roots: Roots) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for value, spread, of_modulus, reliable in zip(
        roots.values, roots.covariance, roots.modulus_deviation, roots.reliable, strict=True
    ):
        if value.imag < 0.0:
            continue
        real, imaginary = np.sqrt(np.diag(spread))
        rows.append(
            (
                name,
                place(value),
                f"{real:.2g}" if reliable else "not valid",
                "" if value.imag == 0.0 else f"{imaginary:.2g}" if reliable else "not valid",
                f"{abs(value):.5f}",
                f"{of_modulus:.2g}" if reliable else "not valid",
            )
        )
    return rows


def response_blocks(procedure: Procedure, truth: FrequencyResponse | None) -> list[Block]:
    """Returns the Bode diagram of the model, compared with the rig's response if it is known."""
    assert procedure.response is not None
    shown = bode(procedure.response, procedure.input_band, truth)
    beside = "" if truth is None else f" Dots: {truth.source}."
    margins = (
        ""
        if procedure.loop is None or procedure.loop.half is None
        else " Orange: gain and phase margin of a proportional controller with half the gain at "
        "the limit of stability."
    )
    blocks: list[Block] = [
        Picture(
            bode_figure(shown, procedure.data.dt_s, procedure.loop),
            "Frequency response of the model with its 95 % band at each frequency by itself."
            f"{beside} Grey: outside the band with 99 % of the input's power, where the model "
            f"extrapolates.{margins}",
            "Magnitude and phase over frequency, with a shaded band"
            + ("" if truth is None else " and the rig's response as dots"),
        )
    ]
    if truth is not None and procedure.input_band is not None:
        blocks.append(_agreement(procedure, truth, procedure.input_band))
    return blocks


def _agreement(procedure: Procedure, truth: FrequencyResponse, band: tuple[float, float]) -> str:
    everywhere = procedure.against(truth)
    excited = everywhere.within(band)
    unit = "cycles a sample" if procedure.data.dt_s is None else "Hz"
    where = f"Where the input has its power, {band[0]:.3g} to {band[1]:.3g} {unit}"
    if excited.inside.size == 0:
        return f"{where}, the rig's response is not known."
    n, inside = excited.inside.size, int(np.sum(excited.inside))
    text = (
        f"{where}, the rig's response is inside the model's region of 95 % at {inside} of {n} "
        f"frequencies; the differences there are {_differences(excited, unit)}. Over all "
        f"frequencies they are {_differences(everywhere, unit)}."
    )
    if inside < 0.9 * n:
        text += (
            " The region allows for chance alone. What lies beyond is bias: of sensor noise, which "
            "is no equation error, and of a rig that is not linear at the size of the record's "
            "motion."
        )
    if procedure.best.failed_tests:
        text += " As residual tests fail, the region is too rough to be held to."
    return text


def _differences(comparison: Agreement, unit: str) -> str:
    worst = int(np.argmax(np.abs(comparison.magnitude_difference_db)))
    turn = int(np.argmax(np.abs(comparison.phase_difference_deg)))
    return (
        f"{comparison.magnitude_difference_db[worst]:+.2f} dB at most, at "
        f"{comparison.frequency_hz[worst]:.3g} {unit}, and "
        f"{comparison.phase_difference_deg[turn]:+.1f} degrees, at "
        f"{comparison.frequency_hz[turn]:.3g} {unit}; the median ones "
        f"{np.median(np.abs(comparison.magnitude_difference_db)):.2f} dB and "
        f"{np.median(np.abs(comparison.phase_difference_deg)):.2f} degrees"
    )
