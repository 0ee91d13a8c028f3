# SPDX-License-Identifier: MIT
"""Page of the edit test: was a change of the machine what the diagnosis named?"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..base.csv_text import csv_text
from ..base.encoding import json_text
from ..base.files import write_text
from ..diagnosis.edits import EditRun, EditTest
from ..diagnosis.edits.testing import TestedEdit, share_words
from .gap_page import simulation_table
from .gap_words import effect_set
from .page import Block, Fact, Facts, Items, Page, Picture, Section, Table
from .record_figure import run_figure
from .rendering import write_page
from .units import percent

FILES = ("edit.json", "simulation.csv", "edit.html")
TITLES = {
    "it_was": "It was that",
    "mostly": "It was that, and more is left",
    "not_it": "It was not that",
    "another_change": "Another change",
    "cannot_tell": "Nothing can be told",
}
SIMULATIONS = {
    "found": "twin as found",
    "edited": "twin edited",
    "left": "with the share that is left",
}
RULES = (
    "Gap: rms of simulated minus measured over the rms of the measured motion within windows, mean "
    "of the outputs. Nothing is fitted to the new record but the share that is left: the one with "
    "the largest likelihood, as the decision of the diagnosis counts it. Its interval of 90 % "
    "includes that of the size that was found. A twin agrees where its gap is at most three "
    "times that on the held-out record of its diagnosis, or three noise floors of the new record."
)


def edit_table(result: EditTest) -> Table:
    """Returns the gaps of the twin as found and edited, and what is left of each effect."""
    rows = [("as found", percent(result.found), "", "", "")]
    rows += [
        (
            _edited(one),
            percent(one.gap),
            "agrees" if one.agrees else "differs",
            share_words(one.left) if one.shown else "not shown",
            percent(one.gap_at_left),
        )
        for one in result.edits
    ]
    return Table("", ("twin", "gap", "", "what is left", "gap with that"), rows, [1 + result.told])


def _edited(one: TestedEdit) -> str:
    """The edit in words, such as "valve dead band: removed"."""
    shares = dict.fromkeys("removed" if share == 0.0 else percent(share) for share in one.share)
    return f"{effect_set(one.effects)}: {', '.join(shares)}"


def edit_page(result: EditTest, runs: Sequence[EditRun]) -> Page:
    """Returns the page of a test."""
    told = result.edits[result.told]
    facts = Facts(
        [
            Fact("Gap as found", percent(result.found), "of the twin on the new record"),
            Fact("Edited", percent(told.gap), _edited(told)),
            Fact(
                "Before the change",
                percent(result.own_gap),
                "of the twin on the held-out record of its diagnosis; noise floor of the new one: "
                f"{percent(result.noise_floor)}",
            ),
        ]
    )
    pictures = [
        Picture(
            run_figure(run, SIMULATIONS),
            "Measured after the change, beside the twin as found, the edited twin "
            f"({_edited(told)}), which is not fitted, and the twin with the share that is left.",
            f"Measured and simulated outputs of record {run.record}, and the errors.",
        )
        for run in runs
    ]
    rest: list[Block] = [edit_table(result), RULES]
    if result.notes:
        rest.append(Items(result.notes))
    sections = [Section("Each edit", rest)]
    if pictures[1:]:
        sections.append(Section("Further records", pictures[1:]))
    return Page(
        f"{result.machine}: was it that?",
        [result.sentence, facts],
        sections,
        overline="A change of the machine, and what its diagnosis named",
        badge=TITLES[result.outcome],
        summary=pictures[:1],
    )


def write_edit(folder: Path, result: EditTest, runs: Sequence[EditRun]) -> None:
    """Writes edit.json, simulation.csv and edit.html into a folder that exists."""
    write_text(folder / "edit.json", json_text(result))
    table = simulation_table(runs, tuple(SIMULATIONS))
    write_text(folder / "simulation.csv", csv_text(table))
    write_page(folder / "edit.html", edit_page(result, runs))
