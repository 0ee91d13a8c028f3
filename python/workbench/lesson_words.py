# SPDX-License-Identifier: MIT
"""Guess, diagnosis and truth of a lesson side by side."""

from __future__ import annotations

from ehsid.harness.catalogue.keys import ParameterKey
from ehsid.harness.diagnosis.schema import DiagnosisFile, read_diagnosis_file
from ehsid.harness.rigs import read_rig
from ehsid.harness.show.gap_words import (
    effect_set,
    first_upper,
    interval,
    plain_name,
    quantity,
    unit_of,
    value_name,
)
from ehsid.harness.show.page import Table, Tagged

from . import look
from .lesson import Lesson, truth
from .session import Session


def outcome_html(session: Session, lesson: Lesson) -> str:
    """Returns the outcome of a lesson whose diagnosis holds, as HTML."""
    found = read_diagnosis_file(session.folder / "gap" / "diagnosis.json")
    effect, sizes = truth(read_rig(session.rig_file), lesson.seed)
    sizes_told = [f"{_name(key)}: {quantity(size, unit_of(key), 3)}" for key, size in sizes.items()]
    rows: list[tuple[str | Tagged, ...]] = [
        ("your guess", _marked(_guess(lesson), lesson.guess == effect), ""),
        ("the diagnosis", _marked(named(found), is_found(found, effect)), _found_sizes(found)),
        ("the truth", first_upper(plain_name(effect)), "; ".join(sizes_told)),
    ]
    report = f"/result/{session.name}/gap/report.html"
    return (
        f'<p class="verdict">{look.plain(found.sentence)}</p>'
        + look.told(Table("", ("", "effect", "size (interval of 90 %)"), rows))
        + f'<p class="soft">Seed of this lesson: {lesson.seed}. '
        f'<a href="{report}" target="_blank">Report of the diagnosis</a></p>'
    )


def named(found: DiagnosisFile) -> str:
    """Returns in words what a diagnosis names as the cause."""
    sets = found.which.ambiguity_set if found.verdict == "ambiguous" else ()
    if sets:
        return " or ".join(map(effect_set, sets))
    return effect_set(tuple(effect.id for effect in found.which.effects))


def is_found(found: DiagnosisFile, effect: str) -> bool | None:
    """Whether a diagnosis names just this effect; None where it is one of several answers."""
    ids = [one.id for one in found.which.effects]
    if found.verdict == "ambiguous" and (effect,) in found.which.ambiguity_set:
        return None
    if ids == [effect]:
        return True
    return None if effect in ids else False


def _guess(lesson: Lesson) -> str:
    return "no idea" if lesson.guess == "none" else plain_name(lesson.guess)


def _marked(words: str, right: bool | None) -> Tagged:
    text = first_upper(words)
    if right is None:
        return Tagged(f"≈ {text}: among others", kind="soft")
    return Tagged(f"✓ {text}", kind="good") if right else Tagged(f"✗ {text}", kind="bad")


def _found_sizes(found: DiagnosisFile) -> str:
    lines = []
    for effect in found.which.effects:
        for name, size in effect.parameters.items():
            key = ParameterKey.of_effect(effect.id, name)
            value, ends = interval(size, unit_of(key))
            lines.append(f"{_name(key)}: {value} ({ends})")
    return "; ".join(lines)


def _name(key: str) -> str:
    return value_name(key).partition(": ")[2]
