# SPDX-License-Identifier: MIT
"""Plots of a run beside another one, whose lines change in place."""

from __future__ import annotations

from dataclasses import dataclass

from bokeh.models import ColumnDataSource, DataRange1d, Range1d
from bokeh.plotting import figure

from ehsid.harness.base.arrays import FloatArray
from ehsid.harness.catalogue.channels import CHANNELS

from .downsampling import make_pyramid
from .look import COLOURS, dress
from .playground import DURATION_S, Beside

# Signals that are drawn, as far as the plant has them, with the label of their axis.
SIGNALS = {
    "position_m": "position",
    "velocity_m_s": "speed",
    "pressure_a_pa": "pressure A",
    "pressure_b_pa": "pressure B",
}
COLUMNS = 700  # pixel columns that are filled
HEIGHT = 138


@dataclass(frozen=True, eq=False)
class PlaygroundPlots:
    """Plots one below the other, and the sources of their lines by signal and run."""

    plots: list[figure]
    sources: dict[tuple[str, str], ColumnDataSource]

    def show(self, runs: Beside) -> None:
        """Shows two runs, and the difference of their positions."""
        for (name, kind), source in self.sources.items():
            record = runs.without if kind == "without" else runs.having
            values = CHANNELS[name].factor * record.column(name)
            if kind == "difference":
                values = values - CHANNELS[name].factor * runs.without.column(name)
            assert record.time_s is not None
            source.data = _points(record.time_s, values)


def make_plots(names: list[str], theme: str) -> PlaygroundPlots:
    """Returns empty plots of these signals, and of the difference of the positions.

    Parameters
    ----------
    names
        columns that the plant has.
    theme
        key of `look.THEMES`.
    """
    shared = Range1d(0.0, DURATION_S, bounds="auto")
    shown = [name for name in SIGNALS if name in names]
    plots, sources = [], {}
    for number, name in enumerate(shown):
        label = f"{SIGNALS[name]} in {CHANNELS[name].shown_unit}"
        plot = _figure(label, shared, "above" if number == 0 else None)
        # The run without effects lies below, wider, so that both are seen where they agree.
        for kind, words, place, width in (
            ("without", "without", 0, 3.0),
            ("having", "with effects", 1, 1.3),
        ):
            source = sources[name, kind] = ColumnDataSource({"x": [], "y": []})
            legend = {"legend_label": words} if number == 0 else {}
            plot.line(
                "x", "y", source=source, color=COLOURS[theme][place], line_width=width, **legend
            )
        plots.append(plot)
    unit = CHANNELS[shown[0]].shown_unit
    last = _figure(f"difference in {unit}", shared, None)
    last.height += 40
    last.xaxis.visible = True
    last.xaxis.axis_label = "time in s"
    source = sources[shown[0], "difference"] = ColumnDataSource({"x": [], "y": []})
    last.line("x", "y", source=source, color=COLOURS[theme][1], line_width=1.3)
    plots.append(last)
    for plot in plots:
        dress(plot, theme)
        if plot.legend:
            plot.legend.orientation = "horizontal"
            plot.legend.border_line_color = None
            plot.add_layout(plot.legend[0], "above")
            plot.height += 30
    return PlaygroundPlots(plots, sources)


def _figure(label: str, shared: Range1d, toolbar: str | None) -> figure:
    plot = figure(
        height=HEIGHT,
        sizing_mode="stretch_width",
        x_range=shared,
        y_range=DataRange1d(range_padding=0.12),
        tools="xpan,xwheel_zoom,xbox_zoom,reset",
        active_drag="xpan",
        active_scroll=None,
        toolbar_location=toolbar,
        y_axis_label=label,
        output_backend="canvas",
        min_border_left=75,
    )
    plot.toolbar.logo = None
    plot.xaxis.visible = False
    return plot


def _points(time_s: FloatArray, values: FloatArray) -> dict[str, FloatArray]:
    at, shown = make_pyramid(values).view(0, values.size, COLUMNS)
    return {"x": at * (time_s[1] - time_s[0]), "y": shown}
