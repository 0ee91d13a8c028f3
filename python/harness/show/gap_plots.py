# SPDX-License-Identifier: MIT
"""Draws zoomable plots of a diagnosis: measured and simulated outputs, errors, the next command.

Bokeh draws the plots in the browser of the reader; the page contains the library and the samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from bokeh.core.enums import LineDashType
from bokeh.models import (
    BoxZoomTool,
    ColumnDataSource,
    HoverTool,
    Legend,
    LegendItem,
    PanTool,
    Range1d,
    ResetTool,
    SaveTool,
    WheelZoomTool,
)
from bokeh.plotting import figure

from ..base.arrays import FloatArray
from ..catalogue.channels import shown_channel
from ..diagnosis.result import HeldOutRun
from ..records import Record
from .gap_curves import curves_of
from .gap_words import SIMULATIONS, first_upper
from .page import Block, Folded, Heading, Plot
from .plotting import BLUE, GREEN, INK, VERMILION, kept_samples

COLOURS = {"measured": INK, "nominal": VERMILION, "calibrated": BLUE, "augmented": GREEN}
DASHES: dict[str, LineDashType] = {
    "measured": "solid",
    "nominal": "dotted",
    "calibrated": "dashed",
    "augmented": "solid",
}
SIMULATED = tuple(SIMULATIONS)
# Limit for the samples of all plots together. With the library (1.3 MB) a page stays below 6 MB.
MOST_BYTES = 3_000_000
# Size of a float32 number in base64.
BYTES_A_VALUE = 4 * 4 / 3
# The columns are the time, the measured output, three simulations and three errors.
COLUMNS_A_PLOT = 8
LEAST_SAMPLES = 400


def run_blocks(runs: Sequence[HeldOutRun], kinds: Sequence[str] = SIMULATED) -> list[Folded]:
    """Returns plots of held-out runs with these kinds of simulation; the first is unfolded."""
    parts = max(1, sum(len(run.measured) for run in runs))
    most = max(LEAST_SAMPLES, int(MOST_BYTES / (BYTES_A_VALUE * COLUMNS_A_PLOT * parts)))
    return [
        Folded(run.record, _plots_of(run, kinds, most), unfolded=i == 0)
        for i, run in enumerate(runs)
    ]


def _plots_of(run: HeldOutRun, kinds: Sequence[str], most: int) -> list[Block]:
    span = _span(run.time_s)
    blocks: list[Block] = [Plot(_command_figure(run.time_s, run.command_v, span, most))]
    for name in run.measured:
        words = first_upper(shown_channel(name)[0])
        blocks.append(Heading(f"{words}: signals, and simulated minus measured"))
        blocks += map(Plot, _output_figures(run, name, kinds, span, most))
    return blocks


def _span(time_s: FloatArray) -> Range1d:
    """Returns the time axis in s that all plots of a record share."""
    start, end = float(time_s[0]), float(time_s[-1])
    return Range1d(start, end, bounds=(start, end))


def _blank(span: Range1d, words: str, unit: str, *, height: int, label_time: bool) -> figure:
    made = figure(
        height=height,
        sizing_mode="stretch_width",
        x_range=span,
        tools=[
            PanTool(dimensions="width"),
            BoxZoomTool(),
            WheelZoomTool(dimensions="width"),
            ResetTool(),
            SaveTool(),
        ],
        toolbar_location="right",
        x_axis_label="time in s" if label_time else None,
        y_axis_label=f"{words} in {unit}" if unit else words,
        min_border_left=64,
        min_border_right=8,
        outline_line_color="#d5dae0",
        output_backend="canvas",
    )
    made.toolbar.logo = None
    made.toolbar.autohide = True
    quiet_axes(made)
    return made


def quiet_axes(made: figure) -> None:
    """Sets grid and axes of a plot of a page in the style of all of them."""
    made.grid.grid_line_color = "#e9ecef"
    for axis in made.axis:
        axis.axis_label_text_font_size = "12px"
        axis.axis_label_text_font_style = "normal"
        axis.major_label_text_font_size = "11px"
        axis.minor_tick_line_color = None


def _source(columns: Mapping[str, FloatArray]) -> ColumnDataSource:
    return ColumnDataSource({name: values.astype(np.float32) for name, values in columns.items()})


def _hover(made: figure, unit: str, names: Sequence[str]) -> None:
    ending = f" {unit}" if unit else ""
    made.add_tools(
        HoverTool(
            renderers=made.renderers[:1],
            mode="vline",
            tooltips=[
                ("time", "@time{0.0000} s"),
                *((n, f"@{n}{{0.0000}}{ending}") for n in names),
            ],
        )
    )


def _command_figure(time_s: FloatArray, command: FloatArray, span: Range1d, most: int) -> figure:
    words, _, unit = shown_channel("command_v")
    made = _blank(span, words, unit, height=140, label_time=False)
    kept = kept_samples([command], most)
    source = _source({"time": time_s[kept], "command": command[kept]})
    made.line("time", "command", source=source, color="#6b7680", line_width=1.3)
    _hover(made, unit, ["command"])
    return made


def _output_figures(
    run: HeldOutRun, name: str, kinds: Sequence[str], span: Range1d, most: int
) -> tuple[figure, figure]:
    """Draws an output above and its errors (simulated minus measured) below, on one time axis."""
    words, scale, unit = shown_channel(name)
    columns = curves_of(run, name, kinds, scale=scale, most=most)
    source = _source(columns)
    shown = [kind for kind in kinds if kind in columns]
    upper = _blank(span, words, unit, height=270, label_time=False)
    lower = _blank(span, "error", unit, height=170, label_time=True)
    items = []
    for kind in ("measured", *shown):
        line = upper.line(
            "time",
            kind,
            source=source,
            color=COLOURS[kind],
            line_dash=DASHES[kind],
            line_width=4.0 if kind == "measured" else 1.6,
            line_alpha=0.35 if kind == "measured" else 1.0,
        )
        items.append(LegendItem(label=SIMULATIONS.get(kind, kind), renderers=[line]))
    for kind in shown:
        line = lower.line(
            "time",
            f"{kind}_error",
            source=source,
            color=COLOURS[kind],
            line_dash=DASHES[kind],
            line_width=1.3,
        )
        items[1 + shown.index(kind)].renderers.append(line)
    upper.add_layout(
        Legend(
            items=items,
            orientation="horizontal",
            ncols=2,  # more of them would be cut off on the screen of a telephone
            click_policy="hide",
            border_line_color=None,
            label_text_font_size="11px",
            spacing=8,
            padding=2,
            margin=0,
            glyph_width=18,
        ),
        "above",
    )
    _hover(upper, unit, ["measured", *shown])
    _hover(lower, unit, [f"{kind}_error" for kind in shown])
    return upper, lower


def next_plots(record: Record) -> list[Plot]:
    """Returns plots of the command to send next, and of the predicted position if it is known."""
    assert record.time_s is not None
    span = _span(record.time_s)
    most = int(MOST_BYTES / (BYTES_A_VALUE * COLUMNS_A_PLOT))
    plots = [Plot(_command_figure(record.time_s, record.column("command_v"), span, most))]
    if "position_m" in record.columns:
        words, scale, unit = shown_channel("position_m")
        position = scale * record.column("position_m")
        kept = kept_samples([position], most)
        lower = _blank(span, f"predicted {words}", unit, height=170, label_time=True)
        source = _source({"time": record.time_s[kept], "predicted": position[kept]})
        lower.line("time", "predicted", source=source, color=COLOURS["augmented"], line_width=1.6)
        _hover(lower, unit, ["predicted"])
        plots.append(Plot(lower))
    return plots
