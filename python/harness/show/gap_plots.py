# SPDX-License-Identifier: MIT
"""Draws zoomable plots of a diagnosis: measured and simulated outputs, errors, the next command.

Bokeh draws the plots in the browser of the reader; the page contains the library and the samples.

Prepares the curves of a held-out run for a plot: fewer samples, and breaks between windows.

Computes bars, dots and intervals of the diagnosis page, in per cent of the width of an axis.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from bokeh.models import (
    BoxZoomTool,
    ColumnDataSource,
    CrosshairTool,
    GlyphRenderer,
    HoverTool,
    Legend,
    LegendItem,
    PanTool,
    Range1d,
    ResetTool,
    SaveTool,
    Span,
    WheelZoomTool,
)
from bokeh.plotting import figure

from ..base.numbers import FloatArray
from ..catalogue.channels import shown_channel
from ..catalogue.parameters import plain_name, plant_parameters, value_name
from ..catalogue.spellings import ParameterKey
from ..diagnosis.edits import EditRun
from ..diagnosis.result import Diagnosis, HeldOutRun
from ..diagnosis.schema import Calibrated, Estimate, HowFar
from ..diagnosis.schema import Span as ShareOfTime
from ..records import Record
from .gap_words import SIMULATIONS, first_upper, interval, quantity, unit_of
from .page import Bar, Block, Column, Folded, Heading, Mark, Plot, Scale, Table, Tagged, Timeline
from .plotting import COMMAND, DASHES, FOUND, FRAME, GREY, GRID, ROLES, kept_samples
from .units import percent, percent_ends


def curves_of(
    run: HeldOutRun | EditRun, name: str, kinds: Sequence[str], *, scale: float, most: int
) -> dict[str, FloatArray]:
    """Returns the samples to draw, with a break at the end of each window.

    The simulation starts anew in each window; a line across the end would suggest that it goes on.

    Parameters
    ----------
    run
        held-out run of N samples.
    name
        name of the output.
    kinds
        kinds of simulation: fields of the run, such as "nominal".
    scale
        factor from SI to the unit of the plot.
    most
        approximate number of samples to keep of the N samples.

    Returns
    -------
    `time` in s, `measured`, each kind, and its `KIND_error` (simulated minus measured), all of one
    length. Simulations and errors are NaN outside of windows and at the breaks.
    """
    measured = run.measured[name]
    simulated = {kind: getattr(run, kind)[name] for kind in kinds if name in getattr(run, kind)}
    inside = run.window >= 0
    errors = {kind: np.where(inside, made - measured, np.nan) for kind, made in simulated.items()}
    starts = np.flatnonzero(np.diff(run.window)) + 1
    kept = kept_samples([measured, *errors.values()], most, always=np.union1d(starts - 1, starts))
    breaks = np.searchsorted(kept, starts)

    def broken(values: FloatArray, *, gap: bool) -> FloatArray:
        drawn = values[kept]
        return np.insert(drawn, breaks, np.nan if gap else drawn[breaks])

    columns = {
        "time": broken(run.time_s, gap=False),
        "measured": broken(scale * measured, gap=False),
    }
    for kind, made in simulated.items():
        columns[kind] = broken(scale * np.where(inside, made, np.nan), gap=True)
        columns[f"{kind}_error"] = broken(scale * errors[kind], gap=True)
    return columns


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
    drawn = [_command_figure(run.time_s, run.command_v, span, most)]
    blocks: list[Block] = [Plot(drawn[0])]
    for name in run.measured:
        words = first_upper(shown_channel(name)[0])
        blocks.append(Heading(f"{words}: signals, and simulated minus measured"))
        pair = _output_figures(run, name, kinds, span, most)
        blocks += map(Plot, pair)
        drawn += pair
    share_cursor(drawn)
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
        outline_line_color=FRAME,
        output_backend="canvas",
    )
    made.toolbar.logo = None
    made.toolbar.autohide = True
    quiet_axes(made)
    return made


def share_cursor(plots: Sequence[figure]) -> None:
    """Draws an upright line at the pointer through all plots of one time axis."""
    line = Span(dimension="height", line_color=GREY, line_dash="dashed", line_width=1)
    for one in plots:
        one.add_tools(CrosshairTool(overlay=line))


def quiet_axes(made: figure) -> None:
    """Sets grid and axes of a plot of a page in the style of all of them."""
    made.grid.grid_line_color = GRID
    for axis in made.axis:
        axis.axis_label_text_font_size = "12px"
        axis.axis_label_text_font_style = "normal"
        axis.major_label_text_font_size = "11px"
        axis.minor_tick_line_color = None


def term_figure(x_label: str, y_label: str) -> figure:
    """An empty plot of a term of an equation."""
    made = figure(
        height=260,
        sizing_mode="stretch_width",
        x_axis_label=x_label,
        y_axis_label=y_label,
        toolbar_location=None,
        outline_line_color=FRAME,
        min_border_left=64,
    )
    quiet_axes(made)
    return made


def legend_above(made: figure, items: Sequence[tuple[str, Sequence[GlyphRenderer[Any]]]]) -> None:
    """Adds a legend above a plot of a term; two columns fit on the screen of a telephone."""
    made.add_layout(
        Legend(
            items=[(words, list(drawn)) for words, drawn in items],
            orientation="horizontal",
            ncols=2,
            border_line_color=None,
            label_text_font_size="11px",
            padding=2,
            margin=0,
        ),
        "above",
    )


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
    made.line("time", "command", source=source, color=COMMAND, line_width=1.3)
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
            color=ROLES["light"][kind],
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
            color=ROLES["light"][kind],
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
        lower.line("time", "predicted", source=source, color=FOUND, line_width=1.6)
        _hover(lower, unit, ["predicted"])
        plots.append(Plot(lower))
    return plots


# The axis for fitted values extends this many standard deviations of the prior to either side.
AXIS_SIGMAS = 3.0


def _inside(place: float) -> float:
    return min(100.0, max(0.0, place))


def share_bar(label: str, share: Estimate | float, note: str = "") -> Bar:
    """Returns the bar of a share in [0, 1], with its interval if the share is an `Estimate`."""
    low: float | None = None
    high: float | None = None
    if isinstance(share, Estimate):
        low, high = _inside(100.0 * share.low), _inside(100.0 * share.high)
        shown, value = percent(share.value), share.value
        note = f"{percent_ends(share)}{', ' if note else ''}{note}"
    else:
        shown, value = percent(share), share
    return Bar(label, shown, _inside(100.0 * value), "", low, high, note)


def gap_bars(gap: HowFar, kinds: Sequence[str]) -> list[Bar]:
    """Returns bars of the gap of each kind of simulation and of the noise floor.

    The largest of these values fills the axis.
    """
    steps = [(SIMULATIONS[kind], kind, float(getattr(gap, kind))) for kind in kinds]
    largest = max(*(value for _, _, value in steps), gap.noise_floor[1], 1e-12)
    bars = [
        Bar(words, percent(value), _inside(100.0 * value / largest), kind)
        for words, kind, value in steps
    ]
    low, high = (_inside(100.0 * end / largest) for end in gap.noise_floor)
    shown = f"{percent(gap.noise_floor[0])} to {percent(gap.noise_floor[1])}"
    return [*bars, Bar("noise floor", shown, high, "floor", low, high)]


def value_table(diagnosis: Diagnosis, *, nuisances: bool) -> Table:
    """Returns the fitted nuisances or the fitted rig values; values that moved come first."""
    values = [
        (name, value)
        for name, value in diagnosis.calibration.items()
        if ParameterKey(name).is_nuisance == nuisances
    ]
    values.sort(key=lambda item: not item[1].moved)
    known = "typical" if nuisances else "rig file"
    ends = Scale(f"−{AXIS_SIGMAS:g} σ", known, f"+{AXIS_SIGMAS:g} σ")
    return Table(
        "",
        ("value", known, "estimate", "90 % interval", ends),
        [(*_value_row(name, value), mark(diagnosis.in_sigmas[name])) for name, value in values],
        [i for i, (_, value) in enumerate(values) if value.moved],
    )


def _value_row(name: str, value: Calibrated) -> tuple[Tagged, str, str, str]:
    unit = unit_of(name)
    meaning = plant_parameters()[name].meaning if name in plant_parameters() else ""
    hint = f"{name}: {meaning}" if meaning else name
    return (
        Tagged(value_name(name), "moved" if value.moved else "", hint),
        quantity(value.rig, unit),
        *interval(value.found, unit),
    )


def mark(sigmas: Estimate | None) -> Mark:
    """Returns the place of an estimate that is given in standard deviations of its prior."""
    if sigmas is None:
        return Mark(None, None, None)
    return Mark(*(_on_axis(end) for end in (sigmas.value, sigmas.low, sigmas.high)))


def _on_axis(sigmas: float) -> float | None:
    if not math.isfinite(sigmas):
        return None
    return _inside(50.0 + 50.0 * sigmas / AXIS_SIGMAS)


def timelines(spans: Sequence[ShareOfTime]) -> list[Timeline]:
    """Returns the shares of the gap over time, with one time axis for each record.

    The largest share of all records has the full height.
    """
    if not spans:
        return []
    largest = max(max(span.share_of_gap for span in spans), 1e-12)
    made = []
    for record in dict.fromkeys(span.record for span in spans):
        own = [span for span in spans if span.record == record]
        start, end = own[0].span_s[0], max(span.span_s[1] for span in own)
        length = max(end - start, 1e-12)
        columns = [
            Column(
                100.0 * (span.span_s[0] - start) / length,
                100.0 * (span.span_s[1] - span.span_s[0]) / length,
                _inside(100.0 * span.share_of_gap / largest),
                f"{span.span_s[0]:.2f} to {span.span_s[1]:.2f} s: {percent(span.share_of_gap)}",
            )
            for span in own
        ]
        label = f"Share of the gap over time in {record}"
        made.append(Timeline(record, label, f"{start:.1f} s", f"{end:.1f} s", columns))
    return made


def subsystem_bars(diagnosis: Diagnosis) -> list[Bar]:
    """Returns bars of the shares of the subsystems, the largest share first."""
    shares = sorted(diagnosis.where.subsystem.items(), key=lambda item: -item[1])
    return [share_bar(plain_name(name), share) for name, share in shares]
