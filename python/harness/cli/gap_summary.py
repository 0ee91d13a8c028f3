# SPDX-License-Identifier: MIT
"""Prints the summary of a diagnosis on the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from rich.padding import Padding
from rich.table import Table

from ehsid.harness.catalogue.channels import shown_channel
from ehsid.harness.catalogue.keys import ParameterKey
from ehsid.harness.cli.common import make_table
from ehsid.harness.cli.console import Console
from ehsid.harness.gap.schema import Diagnosis, HowFar
from ehsid.harness.report.gap_words import (
    SIMULATIONS,
    STANDINGS,
    VERDICTS,
    effect_set,
    interval,
    percent,
    percent_interval,
    plain_name,
    quantity,
    unit_of,
    value_name,
)
from ehsid.harness.rigs.table_words import table_words

# More candidates than this are easier to read on the page.
MOST_CANDIDATES = 5


def print_diagnosis(diagnosis: Diagnosis, folder: Path, console: Console) -> None:
    """Prints the verdict in a sentence and then its reasons; the details are in the report."""
    title, _ = VERDICTS[diagnosis.verdict]
    console.print(f"\n{title}", style="bold")
    console.print(diagnosis.sentence, style="bold")
    for reason in diagnosis.reasons:
        console.print(Padding(f"- {reason}", (0, 0, 0, 2)))
    for table in _tables(diagnosis):
        console.print()
        console.print(table)
    coming = diagnosis.next_experiment
    if coming is not None:
        rivals = " from ".join(effect_set(tuple(names.split("+"))) for names in coming.separates)
        console.print(
            f"\nNext experiment: {coming.description}; it separates {rivals} with a "
            f"predicted probability of {percent(coming.power)}: "
            f"{folder / 'next_experiment.csv'}",
        )
    if diagnosis.cannot_judge:
        console.print("\nCould not be judged:")
        for effect in diagnosis.cannot_judge:
            line = f"- {plain_name(effect.id)}: {effect.why}"
            console.print(Padding(line, (0, 0, 0, 2)))
    for remark in diagnosis.remarks:
        sign, style = ("serious", "red") if remark.serious else ("note", None)
        about = f"{remark.record}: " if remark.record else ""
        console.print(f"{sign}: {about}{remark.what}", style=style)
    console.print(f"\nreport: {folder / 'report.html'}", soft_wrap=True)


def _tables(diagnosis: Diagnosis) -> Iterator[Table]:
    if diagnosis.how_far is not None:
        added = bool(diagnosis.effects or diagnosis.missing_laws)
        yield _gap(diagnosis.how_far, added=added)
    if diagnosis.where.subsystem:
        shares = sorted(diagnosis.where.subsystem.items(), key=lambda item: -item[1])
        rows = [(name, percent(share)) for name, share in shares]
        yield make_table(("where", "share of the gap"), rows)
    if diagnosis.effects:
        sizes = [
            (
                *((plain_name(effect.id), percent(effect.probability)) if i == 0 else ("", "")),
                *interval(size, unit_of(ParameterKey.of_effect(effect.id, name))),
            )
            for effect in diagnosis.effects
            for i, (name, size) in enumerate(effect.parameters.items())
        ]
        yield make_table(("effect", "probability", "size", "90 % interval"), sizes)
    if diagnosis.missing_laws:
        laws = [
            (
                table_words(found.law.adds_to, found.law.of),
                found.looks_like,
                percent(found.share_of_shrinkage),
            )
            for found in diagnosis.missing_laws
        ]
        yield make_table(("missing law", "its form", "share of what is removed"), laws)
    if diagnosis.candidates:
        candidates = [
            (
                effect_set(candidate.effects),
                percent(candidate.held_out_shrinkage),
                f"{candidate.score:.1f}",
                STANDINGS[candidate.standing.kind],
            )
            for candidate in diagnosis.candidates[:MOST_CANDIDATES]
        ]
        yield make_table(("candidate", "removes", "nats behind", "decision"), candidates)
    moved = [
        (
            value_name(name),
            quantity(value.rig, unit_of(name)),
            *interval(value.found, unit_of(name)),
        )
        for name, value in diagnosis.calibration.items()
        if value.moved
    ]
    if moved:
        yield make_table(("value that moved", "rig file", "estimate", "90 % interval"), moved)


def _gap(gap: HowFar, *, added: bool) -> Table:
    """added: whether effects or laws were added to the last simulation."""
    floor = " to ".join(map(percent, gap.noise_floor))
    means = (gap.nominal, gap.calibrated, gap.augmented)
    rows = [("all outputs", *map(percent, means), floor)]
    rows += [
        (f"  {shown_channel(name)[0]}", *map(percent, gaps), "")
        for name, gaps in gap.per_output.items()
    ]
    caption = None
    if added and gap.of_explainable is not None:
        caption = (
            f"What was found removes {percent_interval(gap.of_explainable)} of the gap above the "
            "noise floor that remained after the fit. The range is for other motions of this "
            "machine."
        )
    headings = ("gap on held-out data", *SIMULATIONS.values(), "floor")
    return make_table(headings, rows, caption=caption, caption_justify="left")
