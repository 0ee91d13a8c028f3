# SPDX-License-Identifier: MIT
"""Plots of an identified model and of a recursive estimation."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from bokeh.models import (
    AdaptiveTicker,
    BasicTickFormatter,
    BoxAnnotation,
    Column,
    ColumnDataSource,
    Range1d,
    Span,
    WheelZoomTool,
)
from bokeh.plotting import figure

from ehsid.harness.catalogue.channels import TIME
from ehsid.harness.models.identification.candidates import DIVERGES
from ehsid.harness.models.identification.dynamics import Root
from ehsid.harness.show.gap_plots import share_cursor
from ehsid.harness.show.model_figures import Lags
from ehsid.harness.show.plotting import DASHES, ROLES
from ehsid.harness.show.units import Shown, coefficient, column

from .downsampling import opened
from .look import COLOURS, THEMES, dress
from .model_look import (
    ERROR,
    FACTOR,
    INNOVATION,
    INPUT,
    MEASURED,
    OUTPUT,
    RESIDUAL,
    SIMULATED,
    EstimateLook,
    Identified,
    high,
    key_of,
    low,
)
from .plots import Latest, Line, Panel, legend_above, stacked

# Of the newest model and of those beside it, in the order in which they are drawn.
MODEL_ROLES = ("calibrated", "second", "third")
HEIGHT, CIRCLE, BESIDE = 300, 260, 95  # in pixels; beside the circle: axis and tools
FARTHEST = 2.0  # from z = 0, that the plot of poles and zeros reaches
MARGIN = 0.3  # of the range of the coefficients, above and below
INNOVATIONS = 6.0  # times the RMSE, that the plot holds


@dataclass(frozen=True)
class DrawnModel:
    """A model that is drawn, the newest one or one beside it, with its colour in all plots."""

    model: Identified
    place: int
    """Among the models that are kept; 0 is the newest one."""
    role: str
    """Key of `ROLES`."""

    @property
    def name(self) -> str:
        """In legends."""
        return f"model {self.model.number}"


def drawn_models(models: Sequence[Identified], beside: Collection[int]) -> list[DrawnModel]:
    """Returns the newest model, and those of these numbers that can be drawn with it."""
    found = [
        (place, one)
        for place, one in enumerate(models)
        if place == 0 or (one.number in beside and one.same_time(models[0]))
    ]
    return [
        DrawnModel(one, place, role) for (place, one), role in zip(found, MODEL_ROLES, strict=False)
    ]


def simulation_plots(models: Sequence[DrawnModel], folder: Path, theme: str) -> Column:
    """Returns measured and simulated output over time, and how far a simulation is away.

    Of a single model the residual of its one-step prediction takes the place of the latter.
    """
    output = column(models[0].model.output_name)

    def lines(signal: str) -> list[Line]:
        return [
            Line(
                signal if len(models) == 1 else one.name,
                opened(folder, key_of(signal, one.place)),
                output.factor,
                role="" if signal == RESIDUAL else one.role,  # dashes would hide what is so dense
            )
            for one in models
            if len(models) == 1 or one.model.here not in ("", DIVERGES)
        ]

    below = RESIDUAL if len(models) == 1 else ERROR
    label = "residual" if len(models) == 1 else "measured less simulated"
    unit = f" in {output.unit}" if output.unit else ""
    measured = Line(MEASURED, opened(folder, MEASURED), output.factor, role=MEASURED)
    panels = [
        Panel(output.label, [measured, *lines(SIMULATED)]),
        Panel(label + unit, lines(below)),
    ]
    time_s = np.load(folder / f"{TIME}.npy", mmap_mode="r")
    return stacked(panels, time_s, theme, "time in s, on the half that was not fitted").layout


def poles_plot(models: Sequence[DrawnModel], theme: str) -> figure:
    """Returns poles and zeros of models in the z plane with the unit circle."""
    ink = THEMES[theme]
    roots = [tuple(map(_places, (m.model.dynamics.poles, m.model.dynamics.zeros))) for m in models]
    places = np.concatenate([one for pair in roots for one in pair])
    # A zero far away, which delays make, must not shrink the circle to a point.
    reach = min(max([1.25, *(1.15 * np.abs(places))]), FARTHEST)
    plot = figure(
        width=CIRCLE + BESIDE,
        height=CIRCLE + BESIDE,
        frame_width=CIRCLE,  # of one size both ways, so that the circle is round
        frame_height=CIRCLE,
        x_range=Range1d(-reach, reach),
        y_range=Range1d(-reach, reach),
        tools="pan,box_zoom,reset,hover",
        tooltips=[("place", "@x{0.0000} @y{+0.0000} j"), ("modulus", "@modulus{0.00000}")],
        x_axis_label="real part of z",
        y_axis_label="imaginary part of z",
    )
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    plot.line(np.cos(angle), np.sin(angle), color=ink["soft"])
    for dimension in ("width", "height"):
        plot.add_layout(Span(location=0.0, dimension=dimension, line_color=ink["line"]))
    for one, pair in zip(models, roots, strict=True):
        for at, words, marker in zip(pair, ("poles", "zeros"), ("x", "circle"), strict=True):
            # Several models are known by their colours, which the legend tells of their poles.
            told = words if len(models) == 1 else one.name if marker == "x" else ""
            if at.size:
                plot.scatter(
                    "x", "y", marker=marker, size=12, line_width=2.5, fill_alpha=0.0,
                    line_color=ROLES[theme][one.role], **({"legend_label": told} if told else {}),
                    source={"x": at.real, "y": at.imag, "modulus": np.abs(at)},
                )  # fmt: skip
    beyond = np.sum(np.maximum(np.abs(places.real), np.abs(places.imag)) > reach)
    if beyond:
        where = ": see the table" if len(models) == 1 else ""  # which has the newest model only
        plot.title.text = f"{beyond} outside of the plot{where}"
    return _finished(plot, theme)


def _places(roots: Sequence[Root]) -> npt.NDArray[np.complex128]:
    """Returns where the roots are; a pair is given by its upper one."""
    upper = np.array([complex(one.real, one.imag) for one in roots], dtype=np.complex128)
    return np.concatenate((upper, upper[upper.imag > 0.0].conj()))


def correlation_plot(test: Lags, label: str, theme: str) -> figure:
    """Returns the correlation of a residual test lag by lag, with the band of a single lag."""
    colours = COLOURS[theme]
    largest = max(3.0 * test.band, 1.15 * max(map(abs, test.values)))
    lowest = -max(1.5 * test.band, -1.15 * min(test.values))
    plot = figure(
        height=HEIGHT - 110,
        sizing_mode="stretch_width",
        y_range=Range1d(lowest, largest),
        tools="reset",
        toolbar_location=None,
        x_axis_label="lag in samples",
        y_axis_label=label,
    )
    plot.add_layout(
        BoxAnnotation(
            bottom=-test.band, top=test.band, fill_color=colours[0], fill_alpha=0.15, line_alpha=0.0
        )
    )
    plot.add_layout(Span(location=0.0, dimension="width", line_color=THEMES[theme]["soft"]))
    lags, values, outside = np.array(test.lags), np.array(test.values), test.outside
    for which, words, colour in (
        (~outside, "inside the 99 % band", colours[0]),
        (outside, "outside", colours[1]),
    ):
        if which.any():
            at, high = lags[which], values[which]
            plot.segment(at, 0.0, at, high, line_width=4, color=colour, legend_label=words)
    return _finished(plot, theme)


def bode_plots(models: Sequence[DrawnModel], gain_unit: str, theme: str) -> list[figure]:
    """Returns magnitude and phase over the frequency in Hz; grey is what the input did not excite.

    Parameters
    ----------
    models
        the newest one, whose input tells what is grey, and others, which are only drawn if they
        have its input and output.
    gain_unit
        unit of the magnitude 1, which is 0 dB; "" where it is not known.
    theme
        key of `THEMES`.
    """
    newest = models[0].model
    bode, f = newest.bode, newest.bode.frequency
    drawn = [one for one in models if one.model.same_signals(newest)]
    shared = Range1d(f[0], f[-1], bounds=(f[0], f[-1]))
    reference = f" re 1 {gain_unit}" if gain_unit else ""
    plots = []
    for number, curve in enumerate(bode.curves):
        plot = figure(
            height=HEIGHT - 70 + (40 if number else 30 * (len(models) > 1)),
            sizing_mode="stretch_width",
            x_axis_type="log",
            x_range=shared,
            y_range=Range1d(
                min(one.model.bode.curves[number].ends[0] for one in drawn),
                max(one.model.bode.curves[number].ends[1] for one in drawn),
            ),
            tools="xpan,reset",
            toolbar_location=None if number else "above",
            y_axis_label=curve.label if number else curve.label + reference,
            x_axis_label="frequency in Hz" if number else None,
            min_border_left=70,
        )
        plot.add_tools(WheelZoomTool(dimensions="width"))
        plot.xaxis.formatter = BasicTickFormatter()
        plot.xaxis.visible = number == 1
        if number == 1:
            plot.yaxis.ticker = AdaptiveTicker(mantissas=[1.8, 4.5, 9.0])
        for left, right in bode.not_excited:
            grey = BoxAnnotation(left=left, right=right, fill_alpha=0.18, line_alpha=0.0)
            grey.fill_color = THEMES[theme]["soft"]
            plot.add_layout(grey)
        for one in drawn:
            of, colour = one.model.bode, ROLES[theme][one.role]
            here, alpha = of.curves[number], 0.25 if len(drawn) == 1 else 0.15
            plot.varea(of.frequency, here.low, here.high, fill_color=colour, fill_alpha=alpha)
            told: dict[str, Any] = {}
            if len(models) > 1:
                told["line_dash"] = DASHES[one.role]
                if number == 0:
                    told["legend_label"] = one.name
            plot.line(of.frequency, here.middle, color=colour, line_width=2, **told)
        plots.append(_finished(plot, theme))
    share_cursor(plots)
    return plots


def _finished(plot: figure, theme: str) -> figure:
    plot.toolbar.logo = None
    if plot.legend:
        legend_above(plot)
    plot.title.text_color = THEMES[theme]["soft"]
    plot.title.text_font_style = "normal"
    dress(plot, theme)
    return plot


class EstimatePlots:
    """The plots; `fits` tells whether they can show an estimate, and `show` shows it.

    Attributes
    ----------
    groups
        names of the groups that are shown one at a time, with their numbers of plots.
    """

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
            *coefficients,
            Panel(source.label, [Line(source.words, self._signals[INPUT], source.factor)]),
            Panel(output.label, [Line(output.words, self._signals[OUTPUT], output.factor)]),
            Panel("lambda", [Line("lambda", self._signals[FACTOR])]),
            Panel(innovation, [Line(innovation, self._signals[INNOVATION], output.factor)]),
        ]
        sizes = (len(coefficients), len(panels) - len(coefficients))
        self.groups = dict(zip(("Coefficients", "Signals"), sizes, strict=True))
        self._stack = stacked(panels, look.time_s, theme, "time in s", sizes)
        self._resets = ColumnDataSource({"x": []})
        for plot in self.plots[: len(coefficients)]:
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

    def choose(self, name: str) -> None:
        """Shows the plots of one of the groups."""
        last = len(self._groups)
        for number, plot in enumerate(self.plots):
            plot.visible = (name == next(iter(self.groups))) == (number < last)

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
        for plot, group in zip(self.plots, self._groups, strict=False):
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
