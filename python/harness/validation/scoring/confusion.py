# SPDX-License-Identifier: MIT
"""Confusion tables: counts of cases by their truth and by their diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.validation.scoring.judged_case import Scored
from ehsid.harness.validation.scoring.reading import FAILED

KINDS = ("one", "two", "none", "params", "open")
VERDICTS = (
    "effects",
    "ambiguous",
    "outside_catalogue",
    "parameters",
    "no_gap",
    "insufficient_data",
)


@dataclass(frozen=True)
class Confusion:
    """Counts of cases by truth (rows) and diagnosis (columns)."""

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    counts: tuple[tuple[int, ...], ...]


def of_verdicts(cases: Sequence[Scored]) -> Confusion:
    """Counts the cases by their kind (rows) and verdict (columns)."""
    pairs = [(case.answer.kind, case.said.verdict) for case in cases]
    failed = [FAILED] if any(said == FAILED for _, said in pairs) else []
    return _counted(pairs, KINDS, (*VERDICTS, *failed))


def of_effects(cases: Sequence[Scored]) -> Confusion:
    """Counts the cases with one effect or none by this effect and by the first name.

    Rows are the effects in the order of the catalogue, those outside of it, then the kinds without
    effect. Where nothing was named, the column is the verdict.
    """
    pairs = []
    for case in cases:
        if case.answer.kind == "two":
            continue
        true = next(iter(case.answer.effects), case.answer.kind)
        said = case.said.named[0].id if case.said.named else case.said.verdict
        pairs.append((true, said))
    known = list(effects())
    seen = {true for true, _ in pairs}
    rows = [one for one in known if one in seen]
    rows += sorted(seen - set(known) - set(KINDS)) + [one for one in KINDS if one in seen]
    told = {said for _, said in pairs}
    columns = known + [one for one in (*VERDICTS, FAILED) if one in told]
    columns += sorted(told - set(columns))
    return _counted(pairs, rows, columns)


def _counted(
    pairs: Sequence[tuple[str, str]], rows: Sequence[str], columns: Sequence[str]
) -> Confusion:
    counts = tuple(tuple(pairs.count((row, column)) for column in columns) for row in rows)
    return Confusion(tuple(rows), tuple(columns), counts)
