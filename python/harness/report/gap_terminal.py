# SPDX-License-Identifier: MIT
"""Prints the summary of a diagnosis on the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.padding import Padding
from rich.table import Table

from ehsid.harness.catalogue.channels import shown_channel
from ehsid.harness.catalogue.keys import ParameterKey
from ehsid.harness.gap.schema import Diagnosis
from ehsid.harness.report.gap_words import (
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

# More candidates than this are easier to read on the page.
MOST_CANDIDATES = 5


def print_diagnosis(diagnosis: Diagnosis, folder: Path, console: Console) -> None:
    """Prints the verdict in a sentence and then its reasons; the details are in the report."""
    title, _ = VERDICTS[diagnosis.verdict]
    console.print(f"\n[bold]{title}[/bold]", highlight=False)
    console.print(f"[bold]{escape(diagnosis.sentence)}[/bold]", highlight=False)
    for reason in diagnosis.reasons:
        console.print(Padding(f"- {escape(reason)}", (0, 0, 0, 2)), highlight=False)
    for table in _tables(diagnosis):
        console.print()
        console.print(table)
    coming = diagnosis.next_experiment
    if coming is not None:
        rivals = " from ".join(effect_set(tuple(one.split("+"))) for one in coming.separates)
        console.print(
            f"\nNext experiment: {escape(coming.description)}; it separates {rivals} with a "
            f"predicted probability of {percent(coming.power)}: "
            f"{escape(str(folder / 'next_experiment.csv'))}",
            highlight=False,
        )
    if diagnosis.cannot_judge:
        console.print("\nCould not be judged:", highlight=False)
        for one in diagnosis.cannot_judge:
            line = f"- {plain_name(one.id)}: {escape(one.why)}"
            console.print(Padding(line, (0, 0, 0, 2)), highlight=False)
    for remark in diagnosis.remarks:
        sign = "[bold red]serious[/bold red]" if remark.serious else "note"
        about = f"{escape(remark.record)}: " if remark.record else ""
        console.print(f"{sign}: {about}{escape(remark.what)}", highlight=False)
    console.print(f"\nreport: {folder / 'report.html'}", soft_wrap=True, highlight=False)


def _tables(diagnosis: Diagnosis) -> Iterator[Table]:
    far = diagnosis.how_far
    if far is not None:
        yield _gap(diagnosis)
    if diagnosis.where.subsystem:
        table = _table("where", "share of the gap")
        for name, share in sorted(diagnosis.where.subsystem.items(), key=lambda item: -item[1]):
            table.add_row(name, percent(share))
        yield table
    if diagnosis.effects:
        table = _table("effect", "probability", "size", "90 % interval")
        for effect in diagnosis.effects:
            told = plain_name(effect.id), percent(effect.probability)
            for name, size in effect.parameters.items():
                unit = unit_of(ParameterKey.of_effect(effect.id, name))
                table.add_row(*told, *interval(size, unit))
                told = "", ""
        yield table
    if diagnosis.candidates:
        table = _table("candidate", "removes", "behind the best, nats")
        for candidate in diagnosis.candidates[:MOST_CANDIDATES]:
            table.add_row(
                effect_set(candidate.effects) + (" *" if candidate.in_confidence_set else ""),
                percent(candidate.held_out_shrinkage),
                f"{candidate.score:.1f}",
            )
        if any(candidate.in_confidence_set for candidate in diagnosis.candidates):
            table.caption = "* the data cannot tell it from the best"
        yield table
    moved = {name: value for name, value in diagnosis.calibration.items() if value.moved}
    if moved:
        table = _table("value that moved", "rig file", "found", "90 % interval")
        for name, value in moved.items():
            unit = unit_of(name)
            table.add_row(value_name(name), quantity(value.rig, unit), *interval(value.found, unit))
        yield table


def _gap(diagnosis: Diagnosis) -> Table:
    far = diagnosis.how_far
    assert far is not None
    headings = ("as configured", "rig values fitted", "with effects", "floor")
    table = _table("gap on held-out data", *headings)
    floor = f"{percent(far.noise_floor[0])} to {percent(far.noise_floor[1])}"
    means = (far.nominal, far.calibrated, far.augmented)
    table.add_row("all outputs", *(percent(gap) for gap in means), floor)
    for name, gaps in far.per_output.items():
        table.add_row(f"  {shown_channel(name)[0]}", *(percent(gap) for gap in gaps), "")
    if far.of_explainable is not None:
        table.caption = (
            f"The effects remove {percent_interval(far.of_explainable)} of the gap above the noise "
            "floor that remained after the fit."
        )
    return table


def _table(first: str, *headings: str) -> Table:
    table = Table(caption_justify="left")
    table.add_column(first)
    for heading in headings:
        table.add_column(heading, justify="right")
    return table
