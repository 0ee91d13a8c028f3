# SPDX-License-Identifier: MIT
"""Plots of a recursive estimation over the time of its record, which follow new estimates."""

from __future__ import annotations

from bokeh.models import Column, ColumnDataSource, Range1d
from bokeh.plotting import figure

from ehsid.harness.show.units import Shown, coefficient, column

from .look import THEMES
from .model_look import FACTOR, INNOVATION, INPUT, OUTPUT, EstimateLook, high, low
from .plots import Latest, Line, Panel, stacked

SMALL, LARGE, AXIS = 150, 230, 30  # heights in pixels
MARGIN = 0.3  # of the range of the coefficients, above and below
INNOVATIONS = 6.0  # times the RMSE, that the plot holds


class EstimatePlots:
    """The plots; `fits` tells whether they can show an estimate, and `show` shows it."""

    def __init__(self, look: EstimateLook, theme: str) -> None:
        self._signals = {key: Latest(pyramid) for key, pyramid in look.signals.items()}
        self._of = _identity(look)
        names, (output, source) = look.figures.names, _ends(look)
        # Coefficients of one unit share an axis.
        self._groups = [
            group
            for letter in ("a", "b", "o")
            if (group := [name for name in names if name.startswith(letter)])
        ]
        coefficients = [
            Panel(
                _label(group, output, source),
                [self._banded(name, output, source) for name in group],
            )
            for group in self._groups
        ]
        innovation = f"innovation in {output.unit}" if output.unit else "innovation"
        panels = [
            Panel(source.label, [Line(source.words, self._signals[INPUT], source.factor)]),
            Panel(output.label, [Line(output.words, self._signals[OUTPUT], output.factor)]),
            *coefficients,
            Panel("lambda", [Line("lambda", self._signals[FACTOR])]),
            Panel(innovation, [Line(innovation, self._signals[INNOVATION], output.factor)]),
        ]
        self._stack = stacked(panels, look.time_s, theme, "time in s")
        self._resets = ColumnDataSource({"x": []})
        for number, plot in enumerate(self.plots):
            of_coefficients = 2 <= number < 2 + len(self._groups)
            bottom = number == len(panels) - 1
            plot.height = (LARGE if of_coefficients else SMALL) + AXIS * bottom
            if of_coefficients:
                plot.y_range = Range1d()
                plot.vspan(
                    "x", source=self._resets, line_color=THEMES[theme]["bad"], line_dash="dashed"
                )
        self._output_factor = output.factor
        self.plots[-1].y_range = Range1d()
        self.show(look)

    @property
    def layout(self) -> Column:
        """All plots, to be shown."""
        return self._stack.layout

    @property
    def plots(self) -> list[figure]:
        """The plots from top to bottom."""
        return self._stack.plots

    def _banded(self, name: str, above: Shown, below: Shown) -> Line:
        band = (self._signals[low(name)], self._signals[high(name)])
        return Line(name, self._signals[name], coefficient(name, above, below).factor, band)

    def fits(self, look: EstimateLook) -> bool:
        """Whether these plots can show an estimate: of this record, with these coefficients."""
        return _identity(look) == self._of

    def show(self, look: EstimateLook) -> None:
        """Shows an estimate; the range of time that is seen stays."""
        for key, signal in self._signals.items():
            signal.now = look.signals[key]
        figures = look.figures
        ends = _ends(look)
        ranges = dict(zip(figures.names, figures.ranges, strict=True))
        for plot, group in zip(self.plots[2:], self._groups, strict=False):
            factors = [coefficient(name, *ends).factor for name in group]
            lowest = min(f * ranges[name][0] for f, name in zip(factors, group, strict=True))
            highest = max(f * ranges[name][1] for f, name in zip(factors, group, strict=True))
            margin = MARGIN * (highest - lowest) + 1e-12
            plot.y_range.update(start=lowest - margin, end=highest + margin)
        reach = INNOVATIONS * self._output_factor * figures.rmse + 1e-12
        self.plots[-1].y_range.update(start=-reach, end=reach)
        self._resets.data = {"x": [float(look.time_s[one]) for one in figures.reset_samples]}
        self._stack.draw()


def _ends(look: EstimateLook) -> tuple[Shown, Shown]:
    return column(look.figures.output_name), column(look.figures.input_name)


def _identity(look: EstimateLook) -> object:
    figures = look.figures
    ends = (figures.input_name, figures.output_name)
    return figures.record, ends, figures.names, look.time_s.size


def _label(group: list[str], above: Shown, below: Shown) -> str:
    unit = coefficient(group[0], above, below).unit
    words = "offset" if group[0].startswith("o") else group[0][0]
    return f"{words} in {unit}" if unit else words
