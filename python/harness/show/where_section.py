# SPDX-License-Identifier: MIT
"""The section of a diagnosis on where the gap lies, with the input that explains it.

What was taken for what in a log of another layout, as a part of any page.

What a reader of a diagnosis wants first: where, which, how far, and what to do next.
"""

from __future__ import annotations

import itertools
import re

import numpy as np
import numpy.typing as npt
from bokeh.models import Whisker
from bokeh.plotting import figure

from ..catalogue.channels import TIME
from ..catalogue.parameters import effects, plain_name, size_name, value_name
from ..catalogue.spellings import ParameterKey
from ..diagnosis.result import Diagnosis, UnknownInput
from ..diagnosis.schema import SUBSYSTEM_TAKES_PART, Estimate, HowFar
from ..records import Origin
from ..rigs.rig import OF_TERM, OF_VARIABLE, TERM_WORDS, VARIABLE_WORDS, table_words
from .gap_plots import share_bar, subsystem_bars, term_figure, timelines
from .gap_words import chosen, effect_set, first_upper, interval, named_effects, unit_of
from .page import (
    Bars,
    Beside,
    Block,
    Card,
    Fact,
    Facts,
    Folded,
    Heading,
    Items,
    Note,
    Plot,
    Section,
    Table,
    Tagged,
    Told,
    whole,
)
from .plotting import BLUE
from .units import percent, percent_ends
from .verdict_words import VERDICTS, what_now


