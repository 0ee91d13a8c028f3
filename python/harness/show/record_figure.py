# SPDX-License-Identifier: MIT
"""Draws the columns of a record over time, and a held-out record beside its simulations."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import groupby
from typing import Any

from matplotlib.figure import Figure

from ..base.error_words import printable
from ..catalogue.channels import CHANNELS, Channel, shown_channel
from ..diagnosis.edits import EditRun
from ..diagnosis.result import HeldOutRun
from ..records import Record
from .gap_plots import curves_of
from .gap_words import SIMULATIONS
from .plotting import BLUE, GREEN, INK, VERMILION, stacked, styled

# Columns that are no channels, as far as a page has room for their panels.
MOST_COLUMNS = 8
# Of simulations, in their order.
COLOURS = (VERMILION, BLUE, GREEN)
STYLES = (":", "--", "-")
# More samples than a line of this width can show.
MOST_SAMPLES = 4000


@styled
def record_figure(record: Record) -> Figure:
    """Draws the channels of a record over time, those of one quantity together.

    A record without any channel has its first columns drawn, under their own names.
    """
    channels = [channel for channel in CHANNELS.values() if channel.name in record.columns]
    if not channels:
        names = list(record.columns)[:MOST_COLUMNS]
        channels = [Channel(name, name, "", printable(name), "its unit") for name in names]
    # Channels with the same unit of SI share a panel, such as the pressures.
    panels = [list(group) for _, group in groupby(channels, key=lambda channel: channel.unit)]
    figure, axes = stacked(
        1.6 * len(panels) + 0.6,
        [1.0] * len(panels),
        xlabel="sample" if record.time_s is None else "time in s",
    )
    time = range(len(record)) if record.time_s is None else record.time_s
    for axis, panel in zip(axes, panels, strict=True):
        for channel in panel:
            column = channel.factor * record.column(channel.name)
            axis.plot(time, column, linewidth=1.0, label=channel.name)
        words = "pressure" if len(panel) > 1 else panel[0].words
        axis.set_ylabel(f"{words} in {panel[0].shown_unit}", parse_math=False)
        if len(panel) > 1:
            axis.legend(ncols=len(panel), loc="upper right")
    axes[0].set_title(printable(record.name), parse_math=False)
    return figure


@styled
def run_figure(run: HeldOutRun | EditRun, simulations: Mapping[str, str] = SIMULATIONS) -> Figure:
    """Draws for each output measured and simulated values, and below them the errors.

    simulations: labels of at most three simulations, by their fields of the run.
    """
    count = len(run.measured)
    figure, panels = stacked(3.2 * count + 0.6, [2.0, 1.0] * count, xlabel="time in s")
    for upper, lower, name in zip(panels[::2], panels[1::2], run.measured, strict=True):
        words, scale, unit = shown_channel(name)
        curves = curves_of(run, name, tuple(simulations), scale=scale, most=MOST_SAMPLES)
        upper.plot(curves["time"], curves["measured"], color=INK, linewidth=3.0, alpha=0.35)
        upper.lines[0].set_label("measured")
        for (kind, label), color, style in zip(simulations.items(), COLOURS, STYLES, strict=False):
            line: dict[str, Any] = {"color": color, "linestyle": style, "linewidth": 1.2}
            upper.plot(curves["time"], curves[kind], label=label, **line)
            lower.plot(curves["time"], curves[f"{kind}_error"], **line)
        upper.set_ylabel(f"{words} in {unit}")
        lower.set_ylabel(f"error in\n{unit}")
    panels[0].legend(ncols=4, loc="upper right")
    title = f"{printable(run.record)}; error: simulated minus measured"
    panels[0].set_title(title, parse_math=False)
    return figure
