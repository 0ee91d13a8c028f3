# SPDX-License-Identifier: MIT
"""The plots of a run that goes on: they are made once, and get new points."""

from __future__ import annotations

import panel as pn
from bokeh.models import Band, ColumnDataSource, Range1d
from bokeh.plotting import figure

from ehsid.harness.catalogue.channels import COMMAND, POSITION
from ehsid.harness.show.gap_plots import share_cursor
from ehsid.harness.show.units import Shown, coefficient, column

from .. import look
from ..look import in_columns
from ..plots import legend_above
from .numbers import DRAWN, Drawn, span

COLUMNS = 400  # pixel columns that are filled
# Plots of signals: label of the axis, and for each line its name, its column and its factor.
SIGNALS = (
    ("position in mm", (("position", "position_m", 1e3), ("reference", "reference_m", 1e3))),
    ("command in V", (("command", "command_v", 1.0),)),
    ("lambda", (("forgetting factor lambda", "forgetting_factor", 1.0),)),
)
FACTOR_RANGE = (0.9, 1.01)  # of lambda, which is seldom less
HEIGHTS = (158, 108, 118)  # of the plots of signals; that of lambda stands among the parameters
SERVO = (
    Shown("K", "mm/s per V", 1e3), Shown("omega_n", "rad/s", 1.0), Shown("xi", "", 1.0),
)  # fmt: skip


class LivePlots:
    """Signals, servo and parameters over the newest samples.

    Attributes
    ----------
    layout
        what is shown.
    """

    def __init__(self, parameters: list[str], *, reference: bool, theme: str) -> None:
        ends = column(POSITION), column(COMMAND)
        self._estimated = [*SERVO, *(coefficient(name, *ends) for name in parameters)]
        self._time = Range1d(0.0, 1.0)
        self._signals = ColumnDataSource({"x": [], **{name: [] for name in DRAWN}})
        self._estimates = ColumnDataSource(self._empty())
        self._factor = Range1d(*FACTOR_RANGE)
        self._ranges = [Range1d(-1.0, 1.0) for _ in self._estimated]
        position, command, factor = (
            self._signal_plot(label, lines if reference else lines[:1], theme, number)
            for number, (label, lines) in enumerate(SIGNALS)
        )
        factor.y_range = self._factor
        estimates = [self._estimate_plot(i, theme) for i in range(len(self._estimated))]
        share_cursor([position, command, factor, *estimates])
        servo, model = estimates[: len(SERVO)], [*estimates[len(SERVO) :], factor]
        self.layout = pn.Column(
            look.drawn(position),
            look.drawn(command),
            look.words("<p><b>The servo</b>, with the 90 % interval of each value</p>"),
            in_columns(*map(look.drawn, servo), least="15rem"),
            look.words(
                "<p><b>Parameters of the estimated model</b> ± their standard deviation</p>"
            ),
            in_columns(*map(look.drawn, model), least="11rem"),
            sizing_mode="stretch_width",
        )

    def _empty(self) -> dict[str, list[float]]:
        names = [f"{kind}{i}" for i in range(len(self._estimated)) for kind in "vlh"]
        return {"x": [], **{name: [] for name in names}}

    def _figure(self, label: str, height: int) -> figure:
        plot = figure(
            height=height,
            sizing_mode="stretch_width",
            x_range=self._time,
            tools="",
            toolbar_location=None,
            y_axis_label=label,
            output_backend="canvas",
            min_border_left=62,
            min_border_right=14,
        )
        plot.yaxis.ticker.desired_num_ticks = 4
        plot.xaxis.ticker.desired_num_ticks = 3 if height < 150 else 6
        return plot

    def _signal_plot(
        self, label: str, lines: tuple[tuple[str, str, float], ...], theme: str, number: int
    ) -> figure:
        plot = self._figure(label, HEIGHTS[number])
        plot.xaxis.visible = number > 0
        for i, (name, key, _) in enumerate(lines):
            legend = {"legend_label": name} if len(lines) > 1 else {}
            colour = look.COLOURS[theme][i]
            plot.line("x", key, source=self._signals, color=colour, line_width=1.5, **legend)
        look.dress(plot, theme)
        if plot.legend:
            legend_above(plot)
        return plot

    def _estimate_plot(self, number: int, theme: str) -> figure:
        plot = self._figure(self._estimated[number].label, 138 if number < len(SERVO) else 118)
        plot.y_range = self._ranges[number]
        colour = look.COLOURS[theme][0]
        plot.add_layout(
            Band(
                base="x",
                lower=f"l{number}",
                upper=f"h{number}",
                source=self._estimates,
                fill_color=colour,
                fill_alpha=0.25,
                line_color=None,
            )
        )
        plot.line("x", f"v{number}", source=self._estimates, color=colour, line_width=1.5)
        look.dress(plot, theme)
        return plot

    def update(self, points: Drawn) -> None:
        """Shows new points; one message to the page for the signals, and one for the parameters."""
        if points.at_s.size == 0:
            return
        factors = {column: factor for _, lines in SIGNALS for _, column, factor in lines}
        self._signals.data = {
            "x": points.time_s,
            **{name: factors[name] * values for name, values in points.signals.items()},
        }
        least = float(points.signals["forgetting_factor"].min())
        self._factor.start = min(FACTOR_RANGE[0], least - 0.02)
        estimates = {"x": points.at_s}
        for i, shown in enumerate(self._estimated):
            courses = (points.values[i], points.low[i], points.high[i])
            values, low, high = (shown.factor * course for course in courses)
            estimates |= {f"v{i}": values, f"l{i}": low, f"h{i}": high}
            bottom, top = span(values)
            self._ranges[i].update(start=bottom, end=top)
        self._estimates.data = estimates
        first, last = float(points.time_s[0]), float(points.at_s[-1])
        self._time.update(start=first, end=max(last, first + 1e-3))
