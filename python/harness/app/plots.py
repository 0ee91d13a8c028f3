# SPDX-License-Identifier: MIT
"""Plots of signals of any length, whose points follow the range that is seen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from bokeh.layouts import column
from bokeh.models import Column, ColumnDataSource, Legend, LegendItem, Range1d
from bokeh.plotting import figure

from ehsid.harness.app.downsampling import Pyramid
from ehsid.harness.app.look import COLOURS, dress
from ehsid.harness.arrays import FloatArray
from ehsid.harness.text import printable

COLUMNS = 1200  # pixel columns that are filled


@dataclass(frozen=True)
class Line:
    """A signal to draw: its name, its samples, and the factor to the unit that is shown."""

    name: str
    pyramid: Pyramid
    factor: float = 1.0


@dataclass(frozen=True)
class Panel:
    """Lines with one axis, and its label."""

    label: str
    lines: Sequence[Line]


def stacked(panels: Sequence[Panel], time_s: FloatArray | None, theme: str, axis: str) -> Column:
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
    """
    size = max(line.pyramid.values.size for panel in panels for line in panel.lines)
    last = float(size - 1) if time_s is None else float(time_s[-1])
    first = 0.0 if time_s is None else float(time_s[0])
    shared = Range1d(first, max(last, first + 1e-9), bounds="auto")
    plots, updates, colours = [], [], COLOURS[theme]
    told: set[str] = set()
    for number, panel in enumerate(panels):
        bottom = number == len(panels) - 1
        plot = figure(
            height=190 + 30 * bottom,
            sizing_mode="stretch_width",
            x_range=shared,
            tools="xpan,xwheel_zoom,xbox_zoom,reset",
            active_drag="xpan",
            active_scroll="xwheel_zoom",
            toolbar_location="above" if number == 0 else None,
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
            drawn = plot.line("x", "y", source=source, color=colours[i % len(colours)])
            entries.append(LegendItem(label=printable(line.name), renderers=[drawn]))
            updates.append(_update(source, line, time_s))
        names = {line.name for line in panel.lines}
        if len(names) > 1 and not names <= told:  # once for panels with the same lines
            legend = Legend(items=entries, orientation="horizontal", padding=2, margin=2)
            plot.add_layout(legend, "above")
            plot.height += 30
            told |= names
        dress(plot, theme)
        plots.append(plot)
    for update in updates:
        update(first, last)

    waits = False

    def follow() -> None:
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
            shared.document.add_next_tick_callback(follow)

    shared.on_change("start", moved)
    shared.on_change("end", moved)
    # In one layout: Bokeh warns of a range that plots of several layouts share.
    return column(*plots, sizing_mode="stretch_width", spacing=0)


def _update(
    source: ColumnDataSource, line: Line, time_s: FloatArray | None
) -> Callable[[float, float], None]:
    """Returns a function that puts the points between two times into a source."""

    def update(start: float, end: float) -> None:
        if time_s is None:
            first, last = int(np.floor(start)), int(np.ceil(end)) + 1
        else:
            first = int(np.searchsorted(time_s, start)) - 1
            last = int(np.searchsorted(time_s, end)) + 1
        at, values = line.pyramid.view(first, last, COLUMNS)
        x = at if time_s is None else np.asarray(time_s[at.astype(np.int64)])
        source.data = {"x": x, "y": line.factor * values}

    return update
