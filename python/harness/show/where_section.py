# SPDX-License-Identifier: MIT
"""The section of a diagnosis on where the gap lies, with the input that explains it."""

from __future__ import annotations

import itertools
import re

import numpy as np
import numpy.typing as npt
from bokeh.models import Whisker
from bokeh.plotting import figure

from ..diagnosis.result import Diagnosis, UnknownInput
from ..rigs.table_words import OF_TERM, OF_VARIABLE, TERM_WORDS, VARIABLE_WORDS
from .gap_marks import share_bar, subsystem_bars, timelines
from .gap_plots import quiet_axes
from .gap_words import first_upper
from .page import Bars, Beside, Block, Card, Folded, Heading, Note, Plot, Section, Table
from .plotting import BLUE
from .shares import SPACE, percent

# The space between a number and its unit.
AT_UNIT = re.compile(r"(?<=\d) (?=(?:m/s|MPa|[mNsV])(?: |$))")


def where_section(diagnosis: Diagnosis) -> Section:
    """Returns the section; it has no blocks where nothing is known of the place."""
    where = diagnosis.where
    regimes = [
        share_bar(
            AT_UNIT.sub(SPACE, share.condition),
            share.share_of_gap,
            note=f"in {percent(share.share_of_time)} of the time",
        )
        for share in where.regimes
    ]
    bands = [
        share_bar(f"{share.band_hz[0]:g} to {share.band_hz[1]:g} Hz", share.share_of_gap)
        for share in where.frequency
    ]
    groups: list[list[Block]] = []
    if where.subsystem:
        bars = Bars("shares by part of the machine", subsystem_bars(diagnosis))
        groups.append([Heading("Part of the machine"), bars])
    if bands:
        groups.append([Heading("Frequency"), Bars("shares by frequency", bands)])
    below: list[Block] = []
    if regimes:
        note = Note("Regimes overlap: their shares need not add up.")
        below += [Heading("Way of running"), Bars("shares by regime", regimes), note]
    if where.time:
        below += [Heading("Time"), *timelines(where.time)]
    if not (groups or below or where.equations):
        return Section("Where the gap lies", list(where.notes))
    blocks: list[Block] = [
        "Shares of what remains after the values of the rig have been fitted, above the noise. "
        "Whiskers are intervals of 90 %.",
        *([Beside(groups)] if groups else []),
        *below,
    ]
    if where.equations:
        blocks.append(Folded("What each equation of the simulator lacks", _equations(diagnosis)))
    return Section("Where the gap lies", [*blocks, *where.notes])


def _equations(diagnosis: Diagnosis) -> list[Block]:
    equations = diagnosis.where.equations
    lacking = {found.adds_to for found in diagnosis.unknown_inputs}
    table = Table(
        "To one equation at a time, terms of free form were added and fitted through the simulator "
        "together with all values of the rig, without any effect of the catalogue. The gain is the "
        "logarithm of the evidence, in nats: what differs by less than about ten is alike.",
        ("term", "part", "share", "gain"),
        [
            (
                first_upper(TERM_WORDS[row.equation]),
                row.subsystem,
                percent(row.share),
                f"{row.gain:.0f}",
            )
            for row in equations
        ],
        [i for i, row in enumerate(equations) if row.equation in lacking],
    )
    return [table, *map(unknown_input_card, diagnosis.unknown_inputs)]


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
