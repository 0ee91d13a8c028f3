# SPDX-License-Identifier: MIT
"""Tables of a check."""

from __future__ import annotations

from collections.abc import Sequence

from ehsid.harness.report.check_words import (
    KINDS,
    MARKS,
    figure_text,
    number,
    target_text,
)
from ehsid.harness.report.gap_words import plain_name
from ehsid.harness.report.page import Table
from ehsid.harness.validation.scoring.baselines import Baseline
from ehsid.harness.validation.scoring.calibration import Reliability
from ehsid.harness.validation.scoring.control import Control
from ehsid.harness.validation.scoring.reading import SENSORS
from ehsid.harness.validation.scoring.score import Score
from ehsid.harness.validation.scoring.splits import SplitTable
from ehsid.harness.validation.scoring.table import FigureTable
from ehsid.harness.validation.scoring.wrong import WrongCase


def target_table(table: FigureTable) -> Table:
    """Figures beside their targets."""
    rows: list[list[str]] = []
    missed: list[int] = []
    for pair in zip(*(table.columns[measured] for measured in SENSORS), strict=True):
        cells = [pair[0].words]
        for one in pair:
            target = target_text(one.target, one.unit)
            cells += [figure_text(one), ": ".join(filter(None, (target, MARKS[one.met])))]
        if any(one.met == "missed" for one in pair):
            missed.append(len(rows))
        rows.append(cells)
    return Table(
        f"{table.title.capitalize()}.",
        ("figure", SENSORS[0], "target", SENSORS[1], "target"),
        rows,
        missed,
    )


def trust_table(score: Score) -> Table:
    """What a verdict is worth."""
    return Table(
        "What a verdict is worth: how often it and all it names are right.",
        ("verdict", "right"),
        [(one.words.replace("_", " "), figure_text(one)) for one in score.trust],
    )


def outcome_table(score: Score) -> Table:
    """How many cases of each outcome, by grade."""
    grades = sorted({case.answer.grade for case in score.cases})
    outcomes = sorted(
        {case.judged.outcome for case in score.cases}, key=lambda o: (o != "right", o)
    )
    pairs = [(case.judged.outcome, case.answer.grade) for case in score.cases]
    rows = [
        (outcome, *(str(pairs.count((outcome, grade))) for grade in grades)) for outcome in outcomes
    ]
    return Table("Records by outcome.", ("outcome", *grades), rows)


def bins_table(found: Reliability) -> Table:
    """Effects by the probability they were named with."""
    return Table(
        "Effects by the probability they were named with.",
        ("probability", "mean", "are there"),
        [
            (one.true.words, number(one.probability, "share"), figure_text(one.true))
            for one in found.bins
        ],
    )


def split_table(table: SplitTable) -> Table:
    """Few figures by group."""
    rows = [
        (
            KINDS.get(group, plain_name(group)),
            measured,
            *(figure_text(one, short=True) for one in figures),
        )
        for group, measured, figures in table.rows
    ]
    words = [one.words for one in table.rows[0][2]] if table.rows else []
    return Table(f"By {table.title}.", ("", "sensors", *words), rows)


def baseline_table(each: Sequence[Baseline]) -> Table:
    """Ways to diagnose beside each other."""
    words = [one.words for one in each[0].figures] if each else []
    rows = []
    for one in each:
        found = {figure.words: figure_text(figure, short=True) for figure in one.figures}
        rows.append((one.name, *(found.get(name, "-") for name in words)))
    return Table(
        "Simpler ways, judged alike. Effect first: gap at least 3 x floor.",
        ("way", *words),
        rows,
        [0],
    )


def control_table(each: Sequence[Control]) -> Table:
    """The check against chance."""
    return Table(
        "Negative control: answers dealt out anew among the records of the same sensors.",
        ("figure", "this check", "chance", "mean of the deals", "90 % of the deals", "p", "deals"),
        [
            (
                one.words,
                number(one.real, "share"),
                number(one.chance, "share"),
                number(one.mean, "share"),
                f"{number(one.low, 'share')} to {number(one.high, 'share')}",
                f"{one.p_value:.2g}",
                str(one.deals),
            )
            for one in each
        ],
    )


def wrong_table(each: Sequence[WrongCase]) -> Table:
    """The honest list."""
    return Table(
        "Every record that was not answered right, the worst first. Nats: held-out log-likelihood; "
        "within 10 two explanations are alike for all that the record can tell.",
        ("record", "grade, sensors", "outcome", "truth", "said", "why it may be"),
        [
            (
                one.name,
                f"{one.grade}, {one.sensors}",
                one.outcome,
                one.truth.replace("_", " "),
                one.said.replace("_", " "),
                "; ".join(one.reasons) or "not known",
            )
            for one in each
        ],
    )
