# SPDX-License-Identifier: MIT
"""Splits of the score: a few figures for each of many groups of cases."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ehsid.harness.validation.scoring.figures import Figure, share
from ehsid.harness.validation.scoring.judged_case import GAP_NAMES, Scored, by
from ehsid.harness.validation.scoring.right import KNOWN

FIGURES: tuple[tuple[str, Callable[[Scored], bool | None]], ...] = (
    ("right", lambda case: case.judged.right),
    ("subsystem first", lambda case: case.judged.subsystem_first),
    ("effect first", lambda case: case.judged.effect_first),
    ("truth in set", lambda case: case.judged.in_set),
    ("wrong name", lambda case: case.judged.wrong_name),
)


@dataclass(frozen=True)
class Split:
    """A way to group cases; `group` returns the group of a case, or None where it has none."""

    title: str
    group: Callable[[Scored], str | None]
    order: Sequence[str] = ()


@dataclass(frozen=True)
class SplitTable:
    """Table of a split; a row has the group, what was measured, and `FIGURES` of these cases."""

    title: str
    rows: tuple[tuple[str, str, tuple[Figure, ...]], ...]


def _known_gap(case: Scored) -> str | None:
    return case.gap_size if case.answer.kind in KNOWN else None


def _only_effect(case: Scored) -> str | None:
    return next(iter(case.answer.effects)) if len(case.answer.effects) == 1 else None


SPLITS = (
    Split("grade", lambda case: case.answer.grade),
    Split("kind of case", lambda case: case.answer.kind),
    Split("gap of the calibrated rig, cases with known effects", _known_gap, GAP_NAMES),
    Split("excitation of the fitted record", lambda case: case.answer.excitation[0]),
    Split("excitation of the held-out record", lambda case: case.answer.excitation[-1]),
    Split("sensors", lambda case: case.answer.sensors),
    Split("plant", lambda case: case.answer.plant),
    Split("effect, where it is the only one", _only_effect),
)


def split_tables(cases: Sequence[Scored]) -> tuple[SplitTable, ...]:
    """Returns the table of every split; its rows separate the cases by what was measured."""
    return tuple(SplitTable(split.title, _rows(split, cases)) for split in SPLITS)


def _rows(split: Split, cases: Sequence[Scored]) -> tuple[tuple[str, str, tuple[Figure, ...]], ...]:
    groups = by([case for case in cases if split.group(case)], lambda case: split.group(case) or "")
    names = sorted(groups, key=lambda name: (split.order.index(name) if split.order else 0, name))
    return tuple(
        (name, measured, tuple(share(words, map(answer, some)) for words, answer in FIGURES))
        for name in names
        for measured, some in by(groups[name], lambda case: case.answer.measured).items()
    )
