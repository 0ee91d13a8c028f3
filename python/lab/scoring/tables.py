# SPDX-License-Identifier: MIT
"""Tables of a score: the figures with their targets, the same by group, and confusion tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ehsid.harness.catalogue.parameters import effects

from ..blind.making import GRADES
from .figures import Figure, Range, SizeError, effect_errors, mean, quantile, rig_errors, share
from .findings import FAILED
from .judging import GAP_NAMES, KINDS, SENSORS, ScoredCase, group_by
from .unseen import unseen_effects

# Grades whose records should allow one name; smooth and small records often allow only a set.
MAIN_GRADES = ("plain", "hard")
# Verdicts in the order of the columns of a table.
VERDICTS = (
    "effects",
    "ambiguous",
    "outside_catalogue",
    "parameters",
    "no_gap",
    "insufficient_data",
)


def _least(pressures: float, position: float) -> dict[str, Range]:
    return dict(zip(SENSORS, (Range(least=pressures), Range(least=position)), strict=True))


def _most(pressures: float, position: float) -> dict[str, Range]:
    return dict(zip(SENSORS, (Range(most=pressures), Range(most=position)), strict=True))


# Targets of a diagnosis, first with measured chamber pressures, then with the position only.
TARGETS = {
    "subsystem": _least(0.97, 0.92),
    "effect": _least(0.95, 0.90),
    "in_set": _least(0.97, 0.95),
    "set_size": _most(1.3, 2.0),
    "wrong_name": _most(0.02, 0.03),
    "false_effect": _most(0.01, 0.02),
    "recognised": _least(0.95, 0.80),
    "rejected": _most(0.03, 0.03),
    "two": _least(0.85, 0.70),
    "size": _most(0.01, 0.02),
    "size_90": _most(0.10, 0.20),
    "coverage": dict.fromkeys(SENSORS, Range(0.85, 0.95)),
    "shrinkage": _least(0.97, 0.95),
    "shrinkage_friction": _least(0.8, 0.8),
    "seconds": _most(20.0, 10.0),
}
# Targets of slow records (20 and 50 ms), whatever was measured. They replace those above; the other
# figures of slow records have no target.
SLOW_TARGETS = {
    "subsystem": _least(0.85, 0.85),
    "in_set": _least(0.90, 0.90),
    "false_effect": _most(0.03, 0.03),
}


@dataclass(frozen=True)
class FigureTable:
    """Figures of some cases, separated by what was measured; all columns have the same rows."""

    title: str
    """Which cases these are."""
    columns: dict[str, tuple[Figure, ...]]
    """Figures for each of `SENSORS`."""


@dataclass(frozen=True)
class SplitTable:
    """Main figures by group; a row has the group, what was measured, and the figures."""

    title: str
    rows: tuple[tuple[str, str, tuple[Figure, ...]], ...]


@dataclass(frozen=True)
class Confusion:
    """Counts of cases by truth (rows) and diagnosis (columns)."""

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    counts: tuple[tuple[int, ...], ...]


def figure_tables(cases: Sequence[ScoredCase]) -> tuple[FigureTable, ...]:
    """Returns the figures of plain and hard cases together, then of each grade that there is."""
    grades = group_by(cases, lambda case: case.answer.grade)
    main = [case for case in cases if case.answer.grade in MAIN_GRADES]
    return (
        _figure_table("plain and hard records", main),
        *(
            _figure_table(
                f"{name} records", grades[name], SLOW_TARGETS if name == "slow" else TARGETS
            )
            for name in GRADES
            if name in grades
        ),
    )


def _figure_table(
    title: str, cases: Sequence[ScoredCase], targets: Mapping[str, Mapping[str, Range]] = TARGETS
) -> FigureTable:
    by_sensors = group_by(cases, lambda case: case.measured)
    columns = {}
    for name in SENSORS:
        target = {figure: ranges[name] for figure, ranges in targets.items()}
        columns[name] = _figures(by_sensors.get(name, []), target.get)
    return FigureTable(title, columns)


def _figures(
    cases: Sequence[ScoredCase], target: Callable[[str], Range | None]
) -> tuple[Figure, ...]:
    judged = [case.judgement for case in cases]
    known = [case for case in cases if case.known]
    large = [case for case in known if case.name_required]
    errors = effect_errors(cases)
    sizes = [error.relative for error in errors if error.primary]
    every = [error.relative for error in errors]
    seconds = [case.findings.seconds for case in cases]
    unseen = [one.over_limit < 1.0 for case in cases for one in unseen_effects(case)]

    def of(kind: str) -> list[ScoredCase]:
        return [case for case in cases if case.answer.kind == kind]

    return (
        share("subsystem first", (c.judgement.subsystem_first for c in known), target("subsystem")),
        share("subsystem of an unknown effect", (c.judgement.subsystem_first for c in of("open"))),
        share(
            "effect first, gap \N{GREATER-THAN OR EQUAL TO} 3 x floor",
            (c.judgement.effect_first for c in large),
            target("effect"),
        ),
        share("effect first, all", (c.judgement.effect_first for c in known)),
        share("truth inside the set", (j.in_set for j in judged), target("in_set")),
        mean(
            "sets returned, mean",
            (float(c.judgement.set_size or math.nan) for c in known),
            target=target("set_size"),
        ),
        share("a confident wrong name", (j.wrong_name for j in judged), target("wrong_name")),
        share(
            "effect blamed, none there",
            (j.false_effect for j in judged),
            target("false_effect"),
        ),
        share("structure blamed, none there", (j.false_alarm for j in judged)),
        share("unknown effect recognised", (j.recognised for j in judged), target("recognised")),
        share("law of an unknown effect, where found", (j.law for j in judged)),
        share("beside it exactly the known effects", (j.beside for j in judged)),
        share("known effect rejected", (j.rejected for j in judged), target("rejected")),
        share("listed as not to be judged", (j.abstained for j in judged)),
        share("not named: smaller than the page says it can see", unseen),
        share("one effect: exactly it", (c.judgement.exact for c in of("one"))),
        share("two effects: exactly both", (c.judgement.exact for c in of("two")), target("two")),
        quantile("error of size, median", sizes, target=target("size")),
        quantile("error of size, 90th percentile", sizes, 0.9, target=target("size_90")),
        quantile("error of all parameters, median", every),
        quantile("of all parameters, 90th percentile", every, 0.9),
        _coverage("sizes inside their intervals", errors, target("coverage")),
        _coverage("rig values inside their intervals", rig_errors(cases)),
        quantile(
            "explainable gap closed, median",
            [_shrinkage(case) for case in large if not _has_friction(case)],
            target=target("shrinkage"),
        ),
        quantile(
            "the same of friction, median",
            [_shrinkage(case) for case in large if _has_friction(case)],
            target=target("shrinkage_friction"),
        ),
        quantile("time, median", seconds, unit="seconds", target=target("seconds")),
        quantile("time, 90th percentile", seconds, 0.9, unit="seconds"),
    )


def _coverage(words: str, errors: Sequence[SizeError], target: Range | None = None) -> Figure:
    return share(words, (error.inside for error in errors), target)


def _has_friction(case: ScoredCase) -> bool:
    return any(effect.endswith("_friction") for effect in case.answer.effects)


def _shrinkage(case: ScoredCase) -> float:
    shrinkage = case.findings.of_explainable
    return math.nan if shrinkage is None else shrinkage.value


# Ways to group cases; None for a case that has no group.
SPLITS: dict[str, Callable[[ScoredCase], str | None]] = {
    "grade": lambda case: case.answer.grade,
    "kind of case": lambda case: case.answer.kind,
    "gap of the calibrated rig, cases with known effects": lambda case: (
        case.gap_size if case.known else None
    ),
    "excitation of the fitted record": lambda case: case.answer.excitation[0],
    "excitation of the held-out record": lambda case: case.answer.excitation[-1],
    "sensors": lambda case: case.answer.sensors,
    "commands of the controller in the log": lambda case: (
        "all" if case.answer.logged_every == 1 else f"one of {case.answer.logged_every}"
    ),
    "plant": lambda case: case.answer.plant,
    "effect, where it is the only one": lambda case: (
        next(iter(case.answer.effects)) if len(case.answer.effects) == 1 else None
    ),
}


def split_tables(cases: Sequence[ScoredCase]) -> tuple[SplitTable, ...]:
    """Returns the main figures for each way to group; rows are separated by what was measured."""
    return tuple(
        SplitTable(
            title,
            tuple(
                (name, measured, _main_figures(some))
                for name, group in sorted(group_by(cases, key).items(), key=_place)
                for measured, some in group_by(group, lambda case: case.measured).items()
            ),
        )
        for title, key in SPLITS.items()
    )


# A share of fewer cases says nothing: of ten right ones the interval reaches down to 79 %.
LEAST_CASES = 10


def family_table(cases: Sequence[ScoredCase]) -> SplitTable:
    """Returns the main figures of each family of machines, the worst first.

    A check fits nothing, so that each family is as good as left out: what was chosen on other
    families is judged on this one. The worst is the one whose interval of the right answers ends
    lowest: small families scatter, and the lowest share alone would often be that of the smallest.
    Families with fewer than LEAST_CASES cases are left out, and those with nearly all of them.
    """
    groups: dict[str, list[ScoredCase]] = {}
    for case in cases:
        for trait, family in {**case.answer.families, "sensors": case.answer.sensors}.items():
            groups.setdefault(f"{trait}: {family}", []).append(case)
    rows = [
        (name, "all", _main_figures(some))
        for name, some in groups.items()
        if LEAST_CASES <= len(some) <= len(cases) - LEAST_CASES
    ]
    rows.sort(key=lambda row: (row[2][0].high, row[0]))
    return SplitTable("family of machines, the worst first", tuple(rows))


def _place(item: tuple[str, list[ScoredCase]]) -> tuple[int, str]:
    """Sizes of the gap are in rising order, all other groups in alphabetic order."""
    name = item[0]
    return GAP_NAMES.index(name) if name in GAP_NAMES else 0, name


def _main_figures(cases: Sequence[ScoredCase]) -> tuple[Figure, ...]:
    judged = [case.judgement for case in cases]
    return (
        share("right", (j.right for j in judged)),
        share("subsystem first", (j.subsystem_first for j in judged)),
        share("effect first", (j.effect_first for j in judged)),
        share("truth in set", (j.in_set for j in judged)),
        share("wrong name", (j.wrong_name for j in judged)),
    )


def confusion_of_verdicts(cases: Sequence[ScoredCase]) -> Confusion:
    """Counts the cases by their kind (rows) and verdict (columns)."""
    pairs = [(case.answer.kind, case.findings.verdict) for case in cases]
    failed = [FAILED] if any(verdict == FAILED for _, verdict in pairs) else []
    return _counted(pairs, KINDS, (*VERDICTS, *failed))


def confusion_of_effects(cases: Sequence[ScoredCase]) -> Confusion:
    """Counts the cases with one effect or none by this effect and by the first name.

    Rows are the effects in the order of the catalogue, those outside of it, then the kinds without
    effect. Where nothing was named, the column is the verdict.
    """
    pairs = [
        (
            next(iter(case.answer.effects), case.answer.kind),
            case.findings.named[0].id if case.findings.named else case.findings.verdict,
        )
        for case in cases
        if case.answer.kind != "two"
    ]
    catalogue = list(effects())
    true, named = ({pair[i] for pair in pairs} for i in range(2))
    rows = [effect for effect in catalogue if effect in true]
    rows += sorted(true - {*catalogue, *KINDS}) + [kind for kind in KINDS if kind in true]
    columns = catalogue + [verdict for verdict in (*VERDICTS, FAILED) if verdict in named]
    return _counted(pairs, rows, columns + sorted(named - {*columns}))


def _counted(
    pairs: Sequence[tuple[str, str]], rows: Sequence[str], columns: Sequence[str]
) -> Confusion:
    counts = tuple(tuple(pairs.count((row, column)) for column in columns) for row in rows)
    return Confusion(tuple(rows), tuple(columns), counts)
