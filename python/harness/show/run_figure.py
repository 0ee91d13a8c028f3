# SPDX-License-Identifier: MIT
"""Draws a held-out record beside its simulations as a still picture."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from ..base.text import printable
from ..catalogue.channels import shown_channel
from ..diagnosis.result import HeldOutRun
from .gap_curves import curves_of
from .gap_words import SIMULATIONS
from .plotting import BLUE, GREEN, INK, VERMILION, stacked, styled

COLOURS = {"nominal": VERMILION, "calibrated": BLUE, "augmented": GREEN}
STYLES = {"nominal": ":", "calibrated": "--", "augmented": "-"}
# More samples than a line of this width can show.
MOST_SAMPLES = 4000


@styled
def run_figure(run: HeldOutRun) -> Figure:
    """Draws for each output measured and simulated values, and below them the errors."""
    count = len(run.measured)
    figure, panels = stacked(3.2 * count + 0.6, [2.0, 1.0] * count, xlabel="time in s")
    for upper, lower, name in zip(panels[::2], panels[1::2], run.measured, strict=True):
        words, scale, unit = shown_channel(name)
        curves = curves_of(run, name, tuple(SIMULATIONS), scale=scale, most=MOST_SAMPLES)
        upper.plot(curves["time"], curves["measured"], color=INK, linewidth=3.0, alpha=0.35)
        upper.lines[0].set_label("measured")
        for kind, label in SIMULATIONS.items():
            line: dict[str, Any] = {
                "color": COLOURS[kind],
                "linestyle": STYLES[kind],
                "linewidth": 1.2,
            }
            upper.plot(curves["time"], curves[kind], label=label, **line)
            lower.plot(curves["time"], curves[f"{kind}_error"], **line)
        upper.set_ylabel(f"{words} in {unit}")
        lower.set_ylabel(f"error in\n{unit}")
    panels[0].legend(ncols=4, loc="upper right")
    title = f"{printable(run.record)}; error: simulated minus measured"
    panels[0].set_title(title, parse_math=False)
    return figure
