# SPDX-License-Identifier: MIT
"""The section of a diagnosis on where the gap lies."""

from __future__ import annotations

import re

from ..diagnosis.result import Diagnosis
from ..rigs.table_words import TERM_WORDS
from .gap_marks import share_bar, subsystem_bars, timelines
from .gap_words import first_upper
from .page import Bars, Beside, Block, Folded, Heading, Note, Section, Table
from .shares import SPACE, percent
from .unknown_input_section import unknown_input_card

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
