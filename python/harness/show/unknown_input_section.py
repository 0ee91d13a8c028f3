# SPDX-License-Identifier: MIT
"""Shows what an equation lacks: over the time, and over the variable that it follows."""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt
from bokeh.models import Whisker
from bokeh.plotting import figure

from ..diagnosis.result import UnknownInput
from ..rigs.table_words import OF_TERM, OF_VARIABLE, TERM_WORDS, VARIABLE_WORDS
from .gap_plots import quiet_axes
from .gap_words import first_upper
from .page import Beside, Block, Card, Note, Plot
from .plotting import BLUE
from .shares import percent

# Variables that a table cannot have: words, unit for people, and how many there are in the SI unit.
FURTHER = {
    "acceleration_m_s2": ("acceleration", "m/s^2", 1.0),
    "spool_rate_1_s": ("speed of the spool", "%/s", 100.0),
    "pressure_a_rate_pa_s": ("rate of the cap-side pressure", "bar/s", 1e-5),
    "pressure_b_rate_pa_s": ("rate of the rod-side pressure", "bar/s", 1e-5),
    "load_pressure_pa": ("difference of the chamber pressures", "bar", 1e-5),
    "position_by_direction_m": ("travel, negative where the rod retracts", "mm", 1e3),
}
# Windows that are shown over the time, and half the width of a band of 90 % in deviations.
SHOWN_WINDOWS = 4
HALF_WIDTH = 1.645
# Most points of a scatter.
MOST_POINTS = 600


def unknown_input_card(found: UnknownInput) -> Card:
    """Returns the pictures of an unknown input with what they say."""
    words, *_ = _variable(found.of)
    note = Note(
        f"What would have to be added for the simulator to follow the record, with a band of 90 %. "
        f"A smooth function of the {words} has {percent(found.explained)} of its squares."
    )
    pictures: list[list[Block]] = [[Plot(_over_time(found))], [Plot(_over_variable(found))]]
    return Card(first_upper(TERM_WORDS[found.adds_to]), [note, Beside(pictures)])


def _variable(name: str) -> tuple[str, str, float]:
    if name in FURTHER:
        return FURTHER[name]
    unit, scale = OF_VARIABLE[name]
    return VARIABLE_WORDS[name], unit, scale


def _figure(x_label: str, y_label: str) -> figure:
    made = figure(
        height=260,
        sizing_mode="stretch_width",
        x_axis_label=x_label,
        y_axis_label=y_label,
        toolbar_location=None,
        outline_line_color="#d5dae0",
        min_border_left=64,
    )
    quiet_axes(made)
    return made


def _over_time(found: UnknownInput) -> figure:
    """The neighbouring windows in which the input is largest; it may jump from one to the next."""
    unit, scale = OF_TERM[found.adds_to]
    made = _figure("time in s", f"{TERM_WORDS[found.adds_to]} in {unit}")
    for nodes in largest_windows(found):
        time_s, value = found.time_s[nodes], scale * found.value[nodes]
        half = scale * HALF_WIDTH * found.deviation[nodes]
        made.varea(time_s, value - half, value + half, color=BLUE, alpha=0.2)
        made.line(time_s, value, color=BLUE, line_width=1.5)
    return made


def largest_windows(found: UnknownInput) -> list[npt.NDArray[np.int64]]:
    """Nodes of the SHOWN_WINDOWS windows in a row with the largest sum of squares."""
    places = np.stack([found.record, found.window], axis=1)
    starts = np.flatnonzero(np.any(np.diff(places, axis=0, prepend=-1), axis=1))
    windows = [np.arange(a, b) for a, b in itertools.pairwise([*starts.tolist(), found.value.size])]
    squares = [float(np.sum(found.value[nodes] ** 2)) for nodes in windows]
    runs = [
        range(first, first + SHOWN_WINDOWS)
        for first in range(len(windows) - SHOWN_WINDOWS + 1)
        if found.record[windows[first][0]] == found.record[windows[first + SHOWN_WINDOWS - 1][0]]
    ] or [range(min(len(windows), 1))]
    best = max(runs, key=lambda run: sum(squares[i] for i in run))
    return [windows[i] for i in best]


def _over_variable(found: UnknownInput) -> figure:
    unit, scale = OF_TERM[found.adds_to]
    words, x_unit, x_scale = _variable(found.of)
    made = _figure(f"{words} in {x_unit}", f"{TERM_WORDS[found.adds_to]} in {unit}")
    shown = slice(None, None, max(1, -(-found.value.size // MOST_POINTS)))
    x, value = x_scale * found.at[shown], scale * found.value[shown]
    half = scale * HALF_WIDTH * found.deviation[shown]
    dots = made.scatter(x, value, color=BLUE, size=4, alpha=0.6)
    dots.data_source.data["low"], dots.data_source.data["high"] = value - half, value + half
    ends = Whisker(base="x", lower="low", upper="high", source=dots.data_source)
    ends.line_color, ends.line_alpha = BLUE, 0.15
    ends.upper_head = ends.lower_head = None
    made.add_layout(ends)
    return made
