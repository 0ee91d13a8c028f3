# SPDX-License-Identifier: MIT
"""Makes the tables of the report of a check (`ehsid gap-check`)."""

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
from ehsid.harness.validation.scoring.baselines import Baseline, Control
from ehsid.harness.validation.scoring.calibration import Reliability
from ehsid.harness.validation.scoring.reading import SENSORS
from ehsid.harness.validation.scoring.score import Score
from ehsid.harness.validation.scoring.tables import FigureTable, SplitTable
from ehsid.harness.validation.scoring.wrong import WrongCase


def target_table(table: FigureTable) -> Table:
    """Returns the table of the figures and their targets; rows with a missed target are marked."""
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
    """Returns the table of the share of right answers for each verdict."""
    return Table(
        "What a verdict is worth: how often it and all it names are right.",
        ("verdict", "right"),
        [(one.words.replace("_", " "), figure_text(one)) for one in score.trust],
    )


def outcome_table(score: Score) -> Table:
    """Returns the table of the number of cases with each outcome, by grade."""
    grades = sorted({case.answer.grade for case in score.cases})
    outcomes = sorted(
        {case.judgement.outcome for case in score.cases}, key=lambda o: (o != "right", o)
    )
    pairs = [(case.judgement.outcome, case.answer.grade) for case in score.cases]
    rows = [
        (outcome, *(str(pairs.count((outcome, grade))) for grade in grades)) for outcome in outcomes
    ]
    return Table("Records by outcome.", ("outcome", *grades), rows)


def bins_table(found: Reliability) -> Table:
    """Returns the table of the named effects, grouped by the probability given to them."""
    return Table(
        "Effects by the probability they were named with.",
        ("probability", "mean", "are there"),
        [
            (one.true.words, number(one.probability, "share"), figure_text(one.true))
            for one in found.bins
        ],
    )


def split_table(table: SplitTable) -> Table:
    """Returns the table of the main figures for each group of cases."""
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
    """Returns the table that compares the diagnosis with simpler ways to diagnose."""
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
    """Returns the table of the negative control, which compares the check with chance."""
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
    """Returns the table of all cases that were not answered right."""
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
