# SPDX-License-Identifier: MIT
"""Figures of a comparison of several contenders."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from ehsid.harness.show.plotting import (
    FIRST_DRAWN,
    GREY,
    MOST_DRAWN,
    draw_band,
    kept_samples,
    stacked,
    styled,
)

from .. import Outcome


def _widths(n: int) -> list[float]:
    """Returns line widths from thick to thin, so that a curve under a later one stays visible."""
    return [float(width) for width in np.linspace(3.0, 1.0, n)]


@styled
def error_figure(outcomes: Mapping[str, Outcome], dt_s: float) -> Figure:
    """Draws the parameter error over time, and below the forgetting factor of the first run.

    The error is shown in percent, as the median and the range from 5 to 95 % of the runs.
    """
    figure, (upper, lower) = stacked(6.0, [3, 1], xlabel="time in s")
    widths = _widths(len(outcomes))
    lowest = np.inf
    for (name, outcome), width in zip(outcomes.items(), widths, strict=True):
        time = np.arange(outcome.error.shape[1]) * dt_s
        curves = 100.0 * np.quantile(outcome.error, [0.05, 0.5, 0.95], axis=0)
        colour = draw_band(upper, time, curves, 0.12, label=name, linewidth=width)
        factor = np.asarray(outcome.forgetting_factor, dtype=np.float64)
        kept = kept_samples([factor], MOST_DRAWN, FIRST_DRAWN)
        lower.plot(time[kept], factor[kept], color=colour, linewidth=width)
        lowest = min(lowest, float(curves[0].min()))
    upper.set_yscale("log")
    # In the first dozen equations the error is many times the parameters. It is not shown.
    upper.set_ylim(0.8 * lowest, 200.0)
    upper.set_ylabel("parameter error in %")
    upper.legend()
    lower.set_ylabel("lambda")
    return figure


@styled
def change_figure(
    pairs: Mapping[str, tuple[Outcome, Outcome]], dt_s: float, change: int, window: slice
) -> Figure:
    """Draws the parameter error around a change of the plant, as the median of the runs.

    Dashed curves are without the reset, solid curves with it. The argument `pairs` contains
    (without, with) by name, `change` is the sample of the change, `window` the samples shown.
    """
    figure, (axes,) = stacked(4.5, [1], xlabel="time in s")
    widths = _widths(len(pairs))
    for number, (name, (without, with_reset)) in enumerate(pairs.items()):
        for outcome, style, label in (
            (with_reset, "-", f"{name}, with reset"),
            (without, "--", f"{name}, without"),
        ):
            time = np.arange(outcome.error.shape[1]) * dt_s
            median = 100.0 * np.median(outcome.error, axis=0)
            axes.semilogy(
                time[window],
                median[window],
                style,
                color=f"C{number}",
                label=label,
                linewidth=widths[number],
            )
    axes.axvline(change * dt_s, color=GREY, linewidth=0.8)
    axes.set_ylabel("parameter error in %")
    axes.legend(ncols=2)
    return figure
