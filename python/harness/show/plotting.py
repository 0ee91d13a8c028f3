# SPDX-License-Identifier: MIT
"""What all plots share: colours, style, stacked panels, the time axis, and fewer samples."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.rcsetup import cycler

from ..base.numbers import FloatArray

Dash = Literal["solid", "dotted", "dashed"]

# Readers who cannot tell red from green can tell these colours apart (Okabe, Ito, 2008).
BLUE, ORANGE, GREEN, VERMILION = "#0072b2", "#e69f00", "#009e73", "#d55e00"
PURPLE, SKY, INK, GREY, PALE = "#cc79a7", "#56b4e9", "#1c2126", "#8a949e", "#d9d9d9"
WHITE, YELLOW = "#ffffff", "#f2d58a"
# The command, which is neither measured nor simulated; the frame and the grid of a plot.
COMMAND, FRAME, GRID = "#6b7680", "#d5dae0", "#e9ecef"

# The colour of each role on every page and in the workbench: what was measured, and what the
# simulator gives as configured, with its values fitted, and with what was found.
MEASURED, CONFIGURED, FITTED, FOUND = INK, VERMILION, BLUE, GREEN
# Other models beside one that was fitted; what is configured or found is never drawn with them.
SECOND, THIRD = VERMILION, PURPLE
# By the names that the files have for them, on a light ground and on a dark one.
ROLES = {
    "light": {
        "measured": MEASURED,
        "nominal": CONFIGURED,
        "calibrated": FITTED,
        "augmented": FOUND,
        "second": SECOND,
        "third": THIRD,
    },
    "dark": {
        "measured": "#e6eaee",
        "nominal": "#e07c2d",
        "calibrated": "#4cace2",
        "augmented": "#1fa480",
        "second": "#e07c2d",
        "third": PURPLE,
    },
}
# Lines of the roles differ where no colour is seen, too.
DASHES: dict[str, Dash] = {
    "measured": "solid",
    "nominal": "dotted",
    "calibrated": "dashed",
    "augmented": "solid",
    "second": "dotted",
    "third": "solid",
}

# Decorates a function that makes a figure.
styled = mpl.rc_context(
    {
        "axes.axisbelow": True,
        "axes.grid": True,
        "axes.prop_cycle": cycler(color=[BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY]),
        "axes.titlesize": "medium",
        "figure.constrained_layout.use": True,
        "grid.alpha": 0.3,
        "legend.fontsize": "small",
    }
)

# Points of a curve with its band: more cannot be seen, and each adds to the size of a page.
MOST_DRAWN = 1200
# Samples at the beginning that are always drawn; a logarithmic axis gives them half of its length.
FIRST_DRAWN = np.arange(100, dtype=np.int64)

NONE: npt.NDArray[np.int64] = np.zeros(0, dtype=np.int64)


def stacked(
    height: float, ratios: Sequence[float], *, xlabel: str = "", width: float = 9.0
) -> tuple[Figure, Sequence[Axes]]:
    """Returns a figure and its panels, one under the other with one x axis without margins.

    `height` and `width` are in inches, `ratios` are those of the heights of the panels.
    """
    figure = Figure(figsize=(width, height))
    panels = figure.subplots(
        len(ratios), 1, sharex=True, squeeze=False, height_ratios=list(ratios)
    )[:, 0]
    for axes in panels:
        axes.margins(x=0.0)
    panels[-1].set_xlabel(xlabel)
    return figure, list(panels)


def time_axis(dt_s: float | None, size: int) -> tuple[FloatArray, str]:
    """Returns the times of so many samples and the label of their axis; numbers without dt_s."""
    return (dt_s or 1.0) * np.arange(
        size, dtype=np.float64
    ), "sample" if dt_s is None else "time in s"


def draw_band(
    axes: Axes, x: npt.ArrayLike, curves: npt.ArrayLike, alpha: float = 0.2, **line: Any
) -> str:
    """Draws a curve with a shaded band from its lower to its upper limit; returns the colour.

    `x` has the shape (n,), `curves` (3, n): lower limit, middle and upper limit. Of a long curve
    the samples of `kept_samples` are drawn.
    """
    parts = np.asarray(curves, dtype=np.float64)
    kept = kept_samples(list(parts), MOST_DRAWN, FIRST_DRAWN)
    at, (low, middle, high) = np.asarray(x)[kept], parts[:, kept]
    (drawn,) = axes.plot(at, middle, **line)
    axes.fill_between(at, low, high, color=drawn.get_color(), alpha=alpha, linewidth=0)
    return str(drawn.get_color())


def draw_numbers(axes: Axes, values: FloatArray, texts: Sequence[Sequence[str]]) -> None:
    """Draws a matrix with values of 0 to 1 as shades of blue, with a text in each cell."""
    axes.grid(False)
    axes.imshow(values, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for (row, column), value in np.ndenumerate(values):
        axes.text(
            column,
            row,
            texts[row][column],
            ha="center",
            va="center",
            color="white" if value > 0.5 else "black",
            fontsize="small",
        )


def kept_samples(
    signals: Sequence[npt.NDArray[np.float64]],
    most: int,
    always: npt.NDArray[np.int64] = NONE,
) -> npt.NDArray[np.int64]:
    """Returns indices of the samples to draw: the extremes of each signal in equal stretches.

    Parameters
    ----------
    signals
        signals of one length N over the same time; NaN is ignored if a stretch has other values.
    most
        approximate number of samples to keep; if N is not larger, all samples are kept.
    always
        indices of further samples to keep.

    Returns
    -------
    Increasing indices, with those of the first and the last sample.
    """
    size = signals[0].size
    if size <= most:
        return np.arange(size)
    stretch = -(-size // max(1, most // (2 * len(signals))))
    stretches = -(-size // stretch)
    begins = stretch * np.arange(stretches)
    places = [np.array([0, size - 1]), always]
    for signal in signals:
        for sign in (1.0, -1.0):
            padded = np.full(stretches * stretch, np.inf)
            padded[:size] = np.where(np.isnan(signal), np.inf, sign * signal)
            places.append(begins + np.argmin(padded.reshape(stretches, stretch), axis=1))
    kept = np.unique(np.concatenate(places))
    return np.asarray(kept[kept < size], dtype=np.int64)


def write_figure(path: Path, figure: Figure) -> None:
    """Writes a figure as PNG."""
    figure.savefig(path, dpi=120, format="png")
