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


class LivePlots:
    """Signals and parameters over the newest samples.

    Attributes
    ----------
    signals, estimates
        what is shown: the signals, and the parameters.
    """

    def __init__(self, parameters: list[str], *, reference: bool, theme: str) -> None:
        self._parameters = parameters
        self._time = Range1d(0.0, 1.0)
        self._signals = ColumnDataSource({"x": [], **{name: [] for name in DRAWN}})
        self._estimates = ColumnDataSource(self._empty())
        self._factor = Range1d(*FACTOR_RANGE)
        self._ranges = [Range1d(-1.0, 1.0) for _ in parameters]
        signals = [
            self._signal_plot(label, lines if reference else lines[:1], theme, number)
            for number, (label, lines) in enumerate(SIGNALS)
        ]
        estimates = [self._estimate_plot(i, theme) for i in range(len(parameters))]
        share_cursor([*signals, *estimates])
        self.signals = pn.Column(*map(look.drawn, signals), sizing_mode="stretch_width")
        self.estimates = pn.Column(
            look.words(
                "<h2>Parameters of the estimated model</h2><p class='soft'>The band is the "
                "estimate ± its standard deviation.</p>"
            ),
            in_columns(*map(look.drawn, estimates), least="17rem"),
            sizing_mode="stretch_width",
        )

    def _empty(self) -> dict[str, list[float]]:
        names = [f"{kind}{i}" for i in range(len(self._parameters)) for kind in "vlh"]
        return {"x": [], **{name: [] for name in names}}

    def _figure(self, label: str, axis: str | None, height: int) -> figure:
        plot = figure(
            height=height,
            sizing_mode="stretch_width",
            x_range=self._time,
            tools="",
            toolbar_location=None,
            y_axis_label=label,
            x_axis_label=axis,
            output_backend="canvas",
            min_border_left=72,
            min_border_right=14,
        )
        plot.xaxis.visible = axis is not None
        plot.yaxis.ticker.desired_num_ticks = 4
        return plot

    def _signal_plot(
        self, label: str, lines: tuple[tuple[str, str, float], ...], theme: str, number: int
    ) -> figure:
        last = number == len(SIGNALS) - 1
        plot = self._figure(label, "time in s" if last else None, 165 if last else 130)
        if number == 0:
            plot.height = 200
        if last:
            plot.y_range = self._factor
        for i, (name, key, _) in enumerate(lines):
            legend = {"legend_label": name} if len(lines) > 1 else {}
            colour = look.COLOURS[theme][i]
            plot.line("x", key, source=self._signals, color=colour, line_width=1.5, **legend)
        look.dress(plot, theme)
        if plot.legend:
            legend_above(plot)
        return plot

    def _estimate_plot(self, number: int, theme: str) -> figure:
        name = self._parameters[number]
        plot = self._figure(_shown(name).label, "time in s", 170)
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
        for i, name in enumerate(self._parameters):
            factor = _shown(name).factor
            values = factor * points.theta[i], factor * points.low[i], factor * points.high[i]
            estimates |= {f"{kind}{i}": one for kind, one in zip("vlh", values, strict=True)}
            low, high = span(*values)
            self._ranges[i].update(start=low, end=high)
        self._estimates.data = estimates
        first, last = float(points.time_s[0]), float(points.at_s[-1])
        self._time.update(start=first, end=max(last, first + 1e-3))


def _shown(name: str) -> Shown:
    return coefficient(name, column(POSITION), column(COMMAND))
