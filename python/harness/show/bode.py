# SPDX-License-Identifier: MIT
"""Draws the Bode diagram of an identified model: magnitude, phase, their bands, loop margins."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..models.identification.loop import LoopAnalysis
from .model_curves import Bode
from .plotting import VERMILION, frequency_unit, stacked, styled


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
            axes.axvspan(*stretch, color="0.5", alpha=0.12, linewidth=0, label=beyond)
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
