# SPDX-License-Identifier: MIT
"""The section of a diagnosis on which effect it is."""

from __future__ import annotations

from collections.abc import Sequence

from ..catalogue.keys import ParameterKey
from ..catalogue.parameters import effects
from ..diagnosis.result import Diagnosis
from ..diagnosis.schema import Candidate, Effect
from .gap_marks import share_bar
from .gap_words import (
    STANDINGS,
    candidate_notes,
    chosen,
    interval,
    named_effect,
    named_effects,
    nats_behind,
    plain_name,
    quantity,
    unit_of,
    value_name,
)
from .page import Block, Card, Code, Folded, Heading, Items, Note, Section, Table, Tagged
from .shares import percent

# Number of candidates that the page shows unfolded.
SHOWN_CANDIDATES = 8


def which_section(diagnosis: Diagnosis) -> Section:
    """Returns the section; it has no blocks where no effect was looked for."""
    blocks: list[Block] = []
    several = len(diagnosis.ambiguity_set) > 1
    if several:
        sets = [named_effects(names) for names in diagnosis.ambiguity_set]
        blocks += [
            "The data cannot tell these apart, best first:",
            Items(sets, numbered=True),
        ]
    blocks += [
        _card(effect, several=several, shared=len(diagnosis.effects) > 1)
        for effect in diagnosis.effects
    ]
    if diagnosis.candidates:
        rest = len(diagnosis.candidates) - SHOWN_CANDIDATES
        blocks += [
            Heading("All that was tried, ranked on held-out data"),
            _candidates(diagnosis.candidates, 0, SHOWN_CANDIDATES),
        ]
        if rest > 0:
            table = _candidates(diagnosis.candidates, SHOWN_CANDIDATES, None)
            blocks.append(Folded(f"{rest} more", [table]))
        blocks.append(
            Note(
                "Every set was fitted together with all values of the rig, with the same budget. "
                f"{candidate_notes(diagnosis.candidates)} "
                '"Gap removed" is the share of the gap above the noise floor that remained after '
                "the rig's values were fitted. Marked sets are those the data cannot tell from the "
                "best."
            )
        )
    if diagnosis.outside_probability is not None:
        blocks.append(
            Note(
                "Probability of a cause outside of the catalogue: "
                f"{percent(diagnosis.outside_probability)}."
            )
        )
    return Section("Which effect", blocks)


def _card(effect: Effect, *, several: bool, shared: bool) -> Card:
    info = effects()[effect.id]
    meanings = {parameter.name: parameter.meaning for parameter in info.parameters}
    notes = [
        *(["most probable of the set"] if several else []),
        info.subsystem,
        f"probability {percent(effect.probability)}",
        *([f"{percent(effect.share_of_shrinkage)} of what is removed"] if shared else []),
    ]
    sizes = Table(
        "",
        ("size", "estimate", "90 % interval"),
        [
            (
                Tagged(meanings.get(name, plain_name(name)), hint=name),
                *interval(estimate, unit_of(ParameterKey.of_effect(effect.id, name))),
            )
            for name, estimate in effect.parameters.items()
        ],
    )
    source = [Note(info.source)] if info.source else []
    equation = Folded("Equation", [Code(info.equation), *source])
    return Card(named_effect(effect.id), [Note(" · ".join(notes)), sizes, equation])


def _candidates(candidates: Sequence[Candidate], first: int, end: int | None) -> Table:
    best = chosen(candidates)
    rows = [
        (
            named_effects(
                candidate.effects,
                f"{rank}. ",
                STANDINGS[candidate.standing] if candidate.in_confidence_set else "",
            ),
            nats_behind(candidate, best),
            share_bar("", candidate.held_out_shrinkage),
            "" if candidate.probability is None else percent(candidate.probability),
            ", ".join(
                f"{value_name(f'effects.{name}')} "
                f"{quantity(value, unit_of(f'effects.{name}'), 3)}".partition(": ")[2]
                for name, value in candidate.parameters.items()
            ),
            _decision(candidate),
        )
        for rank, candidate in enumerate(candidates[first:end], start=first + 1)
    ]
    marked = [i for i, candidate in enumerate(candidates[first:end]) if candidate.in_confidence_set]
    columns = ("effects", "nats behind", "gap removed", "probability", "sizes", "decision")
    return Table("", columns, rows, marked)


def _decision(candidate: Candidate) -> str:
    return ": ".join(filter(None, (STANDINGS[candidate.standing], candidate.why)))
