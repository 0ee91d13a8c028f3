# SPDX-License-Identifier: MIT
"""What a reader of a diagnosis wants first: where, which, how far, and what to do next."""

from __future__ import annotations

import re

from ..catalogue.keys import ParameterKey
from ..catalogue.parameters import effects
from ..diagnosis.result import Diagnosis
from ..diagnosis.schema import SUBSYSTEM_TAKES_PART, Estimate, HowFar
from ..rigs.table_words import table_words
from .gap_words import (
    chosen,
    effect_set,
    first_upper,
    interval,
    named_effects,
    plain_name,
    unit_of,
    value_name,
)
from .next_words import what_now
from .page import Fact, Facts, Tagged
from .shares import percent, percent_ends


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
        words = {"no_gap": "nowhere", "parameters": "in the values of the rig"}
        return Fact("Where", words.get(diagnosis.verdict, "not known"))
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
    moved = [value_name(name) for name, value in diagnosis.calibration.items() if value.moved]
    if diagnosis.verdict == "parameters" and moved:
        return Fact("Which", ", ".join(moved), "No effect is named.")
    words = {
        "no_gap": "no effect is named",
        "parameters": "values within their uncertainty, and what no data sheet states",
        "outside_catalogue": "no effect of the catalogue",
    }
    return Fact("Which", words.get(diagnosis.verdict, "not known"))


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
            words += f"; {value_name(key).partition(': ')[2]} {value} ({ends})"
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
