# SPDX-License-Identifier: MIT
"""Tables of a diagnosis in brief, as the command and the Python interface show them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ..catalogue.channels import shown_channel
from ..catalogue.keys import ParameterKey
from ..diagnosis.result import Diagnosis
from ..diagnosis.schema import Candidate, HowFar, Remark
from ..rigs.table_words import table_words
from .gap_words import (
    SIMULATIONS,
    STANDINGS,
    candidate_notes,
    chosen,
    effect_set,
    interval,
    nats_behind,
    plain_name,
    quantity,
    unit_of,
    value_name,
)
from .page import Table
from .shares import percent, percent_interval

# More candidates than this are easier to read on the page.
MOST_CANDIDATES = 5


def told_reasons(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Returns the reasons of the verdict that its sentence does not say already."""
    return tuple(reason for reason in diagnosis.reasons if reason not in diagnosis.sentence)


def told_remarks(diagnosis: Diagnosis) -> tuple[Remark, ...]:
    """Returns the remarks on the records that no reason of the verdict says already."""
    reasons = " ".join(diagnosis.reasons)
    return tuple(
        remark
        for remark in diagnosis.remarks
        if not (remark.serious and remark.what.rstrip(".") in reasons)
    )


def brief_tables(diagnosis: Diagnosis) -> Iterator[Table]:
    """Yields the tables that a diagnosis has something for, the gap first."""
    if diagnosis.how_far is not None:
        added = bool(diagnosis.effects or diagnosis.missing_laws)
        yield _gap(diagnosis.how_far, added=added)
    if diagnosis.where.subsystem:
        shares = sorted(diagnosis.where.subsystem.items(), key=lambda item: -item[1])
        rows = [(name, percent(share)) for name, share in shares]
        yield Table("", ("where", "share of the gap"), rows)
    if diagnosis.effects:
        sizes = [
            (
                *((plain_name(effect.id), percent(effect.probability)) if i == 0 else ("", "")),
                *interval(size, unit_of(ParameterKey.of_effect(effect.id, name))),
            )
            for effect in diagnosis.effects
            for i, (name, size) in enumerate(effect.parameters.items())
        ]
        yield Table("", ("effect", "probability", "size", "90 % interval"), sizes)
    if diagnosis.missing_laws:
        laws = [
            (
                table_words(found.law.adds_to, found.law.of),
                found.looks_like,
                percent(found.share_of_shrinkage),
            )
            for found in diagnosis.missing_laws
        ]
        yield Table("", ("missing law", "its form", "share of what is removed"), laws)
    if diagnosis.candidates:
        yield _candidates(diagnosis.candidates)
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
        yield Table("", ("value that moved", "rig file", "estimate", "90 % interval"), moved)


def _candidates(candidates: Sequence[Candidate]) -> Table:
    """The first candidates, and the one that was chosen wherever it stands."""
    best = chosen(candidates)
    shown = list(candidates[:MOST_CANDIDATES])
    if not any(candidate is best for candidate in shown):
        shown[-1] = best
    rows = [
        (
            effect_set(candidate.effects),
            percent(candidate.held_out_shrinkage),
            nats_behind(candidate, best),
            "" if candidate.probability is None else percent(candidate.probability),
            STANDINGS[candidate.standing],
        )
        for candidate in shown
    ]
    headings = ("candidate", "removes", "nats behind", "probability", "decision")
    return Table("", headings, rows, note=candidate_notes(shown))


def _gap(gap: HowFar, *, added: bool) -> Table:
    """added: whether effects or laws were added to the last simulation."""
    floor = " to ".join(map(percent, gap.noise_floor))
    means = (gap.nominal, gap.calibrated, gap.augmented)
    rows = [("all outputs", *map(percent, means), floor)]
    rows += [
        (f"  {shown_channel(name)[0]}", *map(percent, gaps), "")
        for name, gaps in gap.per_output.items()
    ]
    caption = ""
    if added and gap.of_explainable is not None:
        caption = (
            f"What was found removes {percent_interval(gap.of_explainable)} of the gap above the "
            "noise floor that remained after the fit. The range is for other motions of this "
            "machine."
        )
    headings = ("gap on held-out data", *SIMULATIONS.values(), "floor")
    return Table("", headings, rows, note=caption)