def where_section(diagnosis: Diagnosis) -> Section:
    """Returns the section; it has no blocks where nothing is known of the place."""
    where = diagnosis.where
    regimes = [
        share_bar(
            whole(share.condition),
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
    remains = "" if diagnosis.of_traces else " after the values of the rig have been fitted"
    blocks: list[Block] = [
        f"Shares of what remains{remains}, above the noise. Whiskers are intervals of 90 %.",
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


def _over_time(found: UnknownInput) -> figure:
    """The neighbouring windows in which the input is largest; it may jump from one to the next."""
    unit, scale = OF_TERM[found.adds_to]
    made = term_figure("time in s", f"{TERM_WORDS[found.adds_to]} in {unit}")
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
    made = term_figure(f"{words} in {x_unit}", f"{TERM_WORDS[found.adds_to]} in {unit}")
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


def origin_table(origin: Origin) -> Table:
    """Returns which column was taken for which channel, and why."""
    return Table("", ("column", "taken for", "unit", "factor", "why"), origin.rows())


def reading_blocks(origin: Origin) -> list[Told]:
    """Returns the table of the columns, and the remarks on what was changed and guessed."""
    blocks: list[Told] = [f"The file was read as {origin.kind}."]
    if origin.taken:
        blocks.append(origin_table(origin))
    if origin.remarks:
        blocks.append(Items(list(origin.remarks)))
    return blocks


def reading_section(origin: Origin) -> Section:
    """Returns the blocks as a section of their own."""
    return Section("How the log was read", reading_blocks(origin))


def reading_folded(name: str, origin: Origin) -> Folded:
    """Returns the blocks under a title with the name of the record, folded."""
    return Folded(f"How the log {name} was read", reading_blocks(origin))


def diagnosis_facts(diagnosis: Diagnosis) -> Facts:
    """Returns the answers of a diagnosis in the order of its questions."""
    facts = [_where(diagnosis), _which(diagnosis)]
    if diagnosis.how_far is not None:
        facts.append(_how_far(diagnosis, diagnosis.how_far))
    words = what_now(diagnosis.verdict, experiment=diagnosis.next_experiment is not None)
    first, rest = re.split("[.:] ", words, maxsplit=1)
    return Facts([*facts, Fact("What next", first, first_upper(rest))])


def _where(diagnosis: Diagnosis) -> Fact:
    shares = sorted(diagnosis.where.subsystem.items(), key=lambda item: -item[1])
    if not shares:
        return Fact("Where", VERDICTS[diagnosis.verdict].where)
    named = {effect for names in diagnosis.ambiguity_set for effect in names}
    of_named = {effects()[effect].subsystem for effect in named}
    parts = [
        (plain_name(name), percent(share))
        for i, (name, share) in enumerate(shares)
        if i == 0 or share >= SUBSYSTEM_TAKES_PART or name in of_named
    ]
    both = " or " if diagnosis.verdict == "ambiguous" or not diagnosis.effects else " and "
    note = f"{' and '.join(share for _, share in parts)} of the gap that the fitted values leave"
    return Fact("Where", both.join(name for name, _ in parts), note)


def _which(diagnosis: Diagnosis) -> Fact:
    several = diagnosis.ambiguity_set
    if diagnosis.verdict == "ambiguous" and len(several) > 1:
        value = Tagged(
            " or ".join(map(effect_set, several)), hint=" or ".join(map(" + ".join, several))
        )
        return Fact("Which", value, "These records cannot tell them apart.")
    if diagnosis.effects:
        more = diagnosis.verdict == "outside_catalogue"
        value = named_effects([effect.id for effect in diagnosis.effects])
        return Fact("Which", value, _sizes(diagnosis) + (" More is missing." if more else ""))
    if diagnosis.missing_laws:
        law = diagnosis.missing_laws[0]
        value = Tagged(table_words(law.law.adds_to, law.law.of))
        return Fact("Which", value, f"No effect of the catalogue: it {law.looks_like}.")
    if (wanders := diagnosis.wandering) is not None:
        value = Tagged(table_words(wanders.adds_to, TIME))
        return Fact("Which", value, f"No effect of the catalogue: it {wanders.looks_like}.")
    moved = [value_name(name) for name, value in diagnosis.calibration.items() if value.moved]
    if diagnosis.verdict == "parameters" and moved:
        return Fact("Which", ", ".join(moved), "No effect is named.")
    return Fact("Which", VERDICTS[diagnosis.verdict].which)


def _sizes(diagnosis: Diagnosis) -> str:
    """The probability of each effect, and its first size with the interval of 90 %."""
    sentences = []
    alone = chosen(diagnosis.candidates).probability if diagnosis.candidates else None
    if diagnosis.verdict == "effects" and diagnosis.next_experiment is not None and alone:
        sentences.append(f"Just this set: probability {percent(alone)}.")
    for effect in diagnosis.effects:
        words = f"Probability {percent(effect.probability)}"
        if len(diagnosis.effects) > 1:
            words = f"{first_upper(plain_name(effect.id))}: probability"
            words += f" {percent(effect.probability)}"
        for name, size in list(effect.parameters.items())[:1]:
            key = ParameterKey.of_effect(effect.id, name)
            value, ends = interval(size, unit_of(key))
            words += f"; {size_name(key)} {value} ({ends})"
        sentences.append(f"{words}.")
    return " ".join(sentences)


def _how_far(diagnosis: Diagnosis, gap: HowFar) -> Fact:
    if gap.of_explainable is not None and (diagnosis.effects or diagnosis.missing_laws):
        note = (
            "of the gap above the noise floor, after the values of the rig were fitted, is removed "
            f"by the added {_added(diagnosis)}. 90 % interval for other motions: "
            f"{percent_ends(gap.of_explainable)}."
        )
        if gap.of_explainable.high > 1.0:
            note += " Beyond 100 % the noise is smaller than was estimated."
        return Fact("How far", percent(min(gap.of_explainable.value, 1.0)), note)
    smaller, word = change_of(gap.from_nominal)
    note = (
        "than the gap of the simulator as configured, after the values of the rig were fitted. "
        f"90 % interval: {percent_ends(smaller)}."
    )
    return Fact("How far", f"{percent(smaller.value)} {word}", note)


def change_of(smaller: Estimate) -> tuple[Estimate, str]:
    """A change of the gap as a positive number, and whether it became smaller or larger."""
    if smaller.value >= 0.0:
        return smaller, "smaller"
    return Estimate(-smaller.value, -smaller.high, -smaller.low), "larger"


def _added(diagnosis: Diagnosis) -> str:
    """Names what the last simulation has besides fitted values."""
    named = "effect" if len(diagnosis.effects) == 1 else "effects"
    laws = "law" if len(diagnosis.missing_laws) == 1 else "laws"
    names = [
        name for name, any_ in ((named, diagnosis.effects), (laws, diagnosis.missing_laws)) if any_
    ]
    return " and ".join(names)
