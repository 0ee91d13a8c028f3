# SPDX-License-Identifier: MIT
"""Page and files of a diagnosis that rests on traces of a simulation.

Nothing was fitted in a simulator, so that there are no values, no probabilities and no rig to run.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from ..base.csv_text import csv_text
from ..base.files import write_text
from ..catalogue.channels import shown_channel
from ..catalogue.parameters import plain_name
from ..catalogue.spellings import ParameterKey
from ..diagnosis.result import Diagnosis, diagnosis_text
from ..records import Record
from .gap_page import simulation_table
from .gap_plots import run_blocks
from .gap_words import first_upper, interval, quantity, unit_of
from .page import Block, Fact, Facts, Folded, Heading, Items, Note, Page, Section, Table
from .record_figure import gap_picture
from .rendering import render_page
from .units import percent
from .where_section import where_section

TITLES = {
    "no_gap": "No gap",
    "effects": "Between the traces",
    "ambiguous": "Several explanations",
    "outside_catalogue": "Not told by a trace",
    "insufficient_data": "These records cannot be judged",
}
NEXT = "Give the simulator itself"


def write_traces(
    folder: Path, diagnosis: Diagnosis, records: Sequence[Record], rig_file: str
) -> None:
    """Writes diagnosis.json, simulation.csv and report.html into a folder.

    Parameters
    ----------
    folder
        exists.
    diagnosis
        the findings on traces.
    records
        records and traces, as they were read.
    rig_file
        path of the rig file, as the user gave it; "" without one.
    """
    write_text(folder / "diagnosis.json", diagnosis_text(diagnosis, records, rig_file))
    write_text(folder / "simulation.csv", csv_text(simulation_table(diagnosis.runs)))
    write_text(folder / "report.html", render_traces(diagnosis, records))


def trace_tables(diagnosis: Diagnosis) -> Iterator[Table]:
    """Yields the gap by output, what was found, and all that was tried."""
    gap = diagnosis.how_far
    if gap is None:
        return
    found = bool(diagnosis.effects)
    rows = [
        (shown_channel(name)[0], percent(before), *([percent(after)] if found else []))
        for name, (before, _, after) in gap.per_output.items()
    ]
    headings = ("gap on held-out blocks", "the trace", *(["with what was found"] if found else []))
    yield Table("", headings, rows)
    if found:
        sizes = [
            (
                plain_name(effect.id),
                *interval(size, unit_of(ParameterKey.of_effect(effect.id, name))),
            )
            for effect in diagnosis.effects
            for name, size in effect.parameters.items()
        ]
        yield Table("", ("effect", "size", "90 % interval"), sizes)
    if diagnosis.candidates:
        rows = [
            (
                " + ".join(map(plain_name, one.effects))
                + (" and another scale or time" if (one.free or 0) > len(one.effects) else ""),
                percent(one.held_out_shrinkage),
                ", ".join(
                    quantity(size, unit_of(name), 3) for name, size in one.parameters.items()
                ),
                "alike" if one.in_confidence_set else "",
            )
            for one in diagnosis.candidates
        ]
        headings = ("tried", "removes of the position's gap", "size", "")
        yield Table("", headings, rows[:MOST_SHOWN])


MOST_SHOWN = 8
SIMULATIONS = {"nominal": "the trace", "augmented": "with what was found"}


def render_traces(diagnosis: Diagnosis, records: Sequence[Record]) -> str:
    """Returns the HTML page, which needs no other files."""
    tables = list(trace_tables(diagnosis))
    kinds = ("nominal", "augmented") if diagnosis.effects else ("nominal",)
    plots = run_blocks(diagnosis.runs, kinds)
    words = {kind: SIMULATIONS[kind] for kind in kinds}
    tried: list[Block] = [*tables[1:], *_unjudged(diagnosis)]
    error: list[Block] = [Heading("Error of the trace"), tables[0]] if tables else []
    signals: list[Block] = [
        "Held-out blocks. In each window the trace begins at the measured position, so that the "
        "curves begin anew there. Drag over a stretch to zoom.",
        *plots,
    ]
    sections = [
        where_section(diagnosis),
        Section("What was tried", tried),
        Section("Measured and simulated", signals if plots else []),
        _about(diagnosis, records),
    ]
    title = TITLES[diagnosis.verdict]
    return render_page(
        Page(
            title=diagnosis.sentence,
            lead=["Two traces were compared, measured and simulated. The simulator was not run."],
            sections=[section for section in sections if section.blocks],
            overline=f"Diagnosis of the gap between {diagnosis.rig.name} and a simulated trace",
            badge=title,
            kind=diagnosis.verdict,
            summary=[
                *gap_picture(diagnosis.runs, diagnosis.how_far, words),
                _facts(diagnosis),
                *error,
                Heading("What this rests on"),
                Items(list(diagnosis.reasons)),
            ],
            footer=[f"{diagnosis.seconds:.0f} s"],
            window_title=f"{title}: {diagnosis.rig.name}",
        )
    )


def _facts(diagnosis: Diagnosis) -> Facts:
    parts = [name for name, share in diagnosis.where.subsystem.items() if share > 0.0]
    sets = diagnosis.ambiguity_set
    facts = [
        Fact("Where", " or ".join(parts) or "not known", "Regimes and frequencies stand below."),
        Fact("Which", " or ".join(" + ".join(map(plain_name, one)) for one in sets) or "not known"),
    ]
    gap = diagnosis.how_far
    if gap is not None and "position_m" in gap.per_output:
        before, _, after = gap.per_output["position_m"]
        note = f"gap of the position; {percent(after)} with what was found" if sets else ""
        facts.append(Fact("How far", percent(before), note or "gap of the position"))
    return Facts(
        [*facts, Fact("What next", NEXT, "As an FMU or in Python: ehsid rig new --simulator FILE.")]
    )


def _unjudged(diagnosis: Diagnosis) -> list[Block]:
    if not diagnosis.cannot_judge:
        return []
    names = ", ".join(plain_name(one.id) for one in diagnosis.cannot_judge)
    why = first_upper(diagnosis.cannot_judge[0].why)
    return [Note(f"Could not be judged: {names}. {why}.")]


def _about(diagnosis: Diagnosis, records: Sequence[Record]) -> Section:
    rows = [
        (
            one.name,
            diagnosis.records.get(one.name, "trace"),
            str(one.source or ""),
            one.sha256 or "",
        )
        for one in records
    ]
    remarks = [f"{one.record}: {one.what}" if one.record else one.what for one in diagnosis.remarks]
    settings = [(name, str(value)) for name, value in diagnosis.settings.items()]
    return Section(
        "Records and settings",
        [
            Table("", ("record", "role", "file", "SHA-256"), rows),
            *([Items(remarks)] if remarks else []),
            Folded("Settings", [Table("", ("setting", "value"), settings)]),
        ],
    )
