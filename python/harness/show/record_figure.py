# SPDX-License-Identifier: MIT
"""Draws the columns of a record over time."""

from __future__ import annotations

from itertools import groupby

from matplotlib.figure import Figure

from ..base.text import printable
from ..catalogue.channels import CHANNELS, Channel
from ..records import Record
from .plotting import stacked, styled

# Columns that are no channels, as far as a page has room for their panels.
MOST_COLUMNS = 8


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
