# SPDX-License-Identifier: MIT
"""Charts of a comparison: zoomable ones for the page, and the same as pictures for the document."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from bokeh.models import ColumnDataSource, HoverTool, Legend, LegendItem, Whisker
from bokeh.plotting import figure
from results import SHOWN_N, Errors, Hold, Results, Times
from tables import case_words, levels, of, shown, sizes

from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.show.page import Picture, Plot
from ehsid.harness.show.plotting import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    stacked,
    styled,
)

# Ours in blue and green, others in the remaining colours.
OURS, OTHERS = (BLUE, GREEN, SKY), (VERMILION, ORANGE, PURPLE, INK, GREY, "#7a5230")
# Rows of the time over n: one line each, in float where there is a choice.
LINES = (
    "Rls, Constant",
    "Rls, FRatio",
    "ArxEstimator::step, FRatio",
    "plain C, UD",
    "plain C, symmetric",
    "Eigen, (K phi') P",
    "Eigen, symmetric rank one",
    "dlib rls",
    "liquid-dsp eqrls_rrrf",
)
FLOOR = 1e-9  # an error of exactly zero on a logarithmic axis


def chosen(results: Results) -> dict[str, list[Times]]:
    """The lines of the time over n."""
    level, found = levels(results)[0], {}
    for text in LINES:
        of_text = [one for one in results.times if one.level == level and one.name.text == text]
        scalars = {one.name.scalar for one in of_text}
        scalar = "float" if "float" in scalars else "double"
        same = [one for one in of_text if one.name.scalar == scalar]
        if same:
            found[shown(same[0].name)] = same
    return found


def colours(ours: Sequence[bool]) -> list[str]:
    """A colour for each line."""
    counts, found = {True: 0, False: 0}, []
    for own in ours:
        palette = OURS if own else OTHERS
        found.append(palette[counts[own] % len(palette)])
        counts[own] += 1
    return found


def blank(height: int, x: str, y: str, **options: object) -> figure:
    """An empty plot in the style of the pages."""
    made = figure(
        height=height,
        sizing_mode="stretch_width",
        x_axis_label=x,
        y_axis_label=y,
        tools="pan,box_zoom,reset,save",
        outline_line_color="#d5dae0",
        output_backend="canvas",
        **options,
    )
    made.toolbar.logo = None
    made.toolbar.autohide = True
    made.grid.grid_line_color = "#e9ecef"
    return made


def lines_plot(
    curves: Sequence[tuple[str, bool, FloatArray, FloatArray]], made: figure, unit: str
) -> Plot:
    """Curves (name, ours, x, y) with a legend whose entries hide them."""
    items = []
    for (name, own, x, y), colour in zip(curves, colours([c[1] for c in curves]), strict=True):
        source = ColumnDataSource({"x": x, "y": y, "name": [name] * len(x)})
        line = made.line("x", "y", source=source, color=colour, line_width=2.5 if own else 1.5)
        dots = made.scatter("x", "y", source=source, color=colour, size=5)
        items.append(LegendItem(label=name, renderers=[line, dots]))
    made.add_tools(HoverTool(tooltips=[("", "@name"), ("", f"@x: @y{{0.000 a}} {unit}")]))
    legend = Legend(items=items, click_policy="hide", label_text_font_size="11px")
    made.add_layout(legend, "right")
    return Plot(made)


def time_curves(results: Results) -> list[tuple[str, bool, FloatArray, FloatArray]]:
    """Shortest times over n."""
    return [
        (
            name,
            times[0].name.ours,
            np.array([float(one.n) for one in times]),
            np.array([one.least for one in times]),
        )
        for name, times in chosen(results).items()
    ]


def error_curves(
    errors: Sequence[Errors], faster: int, factor: float
) -> list[tuple[str, bool, FloatArray, FloatArray]]:
    """Errors over samples; a line ends where a parameter is no number."""
    return [
        (
            one.name.text,
            one.name.ours,
            one.samples[np.isfinite(one.errors)],
            np.maximum(one.errors[np.isfinite(one.errors)], FLOOR),
        )
        for one in errors
        if one.times_faster == faster and one.factor == factor and "step" not in one.name.text
    ]


def time_plot(results: Results) -> Plot:
    """Time of an update over n."""
    made = blank(420, "parameters n", "ns an update", y_axis_type="log")
    return lines_plot(time_curves(results), made, "ns")


def ratio_plot(results: Results, level: str) -> Plot:
    """Ratios at n = 6 with their quartiles."""
    rows = sorted(of(results, level, SHOWN_N), key=lambda one: -float(one.ratios()[1]))
    names = [shown(one.name) for one in rows]
    quartiles = np.array([one.ratios() for one in rows])
    source = ColumnDataSource(
        {
            "name": names,
            "low": quartiles[:, 0],
            "ratio": quartiles[:, 1],
            "high": quartiles[:, 2],
            "colour": [BLUE if one.name.ours else VERMILION for one in rows],
        }
    )
    made = blank(
        60 + 20 * len(rows), f"ratio to the bare UD recursion, -O{level}", "", y_range=names
    )
    made.hbar(y="name", right="ratio", height=0.7, color="colour", source=source)
    made.add_layout(
        Whisker(
            base="name",
            lower="low",
            upper="high",
            source=source,
            dimension="width",
            level="overlay",
        )
    )
    made.add_tools(
        HoverTool(tooltips=[("", "@name"), ("ratio", "@ratio{0.00} (@low{0.00} to @high{0.00})")])
    )
    return Plot(made)


def error_plot(results: Results, faster: int, factor: float) -> Plot:
    """Errors in float over the samples."""
    made = blank(
        380, "samples", f"error, {case_words(faster, factor)}", x_axis_type="log", y_axis_type="log"
    )
    return lines_plot(error_curves(results.errors, faster, factor), made, "")


def survived(hold: Hold) -> tuple[float, bool]:
    """Samples until a parameter moved (median), and whether it did."""
    values = sorted(hold.held if value is None else value for value in hold.moved)
    return float(values[len(values) // 2]), any(value is not None for value in hold.moved)


def hold_plot(results: Results) -> Plot:
    """Samples survived."""
    names = [shown(one.name) for one in results.holds][::-1]
    values = [survived(one)[0] for one in results.holds][::-1]
    colour = [BLUE if one.name.ours else VERMILION for one in results.holds][::-1]
    made = blank(
        60 + 18 * len(names),
        "held samples until a parameter has moved by 1 %",
        "",
        y_range=names,
        x_axis_type="log",
    )
    source = ColumnDataSource({"name": names, "held": values, "colour": colour})
    made.hbar(y="name", left=1.0, right="held", height=0.7, color="colour", source=source)
    made.add_tools(HoverTool(tooltips=[("", "@name"), ("samples", "@held{0,0}")]))
    return Plot(made)


@styled
def time_picture(results: Results) -> Picture:
    """Time over n as a picture."""
    drawn, (axes,) = stacked(4.2, [1.0], xlabel="parameters n")
    draw_lines(axes, time_curves(results))
    axes.set_yscale("log")
    axes.set_ylabel("ns an update")
    axes.set_xticks(sizes(results))
    return Picture(
        drawn,
        f"Shortest time of an update at -O{levels(results)[0]}.",
        "time of an update over the number of parameters",
    )


@styled
def error_picture(results: Results, faster: int, factor: float) -> Picture:
    """Errors over samples as a picture."""
    drawn, (axes,) = stacked(3.8, [1.0], xlabel="samples")
    draw_lines(axes, error_curves(results.errors, faster, factor))
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylabel(f"error, {case_words(faster, factor)}")
    return Picture(
        drawn,
        f"Errors in float against batch least squares in double: {case_words(faster, factor)}.",
        f"errors in float, {case_words(faster, factor)}",
    )


def draw_lines(axes: object, curves: Sequence[tuple[str, bool, FloatArray, FloatArray]]) -> None:
    """Curves with a legend beside them."""
    for (name, own, x, y), colour in zip(curves, colours([c[1] for c in curves]), strict=True):
        axes.plot(x, y, label=name, color=colour, linewidth=2.2 if own else 1.2, marker=".")  # type: ignore[attr-defined]
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))  # type: ignore[attr-defined]
