# SPDX-License-Identifier: MIT
"""Prints the summary of a diagnosis on the terminal."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from ..diagnosis.result import Diagnosis
from ..diagnosis.schema import Remark
from ..show.gap_words import (
    brief_tables,
    effect_set,
    plain_name,
    told_reasons,
    told_remarks,
)
from ..show.units import percent
from ..show.verdict_words import VERDICTS
from .console import Console, print_blocks, print_points


def print_diagnosis(
    diagnosis: Diagnosis, folder: Path, console: Console, shown: Collection[Remark] = ()
) -> None:
    """Prints the verdict in a sentence and then its reasons; the details are in the report.

    shown: remarks that the user has seen already, which are not printed again.
    """
    title = VERDICTS[diagnosis.verdict].title
    console.print(f"\n{title}", style="bold")
    console.print(diagnosis.sentence, style="bold")
    print_points(told_reasons(diagnosis), console)
    for table in brief_tables(diagnosis):
        console.print()
        print_blocks([table], console)
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
        unjudged = diagnosis.cannot_judge
        print_points((f"{plain_name(effect.id)}: {effect.why}" for effect in unjudged), console)
    for remark in told_remarks(diagnosis):
        if remark in shown:
            continue
        sign, style = ("serious", "red") if remark.serious else ("note", None)
        about = f"{remark.record}: " if remark.record else ""
        console.print(f"{sign}: {about}{remark.what}", style=style)
    console.print(f"\nreport: {folder / 'report.html'}", soft_wrap=True)
