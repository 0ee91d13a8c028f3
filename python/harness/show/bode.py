# SPDX-License-Identifier: MIT
"""Draws the Bode diagram of an identified model: magnitude, phase, their bands, loop margins."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..models.identification import EstimatedResponse, FrequencyResponse
from ..models.identification.loop import LoopAnalysis
from .plotting import VERMILION, frequency_unit, stacked, styled


@styled
def bode_figure(
    response: EstimatedResponse,
    truth: FrequencyResponse | None,
    dt_s: float | None,
    input_band: tuple[float, float] | None = None,
    loop: LoopAnalysis | None = None,
) -> Figure:
    """Draws magnitude and phase with their 95 % bands, and the response of the rig if it is known.

    Frequencies outside `input_band` are shaded grey. With `loop`, the figure shows gain margin and
    phase margin of the loop with half the limit gain.
    """
    figure, (upper, lower) = stacked(6.0, [1, 1], xlabel=f"frequency in {frequency_unit(dt_s)}")
    f = response.frequency_hz
    for axes, centre, band in (
        (upper, response.magnitude_db, response.magnitude_band_db()),
        (lower, response.phase_deg, response.phase_band_deg()),
    ):
        beyond: str | None = "outside the input's band"
        axes.fill_between(f, band[:, 0], band[:, 1], alpha=0.3, linewidth=0, label="95 % band")
        axes.semilogx(f, centre, label="model", linewidth=1.5)
        axes.grid(which="minor", alpha=0.15)
        if input_band is not None:
            for start, stop in ((f[0], input_band[0]), (input_band[1], f[-1])):
                if start < stop:
                    axes.axvspan(start, stop, color="0.5", alpha=0.12, linewidth=0, label=beyond)
                    beyond = None
    low, high = float(np.min(response.magnitude_db)), float(np.max(response.magnitude_db))
    if truth is not None:
        # The two phases are unwrapped separately, so they can differ by multiples of 360 degrees.
        nearest = int(np.argmin(np.abs(f - truth.frequency_hz[0])))
        turns = np.round((response.phase_deg[nearest] - truth.phase_deg[0]) / 360.0)
        for axes, values in (
            (upper, truth.magnitude_db),
            (lower, truth.phase_deg + 360.0 * turns),
        ):
            axes.semilogx(truth.frequency_hz, values, "k.", markersize=4.0, label=truth.source)
        low = min(low, float(np.min(truth.magnitude_db)))
        high = max(high, float(np.max(truth.magnitude_db)))
    # A band is very wide where the data hardly determine the model; it must not flatten the curves.
    upper.set_ylim(low - 6.0, high + 6.0)
    middle = response.phase_deg
    lower.set_ylim(float(np.min(middle)) - 60.0, float(np.max(middle)) + 60.0)
    if loop is not None:
        _margins(upper, lower, response, loop)
    upper.set_ylabel("magnitude in dB")
    lower.set_ylabel("phase in degrees")
    upper.legend()
    return figure


def _margins(upper: Axes, lower: Axes, response: EstimatedResponse, loop: LoopAnalysis) -> None:
    """Draws both margins of the loop with half the limit gain as arrows.

    They lie between the curves and the lines of 1/k and of -180 degrees of k G.
    """
    half, turnover = loop.half, loop.phase_crossover_hz
    if half is None or turnover is None or loop.limit_gain is None:
        return
    f = np.log(response.frequency_hz)
    arrow = {"arrowstyle": "<->", "color": VERMILION}
    level, lowest = (-20.0 * np.log10(np.abs(k)) for k in (half.gain, loop.limit_gain))
    upper.axhline(level, color=VERMILION, linestyle="--", linewidth=1.0, label="1/k")
    upper.annotate(
        "",
        (turnover, lowest),
        (turnover, level),
        arrowprops=arrow,
    )
    for axes in (upper, lower):
        axes.axvline(turnover, color=VERMILION, linestyle=":", linewidth=1.0)
        if half.gain_crossover_hz is not None:
            axes.axvline(half.gain_crossover_hz, color=VERMILION, linestyle=":", linewidth=1.0)
    # With a negative k, -180 degrees of k G are 0 degrees of G. Multiples of 360 degrees are the
    # same phase; the line is drawn at the one nearest to the curve.
    border = -180.0 if half.gain > 0.0 else 0.0
    at = float(np.interp(np.log(turnover), f, response.phase_deg))
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
