# SPDX-License-Identifier: MIT
"""Plots of signals of any length, whose points follow the range that is seen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from bokeh.layouts import column
from bokeh.models import Column, ColumnDataSource, Legend, LegendItem, Range1d
from bokeh.plotting import figure

from ehsid.harness.base.error_words import printable
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.show.gap_plots import share_cursor
from ehsid.harness.show.plotting import DASHES, ROLES

from .downsampling import Pyramid
from .look import COLOURS, dress

COLUMNS = 1200  # pixel columns that are filled
TALLEST, LOWEST, WINDOW = 280, 105, 470  # in pixels: of a plot, and of all where there is room
TOOLS, SMALL = 30, "11px"  # height of the tools above the first plot; labels where plots are low
WIDE = {"measured": {"line_width": 3.5, "line_alpha": 0.4}}  # what is simulated is drawn over it


@dataclass
class Latest:
    """Stands for the newest pyramid of a signal."""

    now: Pyramid


def _now(signal: Pyramid | Latest) -> Pyramid:
    return signal.now if isinstance(signal, Latest) else signal


@dataclass(frozen=True)
class Line:
    """A signal to draw."""

    name: str
    """In the legend."""
    pyramid: Pyramid | Latest
    """Its samples."""
    factor: float = 1.0
    """To the unit that is shown."""
    band: tuple[Pyramid | Latest, Pyramid | Latest] | None = None
    """Lower and upper end of a band around it, of as many samples; None draws none."""
    role: str = ""
    """Key of `ROLES`, for its colour and its dashes; "" takes those of its place in the panel."""


@dataclass(frozen=True)
class Panel:
    """Lines with one axis, and its label."""

    label: str
    lines: Sequence[Line]


@dataclass(frozen=True)
class Stack:
    """Plots one below the other."""

    layout: Column
    """All of them, to be shown: Bokeh warns of a range that plots of several layouts share."""
    plots: list[figure]
    """Each of them, from top to bottom."""
    draw: Callable[[], None]
    """Draws what is seen anew, after signals have changed."""


def stacked(
    panels: Sequence[Panel],
    time_s: FloatArray | None,
    theme: str,
    axis: str,
    groups: Sequence[int] = (),
) -> Stack:
    """Returns plots one below the other, with one time axis.

    Parameters
    ----------
    panels
        what to draw.
    time_s
        times of the samples; None draws over their numbers.
    theme
        key of `THEMES`.
    axis
        label of the time axis.
    groups
        numbers of panels that are shown together, each group with tools and a time axis of its
        own; none: all of them are.
    """
    size = max(_now(line.pyramid).values.size for panel in panels for line in panel.lines)
    last = float(size - 1) if time_s is None else float(time_s[-1])
    first = 0.0 if time_s is None else float(time_s[0])
    shared = Range1d(first, max(last, first + 1e-9), bounds="auto")
    plots, updates, colours = [], [], COLOURS[theme]
    told: set[str] = set()
    groups = groups or (len(panels),)
    ends = set(np.cumsum(groups) - 1)
    height = min(TALLEST, max(LOWEST, WINDOW // max(groups)))
    for number, panel in enumerate(panels):
        top, bottom = number == 0 or number - 1 in ends, number in ends
        if top:
            told.clear()
        plot = figure(
            height=height + 30 * bottom + TOOLS * top,
            sizing_mode="stretch_width",
            x_range=shared,
            tools="xpan,xwheel_zoom,xbox_zoom,reset",
            active_drag="xpan",
            active_scroll="xwheel_zoom",
            toolbar_location="above" if top else None,
            y_axis_label=printable(panel.label),
            x_axis_label=axis if bottom else None,
            output_backend="canvas",
            min_border_left=70,
        )
        plot.toolbar.logo = None
        plot.xaxis.visible = bottom
        entries = []
        for i, line in enumerate(panel.lines):
            source = ColumnDataSource({"x": [], "y": []})
            colour = ROLES[theme].get(line.role, colours[i % len(colours)])
            if line.band is not None:
                band = ColumnDataSource({"x": [], "low": [], "high": []})
                plot.varea("x", "low", "high", source=band, fill_color=colour, fill_alpha=0.15)
                updates.append(_band_update(band, line.band, line.factor, time_s))
            drawn = plot.line("x", "y", source=source, color=colour, **WIDE.get(line.role, {}))
            drawn.glyph.line_dash = DASHES.get(line.role, "solid")
            entries.append(LegendItem(label=printable(line.name), renderers=[drawn]))
            updates.append(_update(source, line, time_s))
        names = {line.name for line in panel.lines}
        if len(names) > 1 and not names <= told:  # once for panels with the same lines
            legend = Legend(items=entries, orientation="horizontal", padding=2, margin=2)
            plot.add_layout(legend, "above")
            plot.height += 30
            told |= names
        dress(plot, theme)
        if height < WINDOW // 3:
            plot.yaxis.axis_label_text_font_size = SMALL
        plots.append(plot)
    share_cursor(plots)

    waits = False

    def draw() -> None:
        nonlocal waits
        waits = False
        for update in updates:
            update(float(shared.start), float(shared.end))

    def moved(attribute: str, old: object, new: object) -> None:
        """Both ends move one after the other, and a wheel turns often: drawn once for all."""
        nonlocal waits
        del attribute, old, new
        if not waits and shared.document is not None:
            waits = True
            shared.document.add_next_tick_callback(draw)

    draw()
    shared.on_change("start", moved)
    shared.on_change("end", moved)
    return Stack(column(*plots, sizing_mode="stretch_width", spacing=0), plots, draw)


def legend_above(plot: figure) -> None:
    """Puts the legend above a plot, where it hides nothing."""
    (legend,) = plot.legend
    plot.center.remove(legend)
    plot.add_layout(legend, "above")
    legend.orientation = "horizontal"
    legend.border_line_alpha = 0.0
    legend.padding = legend.margin = 0
    legend.location = "left"


def _update(
    source: ColumnDataSource, line: Line, time_s: FloatArray | None
) -> Callable[[float, float], None]:
    """Returns a function that puts the points between two times into a source."""

    def update(start: float, end: float) -> None:
        x, values = _seen(line.pyramid, time_s, start, end)
        source.data = {"x": x, "y": line.factor * values}

    return update


def _band_update(
    source: ColumnDataSource,
    band: tuple[Pyramid | Latest, Pyramid | Latest],
    factor: float,
    time_s: FloatArray | None,
) -> Callable[[float, float], None]:
    """Returns a function that puts the band between two times into a source."""

    def update(start: float, end: float) -> None:
        x, low = _seen(band[0], time_s, start, end)
        _, high = _seen(band[1], time_s, start, end)
        known = np.isfinite(low) & np.isfinite(high)  # an area does not leave out what is missing
        source.data = {"x": x[known], "low": factor * low[known], "high": factor * high[known]}

    return update


def _seen(
    signal: Pyramid | Latest, time_s: FloatArray | None, start: float, end: float
) -> tuple[FloatArray, FloatArray]:
    """Returns places on the time axis and values of the points between two times."""
    if time_s is None:
        first, last = int(np.floor(start)), int(np.ceil(end)) + 1
    else:
        first = int(np.searchsorted(time_s, start)) - 1
        last = int(np.searchsorted(time_s, end)) + 1
    at, values = _now(signal).view(first, last, COLUMNS)
    return at if time_s is None else np.asarray(time_s[at.astype(np.int64)]), values
