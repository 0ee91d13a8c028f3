# SPDX-License-Identifier: MIT
"""Formats the figures of a check as words and numbers."""

from __future__ import annotations

import math

from ehsid.harness.base.numbers import plain_number
from ehsid.harness.show.page import SPACE
from ehsid.harness.show.units import percent

from ..scoring.figures import Figure, Range
from ..scoring.judging import SENSORS
from ..scoring.score import Score

MARKS = {
    "met": "met",
    "met, not surely": "met?",
    "missed, not surely": "missed?",
    "missed": "missed",
    "no target": "",
    "no data": "",
}
# Words for the kinds of case.
KINDS = {
    "one": "one effect",
    "two": "two effects",
    "none": "no gap",
    "params": "wrong values only",
    "open": "outside of the catalogue",
}
HOW_TO_READ = (
    "Each figure has its 90 % interval and the number of records in brackets. For figures of "
    "intervals and sizes, it is the number of these. A question mark after 'met' or 'missed' means "
    "that the 90 % interval reaches across the target: more records are needed to be sure."
)


def number(value: float, unit: str) -> str:
    """Returns a number with its unit, shares in per cent; a dash where it is not finite."""
    if not math.isfinite(value):
        return "-"
    if unit == "share":
        return percent(value)
    return f"{plain_number(value, 3)}{' s' if unit == 'seconds' else ''}"


def figure_text(figure: Figure) -> str:
    """Returns value, interval and n of a figure."""
    if not figure.n:
        return "-"
    value, low, high = (number(x, figure.unit) for x in (figure.value, figure.low, figure.high))
    ends = [_bare(end) for end in (low, high)]
    return f"{value} ({ends[0]}\N{EN DASH}{ends[1]}; {figure.n})"


def _bare(end: str) -> str:
    """An end of a range without its unit."""
    return end.removesuffix(f"{SPACE}%").removesuffix(" s")


def target_text(target: Range | None, unit: str) -> str:
    """Returns a target in one line; the text is empty if there is no target."""
    if target is None:
        return ""
    ends = [number(end, unit) for end in (target.least, target.most)]
    if math.isinf(target.least):
        return f"\N{LESS-THAN OR EQUAL TO} {ends[1]}"
    if math.isinf(target.most):
        return f"\N{GREATER-THAN OR EQUAL TO} {ends[0]}"
    return f"{_bare(ends[0])}\N{EN DASH}{ends[1]}"


def plural(n: int, noun: str, several: str | None = None) -> str:
    """Returns the number and the noun: `several`, or the noun with an s, unless the number is 1."""
    return f"{n} {noun if n == 1 else several or f'{noun}s'}"


def lead(score: Score) -> list[str]:
    """Says in a few sentences how far a diagnosis can be trusted."""
    if not score.cases:
        return ["Nothing has been diagnosed yet: there is nothing to score."]
    right = sum(case.judgement.right for case in score.cases)
    sentences = [
        f"Of {plural(len(score.cases), 'record')} whose cause was withheld, {right} "
        f"({percent(right / len(score.cases))}) were answered exactly right: the verdict "
        "is right, and the diagnosis names exactly the true effects or a set that contains them."
    ]
    without = sum(case.left_out for case in score.cases)
    if without:
        sentences.append(
            f"In {without} of them the diagnosis had to work without the true effect. The right "
            "answer to such a record is a set, or that the cause is outside of the catalogue."
        )
    worth = {figure.words: figure for figure in score.trust}
    if "effects" in worth:
        sentences.append(
            "If the verdict was 'effects', all that it named was right in "
            f"{figure_text(worth['effects'])} of the records. The brackets contain the 90 % "
            "interval and the number of records."
        )
    table = score.tables[0]
    for measured in SENSORS:
        figures = [
            figure for figure in table.columns[measured] if figure.target is not None and figure.n
        ]
        missed = [figure.words for figure in figures if figure.met.startswith("missed")]
        if figures:
            tail = f" Missed: {'; '.join(missed)}." if missed else ""
            sentences.append(
                f"{measured.capitalize()}, {table.title}: {len(figures) - len(missed)} of "
                f"{len(figures)} targets are met.{tail}"
            )
    for control in score.controls[:1]:
        sentences.append(
            "Negative control: if the answers are assigned to other records at random, the same "
            f"diagnoses are right in {number(control.mean, 'share')} (90 % of the assignments: "
            f"{number(control.low, 'share')} to {number(control.high, 'share')}) instead of "
            f"{number(control.real, 'share')}; p = {control.p_value:.2g}."
        )
    return sentences + _doubts(score)


def _doubts(score: Score) -> list[str]:
    sentences = []
    if score.unfinished:
        sentences.append(
            f"{plural(len(score.unfinished), 'record')} not yet diagnosed: they do not count."
        )
    if score.contradictions:
        sentences.append(
            f"{plural(len(score.contradictions), 'diagnosis', 'diagnoses')} with statements that "
            "contradict each other: this is a fault of the program; see the last table."
        )
    if score.sealed is False:
        sentences.append(
            "THE SEAL IS BROKEN: the answers are not those that were sealed before the run. These "
            "figures prove nothing."
        )
    return sentences
